"""The description of a scene: frozen, in SI units and radians, validated when it is made by
`Scene.replace`, `Scene.from_dict` or `load_scene`."""

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, NamedTuple, Self

from fastncm.errors import SceneError
from fastncm.scene.names import STORED, belongs, unit_of
from fastncm.scene.point_lists import Points
from fastncm.scene.refusal import refusal, unknown
from fastncm.scene.resolve import first_case, resolve

Point = tuple[float, float]


@dataclass(frozen=True)
class Finger:
    """A straight beam of rectangular section, clamped.

    With a jaw it lies along x, clamped at the origin. In direct contact it lies along the base's
    direction, clamped at `offset` from the pivot, which is the origin.
    """

    length: float  # m
    width: float  # m, out of the plane
    young: float  # Pa
    thickness: float | tuple[float, float] | None = None  # m; a pair is (clamp, tip), linear
    profile: Points | None = None  # m, in its place: (s, w) from the clamp to the tip
    poisson: float = 0.35
    shear_modulus: float | None = None  # Pa; None: young / (2 (1 + poisson))
    side: str = "right"  # that touches in direct contact, seen from clamp to tip; or "left"
    offset: float = 0.0  # m, from the pivot to the clamp along the base, in direct contact

    @property
    def shear_correction(self) -> float:
        """κ of a rectangular section (Lan & Lee 2008, eq. 20)."""
        return (5 + 5 * self.poisson) / (6 + 5 * self.poisson)

    @property
    def stations(self) -> Points:
        """Thickness as (s, w) in m from the clamp to the tip, linear in between."""
        if self.profile is not None:
            return self.profile
        if self.thickness is None:
            raise SceneError("finger.thickness is missing", name="finger.thickness")
        pair = self.thickness
        clamp, tip = pair if isinstance(pair, tuple) else (pair, pair)
        return ((0.0, clamp), (self.length, tip))


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

    Circles and ellipses have their centre at the target's reference point. A block has its sharp
    corner there and takes up all above it and to the right, as far as its length: a vertical left
    face, a horizontal underside, and a vertical back where it is not endless. A polygon's corners
    are given from there. A half-plane's surface passes through it.
    """

    shape: str  # "circle" or "block"; direct contact: "circle", "ellipse", "polygon", "half-plane"
    radius: float | None = None  # m, of a circle
    semi_axes: Point | None = None  # m, of an ellipse: along x and y before it is tilted
    # rad, counter-clockwise: of an ellipse's first semi-axis against +x, and of a half-plane's
    # outward normal against +y
    tilt: float = 0.0
    vertices: Points | None = None  # m, of a convex polygon, counter-clockwise
    length: float | str = "endless"  # m, of a block's underside


@dataclass(frozen=True)
class Path:
    """The positions of the target, equally spaced from start to stop.

    In a translation the position is the x of the target's reference point. In a rotation it is the
    direction phi of the finger's base: the target's x is x + speed_ratio (phi - pi/2), Lan & Lee
    2008, eq. (18).
    """

    stop: float  # m or rad
    y: float  # m, of the target's reference point
    start: float | str = "touch"  # "touch": at first touch, coming from +x; in a rotation,
    # of the base as it turns towards the finger's side that touches
    steps: int = 60  # number of positions, both ends included
    kind: str = "translation"  # or "rotation", in direct contact
    angle: float = 0.0  # rad, direction of the base in a translation
    x: float | None = None  # m, of the target's reference point at phi = pi/2
    speed_ratio: float = 0.0  # m/rad
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
    # what touches in direct contact: the "side", or the "axis", as if the finger had no thickness
    surface: str = "side"


@dataclass(frozen=True)
class Solver:
    """Discretisation and accuracy."""

    order: int | str = "auto"  # modes of the shape, with a jaw; "auto": as many as rtol asks for
    intervals: int = 90  # N, of the finger in direct contact
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
} | {"jaw.shape": "none"}
HEADINGS = ("name", "description", "assumed")  # of a scene, beside its sections


class Pose(NamedTuple):
    """Where target and base are at a position of the path."""

    target_x: float  # m, the target's reference point
    target_y: float  # m
    base_angle: float  # rad, the direction of the finger at its clamp


@dataclass(frozen=True)
class Scene:
    """A finger, its jaw, the target's way past them, and how to solve it.

    Without a jaw the finger is in direct contact: its own side touches.
    """

    name: str
    finger: Finger
    jaw: Jaw | None
    target: Target
    path: Path
    friction: Friction = field(default_factory=Friction)
    model: Model = field(default_factory=Model)
    solver: Solver = field(default_factory=Solver)
    description: str = ""  # one line
    assumed: str = ""  # what the scene's source does not say, to be told wherever it is shown

    @property
    def position_unit(self) -> str:
        """Of the path's positions: "m", or "rad" where the base turns."""
        return "rad" if self.path.kind == "rotation" else "m"

    def unit_of(self, name: str) -> str:
        """The SI unit of a dotted name in this scene; "1" where it has none."""
        return self.position_unit if name in ("path.start", "path.stop") else unit_of(name)

    def pose(self, position: float) -> Pose:
        """Where target and base are at a position of the path (m or rad)."""
        path = self.path
        if path.kind == "rotation" and path.x is not None:
            x = path.x + path.speed_ratio * (position - math.pi / 2)  # Lan & Lee 2008, eq. (18)
            return Pose(x, path.y, position)
        return Pose(position, path.y, path.angle)

    def flat(self) -> dict[str, object]:
        """The scene's values by dotted name, without None and what its shapes do not use."""
        values: dict[str, object] = {}
        for name in STORED:
            section, attribute = name.split(".")
            values[name] = getattr(getattr(self, section), attribute, None)
        values["jaw.shape"] = self.jaw.shape if self.jaw else "none"
        return {
            name: value
            for name, value in values.items()
            if value is not None and belongs(STORED[name], values)
        }

    def replace(self, changes: Mapping[str, object]) -> Self:
        """A new, validated scene with the values of some dotted names changed."""
        return self._of(self.headings(), DEFAULTS | self.flat(), changes)

    def headings(self) -> dict[str, str]:
        """What is said about the scene: its name, a description, what is assumed."""
        return {key: getattr(self, key) for key in HEADINGS}

    def to_dict(self) -> dict[str, object]:
        """Nested plain values, as in a TOML file; `from_dict` turns them back."""
        sections: dict[str, dict[str, object]] = {}
        for name, value in self.flat().items():
            section, attribute = name.split(".")
            sections.setdefault(section, {})[attribute] = _plain(value)
        return {**self.headings(), **sections}

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
        headings = {key: _heading(tables, key) for key in HEADINGS}
        if not headings["name"]:
            raise SceneError("name is missing: a scene needs one", name="name")
        if tables.get("jaw") and "jaw.shape" not in changes:
            raise SceneError("jaw.shape is missing: shape of the jaw", name="jaw")
        return cls._of(headings, DEFAULTS, changes)

    @classmethod
    def _of(
        cls,
        headings: Mapping[str, str],
        base: Mapping[str, object],
        changes: Mapping[str, object],
    ) -> Self:
        group = resolve(base, {key: [value] for key, value in changes.items()})[0]
        return cls.from_flat(headings, first_case(group))

    @classmethod
    def from_flat(cls, headings: Mapping[str, str], values: Mapping[str, object]) -> Self:
        """The scene of values by dotted name, which `resolve` has validated."""
        tables: dict[str, dict[str, Any]] = {section: {} for section in SECTIONS}
        for dotted, value in values.items():
            section, attribute = dotted.split(".")
            tables[section][attribute] = value
        kinds: dict[str, Any] = dict(SECTIONS)
        if tables["jaw"]["shape"] == "none":
            kinds["jaw"] = lambda shape: None
        parts: dict[str, Any] = {key: kind(**tables[key]) for key, kind in kinds.items()}
        return cls(**(parts | dict(headings)))


def _plain(value: object) -> object:
    """Tuples as lists, as a TOML file has them."""
    return [_plain(entry) for entry in value] if isinstance(value, tuple) else value


def _heading(tables: Mapping[str, object], key: str) -> str:
    text = tables.get(key, "")
    if not isinstance(text, str):
        raise refusal(key, text, "a string")
    return text
