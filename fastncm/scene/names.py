"""Every dotted name of a scene, with its meaning, unit and what it may be.

Two sorts: a `Quantity` differs from case to case and becomes float64 arrays over the cases; an
`Option` decides which problem is solved, so cases are grouped by their options.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from fastncm.scene.kinds import FINITE, NOT_NEGATIVE, POSITIVE, Interval, Real, Switch, Whole, Word
from fastncm.scene.point_lists import Polygon, Profile
from fastncm.scene.refusal import unknown

NO_BLANK = object()  # marks a quantity that must be a number in every case


@dataclass(frozen=True)
class Quantity:
    """A number, or a pair of numbers, of each case."""

    name: str
    meaning: str
    unit: str
    keys: tuple[str, ...]  # one array over the cases for each key
    allowed: Interval = FINITE
    scalar: bool = True  # whether one number will do; a pair of keys then holds it twice
    blank: object = NO_BLANK  # what may stand in place of a number; NaN in the arrays
    owner: tuple[str, ...] | None = None  # (option, word, ...): only with one of these words
    instead: str | None = None  # an option that may be given in its place


@dataclass(frozen=True)
class Option:
    """A choice that decides which problem is solved."""

    name: str
    meaning: str
    kind: Word | Switch | Whole | Real | Profile | Polygon
    owner: tuple[str, ...] | None = None
    unit: str = "1"
    limited: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # word -> its owner
    optional: bool = False  # may be left out without a default


JAW = ("jaw.shape", "segment", "arc")
DIRECT = ("jaw.shape", "none")  # contact on the finger's own side
ARC = ("jaw.shape", "arc")
TRANSLATION = ("path.kind", "translation")
ROTATION = ("path.kind", "rotation")
CIRCLE = ("target.shape", "circle")
BLOCK = ("target.shape", "block")
ACUTE = Interval(-math.pi / 2, math.pi / 2, open_low=True, open_high=True)

# What a scene stores.
QUANTITIES = (
    Quantity("finger.length", "length of the axis", "m", ("length",), POSITIVE),
    Quantity(
        "finger.thickness",
        "thickness, a number or [clamp, tip]",
        "m",
        ("thickness_clamp", "thickness_tip"),
        POSITIVE,
        instead="finger.profile",
    ),
    Quantity(
        "finger.offset",
        "distance from the pivot (the origin) to the clamp, along the base",
        "m",
        ("offset",),
        owner=DIRECT,
    ),
    Quantity("finger.width", "width out of the plane", "m", ("width",), POSITIVE),
    Quantity("finger.young", "Young's modulus", "Pa", ("young",), POSITIVE),
    Quantity(
        "finger.poisson",
        "Poisson's ratio",
        "1",
        ("poisson",),
        Interval(-1.0, 0.5, open_low=True, open_high=True),
    ),
    Quantity(
        "finger.shear_modulus",
        "shear modulus; left out: young / (2 (1 + poisson))",
        "Pa",
        ("shear_modulus",),
        POSITIVE,
        blank=None,
    ),
    Quantity(
        "jaw.a", "first end of the jaw, undeformed", "m", ("a_x", "a_y"), scalar=False, owner=JAW
    ),
    Quantity(
        "jaw.b", "second end of the jaw, undeformed", "m", ("b_x", "b_y"), scalar=False, owner=JAW
    ),
    Quantity("jaw.radius", "radius of the arc", "m", ("jaw_radius",), POSITIVE, owner=ARC),
    Quantity(
        "jaw.return_angle",
        "of the return face, from a down to the finger, against its axis",
        "rad",
        ("return_angle",),
        Interval(0.0, math.pi, open_low=True, open_high=True),
        owner=JAW,
    ),
    Quantity("target.radius", "radius", "m", ("target_radius",), POSITIVE, owner=CIRCLE),
    Quantity(
        "target.semi_axes",
        "semi-axes [a, b]",
        "m",
        ("semi_x", "semi_y"),
        POSITIVE,
        scalar=False,
        owner=("target.shape", "ellipse"),
    ),
    Quantity(
        "target.tilt",
        "angle by which the target is turned",
        "rad",
        ("tilt",),
        owner=("target.shape", "ellipse", "half-plane"),
    ),
    Quantity(
        "target.length",
        "of the block's underside, or 'endless'",
        "m",
        ("target_length",),
        POSITIVE,
        blank="endless",
        owner=BLOCK,
    ),
    Quantity("path.start", "first position, or 'touch'", "m", ("start",), blank="touch"),
    Quantity("path.stop", "last position", "m", ("stop",)),
    Quantity("path.y", "height of the target's reference point", "m", ("y",)),
    Quantity("path.angle", "direction of the base", "rad", ("path_angle",), owner=TRANSLATION),
    Quantity("path.x", "x of the target at a base of 90 degrees", "m", ("path_x",), owner=ROTATION),
    Quantity(
        "path.speed_ratio",
        "motion of the target per angle of the base",
        "m/rad",
        ("speed_ratio",),
        owner=ROTATION,
    ),
    Quantity("friction.mu", "coefficient of Coulomb friction", "1", ("mu",), NOT_NEGATIVE),
)

# What a scene does not store: these move jaw.a and jaw.b.
MOVES = (
    Quantity("jaw.height", "a_y - b_y; moves a", "m", ("height",), owner=JAW),
    Quantity("jaw.length", "b_x - a_x; moves b", "m", ("span",), POSITIVE, owner=JAW),
    Quantity("jaw.lead_angle", "atan2(height, length)", "rad", ("lead_angle",), ACUTE, owner=JAW),
)

OPTIONS = (
    Option("jaw.shape", "shape of the jaw", Word(("none", "segment", "arc"))),
    Option("jaw.convex", "the arc bulges towards the target", Switch(), owner=ARC),
    Option("finger.side", "side that touches", Word(("right", "left")), owner=DIRECT),
    Option(
        "finger.profile",
        "thickness over s, [[s, w], ...] from 0 to finger.length",
        Profile(),
        owner=DIRECT,
        unit="m",
        optional=True,
    ),
    Option(
        "target.shape",
        "shape of the target",
        Word(("circle", "block", "ellipse", "polygon", "half-plane")),
        limited={"block": JAW, "ellipse": DIRECT, "polygon": DIRECT, "half-plane": DIRECT},
    ),
    Option(
        "target.vertices",
        "corners of a convex polygon, [[x, y], ...] from the reference point",
        Polygon(),
        owner=("target.shape", "polygon"),
        unit="m",
    ),
    Option("path.kind", "what moves", Word(("translation", "rotation")), owner=DIRECT),
    Option("path.steps", "number of positions", Whole(2)),
    Option("path.withdraw", "after stop the same way back to start", Switch()),
    Option(
        "friction.model",
        "how friction acts",
        Word(("equilibrium", "recovered")),
    ),
    Option("model.shear", "the finger shears", Switch()),
    Option("model.section", "what turns the section", Word(("psi", "psi+gamma"))),
    Option("model.surface", "what touches", Word(("side", "axis")), owner=DIRECT),
    Option("solver.order", "modes of the shape", Whole(2, 32, ("auto",)), owner=JAW),
    Option("solver.intervals", "intervals of the finger (N)", Whole(4, 10_000), owner=DIRECT),
    Option(
        "solver.contact",
        "form of the contact",
        Word(("closest", "points-on-finger", "points-on-target")),
    ),
    Option("solver.points", "points of the point forms (M)", Whole(2)),
    Option("solver.hessian", "second derivatives", Word(("exact", "bfgs")), limited={"bfgs": JAW}),
    Option("solver.rtol", "relative error of the contact force", Real(Interval(1e-12, 1e-2))),
)

QUANTITY = {quantity.name: quantity for quantity in QUANTITIES + MOVES}
OPTION = {option.name: option for option in OPTIONS}
STORED = {item.name: item for item in QUANTITIES + OPTIONS}


def scene_names() -> tuple[str, ...]:
    """Every dotted name that `Scene.replace`, a sweep axis or `--set` may give."""
    return (*QUANTITY, *OPTION)


def check_name(name: str) -> None:
    """Refuse a name that is no dotted name of a scene, with the nearest right one."""
    if name not in QUANTITY and name not in OPTION:
        raise unknown(str(name), scene_names())


def foreign_to(item: Quantity | Option, values: Mapping[str, object]) -> tuple[str, ...] | None:
    """The condition (option, word, ...) that a scene of these options does not meet for the item;
    None where the item belongs to it. `values` are by dotted name."""
    return _unmet(item.owner, values)


def belongs(item: Quantity | Option, values: Mapping[str, object]) -> bool:
    """Whether a scene of these options has the item; `values` are by dotted name."""
    if isinstance(item, Quantity) and item.instead and values.get(item.instead) is not None:
        return False
    return foreign_to(item, values) is None


def _unmet(owner: tuple[str, ...] | None, values: Mapping[str, object]) -> tuple[str, ...] | None:
    """The first condition that is not met: the owner's own, or that of its option."""
    if owner is None:
        return None
    name, *words = owner
    return _unmet(OPTION[name].owner, values) or (None if values.get(name) in words else owner)


def unit_of(name: str) -> str:
    """The SI unit of a dotted name; "1" where it has none."""
    check_name(name)
    return QUANTITY[name].unit if name in QUANTITY else OPTION[name].unit
