"""The problems of the study: scene, friction, positions, true forces, the model's own error."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from support import DATA, shooting, shooting_surface

import fastncm
from fastncm.scene import Scene

JAW_CASES = {"snapfit-circle": shooting.SNAPFIT_CIRCLE, "snapfit-corner": shooting.SNAPFIT_CORNER}
JAW_POSITIONS = 30
JAW_FIRST = 0.05
"""Of the path, behind the first touch, where the force and so its relative error are 0/0."""
SURFACE_POSITIONS = 25
START_INTERVALS = 360
"""Of the package's answer from which the exact one is sought in direct contact."""
COARSE_ERROR = 1e-11
"""Of an integration that shows the error of the finer one."""
SMALL_ELLIPSE = {
    "finger.length": 0.127,
    "finger.offset": 0.0635,
    "target.semi_axes": [0.04953, 0.033655],
    "path.start": np.radians(84.0),
    "path.stop": np.radians(102.0),
    "path.steps": 37,
    "solver.intervals": 720,
}
"""The scene of data/fem_ellipse.csv, on whose path the angles of that file lie."""
FORCES = ["force_x_N", "force_y_N"]


@dataclass(frozen=True)
class Problem:
    """A scene with friction. The truth is of shape (P, 2), in N, at the positions (P,)."""

    scene: Scene
    mu: float
    positions: np.ndarray
    truth: np.ndarray
    truth_error: float  # relative, estimated
    model_error: float  # against finite elements; NaN: none known
    case: shooting.ShootingCase | None = None  # of a jaw

    @property
    def name(self) -> str:
        """The scene's."""
        return self.scene.name


def jaw_truth(case: shooting.ShootingCase, positions: np.ndarray) -> np.ndarray:
    """Forces (P, 2) in N by shooting."""
    found = [shooting.solve(case, position) for position in positions]
    return np.array([[one.force_x, one.force_y] for one in found])


def jaw_problem(name: str, mu: float, count: int = JAW_POSITIONS) -> Problem:
    """A snap-fit, at `count` positions."""
    case = replace(JAW_CASES[name], mu=mu)
    scene = fastncm.load_scene(name)
    touch, stop = shooting.touch_position(case), scene.path.stop
    start = touch + JAW_FIRST * (stop - touch)
    scene = scene.replace({"friction.mu": mu, "path.start": start, "path.steps": count})
    positions = np.linspace(start, stop, count)
    truth = jaw_truth(case, positions)
    error = shooting.CLOSED
    return Problem(scene, mu, positions, truth, error, jaw_model_error(name, mu), case)


def jaw_model_error(name: str, mu: float) -> float:
    """The largest error of the converged beam's force against data/fem_snapfit.csv."""
    fem = pd.read_csv(DATA / "fem_snapfit.csv")
    fem = fem[(fem["scene"] == name) & (fem["jaw"] == "rigid") & (fem["mu"] == mu)]
    scene = fastncm.load_scene(name).replace({"friction.mu": mu, "solver.rtol": 1e-8})
    beam = fastncm.solve(scene, positions=fem["position_m"].to_numpy()).frame()
    return largest(beam[FORCES].to_numpy(), fem[FORCES].to_numpy())


def surface_problem(mu: float, count: int = SURFACE_POSITIONS) -> Problem:
    """rubber-ellipse at `count` angles."""
    scene = fastncm.load_scene("rubber-ellipse").replace({"friction.mu": mu, "path.steps": count})
    positions = np.linspace(scene.path.start, scene.path.stop, count)
    truth, coarse = (surface_truth(scene, mu, positions, local) for local in (None, COARSE_ERROR))
    model = ellipse_model_error() if mu == 0.0 else np.nan
    return Problem(scene, mu, positions, truth, largest(coarse, truth), model)


def surface_truth(
    scene: Scene, mu: float, positions: np.ndarray, local: float | None = None
) -> np.ndarray:
    """Forces (P, 2) in N on rubber-ellipse by shooting on the continuum."""
    found = []
    for position, start in zip(positions, surface_starts(scene), strict=True):
        pose = scene.pose(position)
        centre = np.array([pose.target_x, pose.target_y])
        options = {} if local is None else {"local": local}
        touch = shooting_surface.solve(continuum(mu), position, centre, start, **options)
        found.append(touch.force)
    return np.array(found)


def continuum(mu: float) -> shooting_surface.Finger:
    """rubber-ellipse with friction that drags the touching side towards the clamp."""
    return shooting_surface.Finger(mu=-mu)


def surface_starts(scene: Scene) -> np.ndarray:
    """The package's answers from which the exact ones are sought: (P, 5) unknowns."""
    curve = fastncm.solve(scene.replace({"solver.intervals": START_INTERVALS}))
    names = ["force_x_N", "force_y_N", "contact_from_m", "contact_to_m"]
    found = curve.frame()[names].to_numpy(dtype=float)
    moments = [curve.shape(i)["moment_Nm"].iloc[0] for i in range(len(found))]
    return np.insert(found, 2, moments, axis=1)


def ellipse_model_error() -> float:
    """The same against data/fem_ellipse.csv, a shorter finger on a smaller ellipse."""
    fem = pd.read_csv(DATA / "fem_ellipse.csv").query("material == 'Hencky'")
    scene = fastncm.load_scene("rubber-ellipse").replace(SMALL_ELLIPSE)
    beam = fastncm.solve(scene).frame()
    at = np.searchsorted(beam["position"], np.radians(fem["phi_deg"]) - 1e-9)
    return largest(beam[FORCES].to_numpy()[at], fem[FORCES].to_numpy())


def largest(forces: np.ndarray, truth: np.ndarray) -> float:
    """Largest relative difference of forces (P, 2)."""
    return float((np.hypot(*(forces - truth).T) / np.hypot(*truth.T)).max())
