"""The description of a scene: frozen, in SI units and radians, validated when it is made by
`Scene.replace`, `Scene.from_dict` or `load_scene`."""

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, Self

from fastncm.errors import SceneError
from fastncm.scene.names import STORED, belongs
from fastncm.scene.refusal import refusal, unknown
from fastncm.scene.resolve import first_case, resolve

Point = tuple[float, float]


@dataclass(frozen=True)
class Finger:
    """A straight beam along x, clamped at the origin, of rectangular section."""

    length: float  # m
    thickness: float | tuple[float, float]  # m; a pair is (clamp, tip), linear in between
    width: float  # m, out of the plane
    young: float  # Pa
    poisson: float = 0.35
    shear_modulus: float | None = None  # Pa; None: young / (2 (1 + poisson))

    @property
    def shear_correction(self) -> float:
        """κ of a rectangular section (Lan & Lee 2008, eq. 20)."""
        return (5 + 5 * self.poisson) / (6 + 5 * self.poisson)


@dataclass(frozen=True)
class Jaw:
    """A rigid jaw on the finger's tip, from a to b; its outside is on the left from a to b."""

    shape: str  # "segment" or "arc"
    a: Point  # m, undeformed, in global coordinates
    b: Point  # m
    radius: float | None = None  # m, of an arc
    convex: bool = True  # an arc bulges towards the target
    return_angle: float = math.pi / 2  # rad, of the face from a down to the finger, which is behind

    @property
    def height(self) -> float:
        """a_y - b_y in m."""
        return self.a[1] - self.b[1]

    @property
    def length(self) -> float:
        """b_x - a_x in m."""
        return self.b[0] - self.a[0]

    @property
    def lead_angle(self) -> float:
        """Inclination of the chord in rad."""
        return math.atan2(self.height, self.length)


@dataclass(frozen=True)
class Target:
    """A rigid target, moved along the path.

    A circle has its centre at (position, path.y). A block has its sharp corner there and takes up
    all above it and to the right, as far as its length: a vertical left face, a horizontal
    underside, and a vertical back where it is not endless.
    """

    shape: str  # "circle" or "block"
    radius: float | None = None  # m, of a circle
    length: float | str = "endless"  # m, of a block's underside


@dataclass(frozen=True)
class Path:
    """The positions of the target, equally spaced from start to stop."""

    stop: float  # m
    y: float  # m
    start: float | str = "touch"  # m; "touch": at first touch, coming from +x
    steps: int = 60  # number of positions, both ends included
    withdraw: bool = False  # after stop the same way back to start


@dataclass(frozen=True)
class Friction:
    """Coulomb friction between jaw and target."""

    mu: float = 0.0
    model: str = "equilibrium"  # or "recovered", (14)-(17): the frictionless shape, force turned


@dataclass(frozen=True)
class Model:
    """Which terms of the beam are taken along."""

    shear: bool = False
    section: str = "psi"  # what turns a section: "psi", or "psi+gamma" as printed


@dataclass(frozen=True)
class Solver:
    """Discretisation and accuracy."""

    order: int | str = "auto"  # modes of the shape; "auto": as many as rtol asks for
    contact: str = "closest"  # or "points-on-finger" (10a), "points-on-target" (10b)
    points: int = 50  # M, of the point forms
    hessian: str = "exact"  # or "bfgs"
    rtol: float = 1e-6  # estimated relative error of the contact force


SECTIONS = {
    "finger": Finger,
    "jaw": Jaw,
    "target": Target,
    "path": Path,
    "friction": Friction,
    "model": Model,
    "solver": Solver,
}
DEFAULTS: dict[str, object] = {
    f"{section}.{item.name}": item.default
    for section, kind in SECTIONS.items()
    for item in fields(kind)
    if item.default is not MISSING
}
HEADINGS = ("name", "description")  # of a scene, beside its sections


@dataclass(frozen=True)
class Scene:
    """A finger, its jaw, the target's way past them, and how to solve it."""

    name: str
    finger: Finger
    jaw: Jaw
    target: Target
    path: Path
    friction: Friction = field(default_factory=Friction)
    model: Model = field(default_factory=Model)
    solver: Solver = field(default_factory=Solver)
    description: str = ""  # one line

    def flat(self) -> dict[str, object]:
        """The scene's values by dotted name, without None and what its shapes do not use."""
        values = {}
        for name in STORED:
            section, attribute = name.split(".")
            values[name] = getattr(getattr(self, section), attribute)
        return {
            name: value
            for name, value in values.items()
            if value is not None and belongs(STORED[name], values)
        }

    def replace(self, changes: Mapping[str, object]) -> Self:
        """A new, validated scene with the values of some dotted names changed."""
        return self._of(self.name, self.description, DEFAULTS | self.flat(), changes)

    def to_dict(self) -> dict[str, object]:
        """Nested plain values, as in a TOML file; `from_dict` turns them back."""
        headings = {key: getattr(self, key) for key in HEADINGS}
        sections: dict[str, dict[str, object]] = {}
        for name, value in self.flat().items():
            section, attribute = name.split(".")
            plain = list(value) if isinstance(value, tuple) else value
            sections.setdefault(section, {})[attribute] = plain
        return headings | sections

    @classmethod
    def from_dict(cls, tables: Mapping[str, object]) -> Self:
        """The scene of nested plain values, validated; what is left out takes its default."""
        changes: dict[str, object] = {}
        for key, table in tables.items():
            if key in HEADINGS:
                continue
            if key not in SECTIONS:
                raise unknown(key, (*HEADINGS, *SECTIONS))
            if not isinstance(table, Mapping):
                raise SceneError(f"{key} must be a table of values", name=key)
            changes |= {f"{key}.{attribute}": value for attribute, value in table.items()}
        name, description = (_heading(tables, key) for key in HEADINGS)
        if not name:
            raise SceneError("name is missing: a scene needs one", name="name")
        return cls._of(name, description, DEFAULTS, changes)

    @classmethod
    def _of(
        cls, name: str, description: str, base: Mapping[str, object], changes: Mapping[str, object]
    ) -> Self:
        group = resolve(base, {key: [value] for key, value in changes.items()})[0]
        return cls.from_flat(name, description, first_case(group))

    @classmethod
    def from_flat(cls, name: str, description: str, values: Mapping[str, object]) -> Self:
        """The scene of values by dotted name, which `resolve` has validated."""
        tables: dict[str, dict[str, Any]] = {section: {} for section in SECTIONS}
        for dotted, value in values.items():
            section, attribute = dotted.split(".")
            tables[section][attribute] = value
        parts: dict[str, Any] = {key: kind(**tables[key]) for key, kind in SECTIONS.items()}
        return cls(name=name, description=description, **parts)


def _heading(tables: Mapping[str, object], key: str) -> str:
    text = tables.get(key, "")
    if not isinstance(text, str):
        raise refusal(key, text, "a string")
    return text
