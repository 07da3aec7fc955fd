"""What is run: scenes, meshes, friction, and the paths that the positions are reached along."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from support import DATA

import fastncm
from fastncm.scene import Scene

from .deck import Increments
from .model import Model
from .rubber import rubber
from .snapfit import Fineness, snapfit

RUBBER = "rubber-ellipse"
SMALL = "rubber-ellipse, small"
"""The scene of data/fem_ellipse.csv."""
DEGREES = (78.0, 84.0, 90.0, 96.0, 102.0, 108.0, 114.0, 120.0, 126.0)
"""Where the shipped rubber scene is compared."""
MATERIAL = "Ciarlet"
MESHES = {
    "snapfit-circle": {
        "coarse": Fineness(14, 1, 0.2, 1e4),
        "medium": Fineness(28, 2, 0.2, 1e4),
        "fine": Fineness(56, 3, 0.2, 1e4),
    },
    "snapfit-corner": {
        "coarse": Fineness(14, 1, 0.2, 1e4),
        "medium": Fineness(28, 2, 0.2, 1e4),
        "fine": Fineness(56, 3, 0.2, 1e4),
    },
    SMALL: {
        "coarse": Fineness(12, 2, 4.0, 10.0),
        "medium": Fineness(18, 2, 4.0, 10.0),
        "fine": Fineness(24, 3, 4.0, 10.0),
    },
    RUBBER: {"coarse": Fineness(12, 2, 5.0, 10.0)},
}
"""Of the shipped rubber scene a mesh of 24 by 3 elements does not get beyond 98 degrees."""
FRICTION = {
    "snapfit-circle": (0.0, 0.2, 0.4),
    "snapfit-corner": (0.0, 0.2, 0.4),
    SMALL: (0.0,),
    RUBBER: (0.0,),
}
IN_MM, IN_DEGREES = Increments(0.02, 0.5), Increments(0.1, 1.0)
CIRCLE_FROM, CORNER_FROM = 0.0783, 0.0745
"""Where the targets begin, m: just before first touch."""
PASSED = 0.0575
"""Beyond, the block's corner has passed the jaw's corner a, m. At a itself the force jumps, which
displacements prescribed in small steps do not get over: positions beyond have a path of their
own, on which the block comes down on the jaw with its underside."""
DOWN_FROM, LIFT = 0.05695, 6.0
"""Where that path begins, m, and how far above, mm."""


@dataclass(frozen=True)
class Case:
    """A scene by name, a mesh by name, a coefficient of friction, and the penalty in multiples of
    the mesh's own."""

    scene: str
    mesh: str
    mu: float
    penalty: float = 1.0

    @property
    def name(self) -> str:
        """As the study's arguments give it."""
        return f"{self.scene}:{self.mesh}:{self.mu:g}"

    @property
    def fineness(self) -> Fineness:
        """The mesh and its penalty."""
        mesh = MESHES[self.scene][self.mesh]
        return replace(mesh, stiffness=self.penalty * mesh.stiffness)

    def beam(self, **changes: object) -> Scene:
        """The scene with this friction, as fastncm takes it."""
        changes = {"friction.mu": self.mu, **changes}
        if self.scene != SMALL:
            return fastncm.load_scene(self.scene).replace(changes)
        small = {
            "finger.length": 0.127,
            "finger.offset": 0.0635,
            "target.semi_axes": [0.04953, 0.033655],
            "path.start": math.radians(84.0),
            "path.stop": math.radians(102.0),
        }
        return fastncm.load_scene("rubber-ellipse").replace(small | changes)

    def reference(self) -> pd.DataFrame:
        """Positions (m or rad) and forces that the answers are compared with; without forces for
        this scene and friction, the positions alone."""
        unknown = {"force_x_N": np.nan, "force_y_N": np.nan}
        if self.scene == RUBBER:
            return pd.DataFrame({"position": np.radians(DEGREES), **unknown})
        if self.scene == SMALL:
            rows = pd.read_csv(DATA / "fem_ellipse.csv").query("material == 'Hencky'")
            return rows.assign(position=np.radians(rows["phi_deg"])).reset_index(drop=True)
        rows = pd.read_csv(DATA / "fem_snapfit.csv").query("jaw == 'rigid'")
        rows = rows[(rows["scene"] == self.scene) & (rows["position_m"] < 0.0775)]
        rows = rows.assign(position=rows["position_m"])
        known = rows[rows["mu"] == self.mu]
        if len(known) == 0:
            known = rows[rows["mu"] == 0.0].assign(**unknown)
        return known.reset_index(drop=True)

    def paths(self) -> Iterator[tuple[Model, Increments]]:
        """Models whose positions, one after another, are those of the reference."""
        at = self.reference()["position"].to_numpy()
        if self.scene in (SMALL, RUBBER):
            yield rubber(self.beam(), self.fineness, np.degrees(at), MATERIAL), IN_DEGREES
            return
        start = CIRCLE_FROM if self.scene == "snapfit-circle" else CORNER_FROM
        passed = (at < PASSED) & (self.scene == "snapfit-corner")
        yield snapfit(self.beam(), self.fineness, [start, *at[~passed]]), IN_MM
        if passed.any():
            beyond = [DOWN_FROM, *at[passed]]
            yield snapfit(self.beam(), self.fineness, beyond, LIFT), IN_MM


def all_cases() -> list[Case]:
    """Every scene, mesh and friction."""
    return [
        Case(scene, mesh, mu)
        for scene, meshes in MESHES.items()
        for mesh in meshes
        for mu in FRICTION[scene]
    ]


def other_penalties() -> list[Case]:
    """The case whose sensitivity to the penalty is looked at: a quarter, as it is, four times."""
    return [Case("snapfit-circle", "coarse", 0.4, penalty) for penalty in (0.25, 1.0, 4.0)]
