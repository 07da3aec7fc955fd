"""Random scenes far beyond use, each reproducible by its kind and index.

`jaw_block` draws scenes of fingers with a jaw, `side_block` those whose own side touches: as
columns of dotted names, as `fastncm.solve_cases` takes them. A block of scenes is drawn from
``(SEED, kind, block)``, so that scene number i needs nothing but the i // BLOCK-th block.
"""

import numpy as np

SEED = 5
BLOCK = 1000

Columns = dict[str, np.ndarray]

JAW_KINDS = (
    "circle-straight",
    "circle-convex",
    "circle-concave",
    "corner-straight",
    "corner-convex",
    "corner-concave",
)
JAW_ORDERS = (2, 3, 4, 6, 8, 12, 20, 32, "auto", "auto", "auto", "auto")


def base_scene(kind: str) -> str:
    """The shipped scene that the columns of a kind change."""
    if kind in SIDE_KINDS:
        return "rubber-ellipse"
    return "snapfit-circle" if kind.startswith("circle-") else "snapfit-corner"


def one(kind: str, index: int) -> dict[str, object]:
    """The changes of scene `index` of a kind, as `Scene.replace` takes them."""
    case = index % BLOCK
    if kind in JAW_KINDS:
        return row(jaw_block(kind, index // BLOCK), case)
    for rows, columns in parts(side_block(kind, index // BLOCK)):
        if case in rows:
            return row(columns, int(np.searchsorted(rows, case)))
    raise IndexError(index)


def first(columns: Columns, count: int) -> Columns:
    """The first cases of a table."""
    return {name: column[:count] for name, column in columns.items()}


def row(columns: Columns, case: int) -> dict[str, object]:
    """One case of a table, in plain Python types."""
    values = {name: column[case] for name, column in columns.items()}
    return {
        name: tuple(value.tolist()) if isinstance(value, np.ndarray)
        else value.item() if isinstance(value, np.generic) else value
        for name, value in values.items()
    }  # fmt: skip


def jaw_block(kind: str, block: int) -> Columns:
    """Columns of BLOCK scenes of one of JAW_KINDS."""
    return drawn_jaws(kind, block)[0]


def drawn_jaws(kind: str, block: int) -> tuple[Columns, Columns]:
    """`jaw_block`, and what else is known of each scene: `depth` of the target at the path's end
    and its `gap` at the beginning (finger lengths), the distance of the first touch `from_corner`
    (edge lengths), and the friction coefficient `of_locking`, in units of what locks a rigid jaw.
    """
    rng = np.random.default_rng([SEED, JAW_KINDS.index(kind), block])
    draw = _Draw(rng, BLOCK)
    length = draw.log(1e-6, 1e3)
    target, shape = kind.split("-")
    columns = _finger(draw, length)
    lead, chord = draw.uniform(np.radians(2.0), np.radians(88.0)), draw.log(0.01, 1.0)
    a = np.column_stack([1.0 + draw.share(0.3) * draw.uniform(-0.2, 0.2), draw.log(1e-3, 1.0)])
    b = a + chord[:, None] * np.column_stack([np.cos(lead), -np.sin(lead)])
    half = np.zeros(BLOCK)
    if shape != "straight":
        bow = 1.0 + draw.log(1e-6, 1e3)  # radius over that of the half circle
        half = np.arcsin(1.0 / bow)
        columns["jaw.radius"] = 0.5 * chord * bow * length * (1.0 + 4e-16)
    columns["jaw.shape"] = np.full(BLOCK, "segment" if shape == "straight" else "arc", dtype=object)
    if shape != "straight":
        columns["jaw.convex"] = np.full(BLOCK, shape == "convex", dtype=object)
        half = half if shape == "convex" else -half
    # the return face lies behind the jaw
    low = np.maximum(np.minimum(0.3, 0.5 * (np.pi - lead)), half - lead + 0.05)
    high = np.pi - 0.02 - lead + np.minimum(half, 0.0)
    low, high = np.minimum(low, 0.5 * high), np.minimum(high, 2.8)
    upright = draw.share(0.5) & (low < 0.5 * np.pi) & (0.5 * np.pi < high)
    back = np.where(upright, 0.5 * np.pi, low + draw.uniform(0.0, 1.0) * (high - low))
    # where the jaw is touched: a point of its edge, often one of its corners
    place = draw.uniform(0.0, 1.0)
    at_corner = draw.share(0.15)
    near = np.round(place) + draw.sign() * draw.log(1e-14, 1e-2)
    place = np.where(at_corner, near, place)
    point, normal = jaw_point(a, b, half, place)
    radius = draw.log(1e-3, 1e2) if target == "circle" else np.zeros(BLOCK)
    y = point[:, 1] + radius * normal[:, 1]
    reach = point[:, 0] + radius * normal[:, 0]
    y = y + draw.share(0.02) * (10.0 + 2.0 * radius)  # out of reach
    depth = np.where(draw.share(0.5), draw.log(1e-9, 1.5), draw.uniform(0.0, 1.5 * chord + 0.1))
    stop = reach - depth
    start = np.where(draw.share(0.8), np.nan, reach + draw.log(1e-6, 1e6))
    columns |= {
        "jaw.a": a * length[:, None],
        "jaw.b": b * length[:, None],
        "jaw.return_angle": back,
        "path.y": y * length,
        "path.stop": stop * length,
        "path.start": _blank(start * length, "touch"),
        "path.steps": np.where(draw.share(0.5), 2, 12),
        "friction.mu": _friction(draw, lead),
        "solver.order": draw.choice(JAW_ORDERS),
        "solver.rtol": np.where(draw.share(0.5), 1e-6, 1e-9),
    }
    if target == "circle":
        columns["target.radius"] = radius * length
    else:
        size = np.where(draw.share(0.7), np.nan, draw.log(1e-3, 1.0))
        columns["target.length"] = _blank(size * length, "endless")
    drawn = {
        "depth": depth,
        "gap": np.where(np.isnan(start), 0.0, start - reach),
        "from_corner": np.minimum(np.abs(place), np.abs(1.0 - place)),
        "of_locking": columns["friction.mu"] * np.tan(lead),
    }
    return columns, drawn


def jaw_point(
    a: np.ndarray, b: np.ndarray, half: np.ndarray, place: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) of the edge from `a` to `b` (n, 2) and the outward normals there.

    half: (n,) half the arc's angle, negative where concave, 0: straight; place: (n,) from 0 at a to
    1 at b.
    """
    chord = b - a
    size = np.hypot(chord[:, 0], chord[:, 1])
    left = np.column_stack([-chord[:, 1], chord[:, 0]]) / size[:, None]
    curved = half != 0.0
    safe = np.where(curved, half, 1.0)
    turn = half * (1.0 - 2.0 * place)
    normal = np.column_stack(
        [
            np.cos(turn) * left[:, 0] - np.sin(turn) * left[:, 1],
            np.sin(turn) * left[:, 0] + np.cos(turn) * left[:, 1],
        ]
    )
    rho = 0.5 * size / np.sin(safe)
    centre = 0.5 * (a + b) - (rho * np.cos(safe))[:, None] * left
    straight = a + place[:, None] * chord
    return np.where(curved[:, None], centre + rho[:, None] * normal, straight), normal


SIDE_KINDS = ("ellipse", "circle", "polygon", "half-plane")
SIDE_INTERVALS = (4, 7, 16, 16, 45, 45, 90, 90, 180, 360)
_POLYGONS = (3, 4, 6, 24)
"""Corners of the regular polygons, which are stretched."""


def side_block(kind: str, block: int) -> Columns:
    """Columns of BLOCK scenes of one of SIDE_KINDS, changes of the shipped rubber-ellipse.

    In the base's frame the undeformed finger lies along x; a target at its right side comes from
    below, one at its left side from above.
    """
    return drawn_sides(kind, block)[0]


def drawn_sides(kind: str, block: int) -> tuple[Columns, Columns]:
    """`side_block`, and of each scene the `depth` of the target at the path's end, its `gap` at the
    beginning, both in finger lengths or half radians, how far along the finger it touches first,
    `place` (finger lengths), and the angle of the `base` at the end (rad)."""
    rng = np.random.default_rng([SEED, 100 + SIDE_KINDS.index(kind), block])
    draw = _Draw(rng, BLOCK)
    length = draw.log(1e-6, 1e3)
    columns = _finger(draw, length)
    left = draw.share(0.3)
    up = np.where(left, -1.0, 1.0)  # the way of the target into the finger
    base = draw.uniform(np.radians(20.0), np.radians(160.0))
    offset = np.where(draw.share(0.5), 0.0, draw.uniform(0.0, 0.5))
    axis = draw.share(0.1)
    place = np.where(draw.share(0.1), draw.uniform(0.98, 1.02), draw.uniform(0.02, 1.0))
    ends = columns["finger.thickness"] / length[:, None]
    half = 0.5 * (ends[:, 0] + (ends[:, 1] - ends[:, 0]) * np.minimum(place, 1.0))
    touch = np.column_stack([offset + place, np.where(axis, 0.0, -up * half)])
    size = np.column_stack([draw.log(1e-2, 10.0), draw.log(1e-2, 10.0)])
    tilt = np.where(draw.share(0.5), 0.0, draw.uniform(-1.5, 1.5))
    columns["target.shape"] = np.full(BLOCK, kind, dtype=object)
    # from the contact to the target's reference point, in the base's frame
    seen = tilt - base
    if kind == "circle":
        size[:, 1] = size[:, 0]
        columns["target.radius"] = size[:, 0] * length
    elif kind == "ellipse":
        columns["target.semi_axes"] = size * length[:, None]
        columns["target.tilt"] = tilt
    elif kind == "half-plane":
        # the plane rises towards the tip, from below the clamp
        flank = np.where(axis, 0.0, 0.5 * (ends[:, 0] - ends[:, 1]))
        lean = np.arctan(np.maximum(flank, 0.0)) + draw.log(1e-6, 1.0)
        columns["target.tilt"] = up * lean + base + np.where(left, np.pi, 0.0)
        touch = np.column_stack([offset + 1.0, np.where(axis, 0.0, -0.5 * up * ends[:, 1])])
    if kind == "polygon":
        corners = rng.choice(_POLYGONS, BLOCK)
        shapes = [_regular(count, one) for count, one in zip(corners.tolist(), size, strict=True)]
        turned = [_turn(shape, -angle) for shape, angle in zip(shapes, base, strict=True)]
        foremost = np.array(
            [shape[np.argmax(way * shape[:, 1])] for shape, way in zip(turned, up, strict=True)]
        )
        columns["target.vertices"] = np.empty(BLOCK, dtype=object)
        columns["target.vertices"][:] = [
            tuple(map(tuple, (shape * one).tolist()))
            for shape, one in zip(shapes, length, strict=True)
        ]
    elif kind == "half-plane":
        foremost = np.zeros((BLOCK, 2))
    else:
        seen = np.where(kind == "circle", 0.0, seen)
        direction = np.column_stack([up * np.sin(seen), up * np.cos(seen)])  # in the ellipse's axes
        support = size**2 * direction
        support /= np.sqrt((size**2 * direction**2).sum(axis=1))[:, None]
        cos, sin = np.cos(seen), np.sin(seen)
        foremost = np.column_stack(
            [cos * support[:, 0] - sin * support[:, 1], sin * support[:, 0] + cos * support[:, 1]]
        )
    at = touch - foremost
    cos, sin = np.cos(base), np.sin(base)
    x, y = cos * at[:, 0] - sin * at[:, 1], sin * at[:, 0] + cos * at[:, 1]
    turns = draw.share(0.3)
    depth = np.where(draw.share(0.5), draw.log(1e-6, 0.7), draw.uniform(0.0, 0.7))
    if kind == "half-plane":
        depth *= np.minimum(1.0, np.tan(lean) - flank)
    clear = np.where(draw.share(0.8), draw.log(1e-6, 1e-1), draw.log(0.1, 1e3))
    clear = np.where(turns, np.minimum(clear, 0.5), clear)
    speed = np.where(draw.share(0.5), 0.0, draw.uniform(-0.2, 0.2))
    angles = np.column_stack([base + up * clear, base - up * 2.0 * depth])
    ways = np.column_stack([x + up * clear, x - up * depth]) * length[:, None]
    start, stop = np.where(turns[:, None], angles, ways).T
    columns |= {
        "path.kind": np.where(turns, "rotation", "translation").astype(object),
        "path.y": y * length,
        "path.start": start,
        "path.stop": stop,
        "path.steps": np.where(draw.share(0.5), 2, 12),
        "finger.offset": offset * length,
        "finger.side": np.where(left, "left", "right").astype(object),
        "model.surface": np.where(axis, "axis", "side").astype(object),
        "model.section": np.where(draw.share(0.15), "psi+gamma", "psi").astype(object),
        "solver.intervals": draw.choice(SIDE_INTERVALS),
        "solver.contact": draw.choice(("closest",) * 8 + ("points-on-finger", "points-on-target")),
        "friction.mu": np.where(draw.share(0.5), 0.0, draw.log(1e-2, 1.0)),
    }
    many = draw.share(0.005)
    columns["solver.intervals"][many] = 2000
    columns["solver.intervals"][many & draw.share(0.2)] = 10_000
    columns["path.angle"] = _blank(np.where(turns, np.nan, base), "")
    columns["path.x"] = _blank(np.where(turns, x - speed * (base - 0.5 * np.pi), np.nan), "")
    columns["path.x"][turns] = (columns["path.x"][turns] * length[turns]).astype(object)
    columns["path.speed_ratio"] = _blank(np.where(turns, speed * length, np.nan), "")
    return columns, {
        "depth": depth,
        "gap": clear,
        "place": place,
        "base": np.where(turns, stop, base),
    }


def parts(columns: Columns) -> list[tuple[np.ndarray, Columns]]:
    """The cases (indices) of a block that turn and those that do not, with the columns that each
    has."""
    turns = columns["path.kind"] == "rotation"
    found = []
    for chosen, foreign in ((turns, ("path.angle",)), (~turns, ("path.x", "path.speed_ratio"))):
        rows = np.flatnonzero(chosen)
        part = {name: column[rows] for name, column in columns.items() if name not in foreign}
        found.append((rows, part))
    return found


def _regular(corners: int, size: np.ndarray) -> np.ndarray:
    """Corners of a stretched regular polygon, anticlockwise."""
    angle = 2.0 * np.pi * (np.arange(corners) + 0.3) / corners
    return size * np.column_stack([np.cos(angle), np.sin(angle)])


def _turn(points: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return points @ np.array([[cos, sin], [-sin, cos]])


def _finger(draw: "_Draw", length: np.ndarray) -> Columns:
    """Columns of the finger and the model, which both kinds of contact share."""
    clamp = length * draw.log(1e-5, 0.5)
    taper = np.where(draw.share(0.4), 1.0, np.where(draw.share(0.8), draw.log(1e-3, 1.0), 0.0))
    taper = np.where(taper == 0.0, draw.log(1.0, 1e3), taper)
    # at most half as thick as long at either end
    clamp = np.minimum(clamp, 0.5 * length / taper)
    return {
        "finger.length": length,
        "finger.thickness": np.column_stack([clamp, clamp * taper]),
        "finger.width": length * draw.log(1e-4, 1.0),
        "finger.young": draw.log(1e-3, 1e15),
        "finger.poisson": draw.uniform(-0.9, 0.49),
        "model.shear": draw.share(0.5).astype(object),
    }


def _friction(draw: "_Draw", lead: np.ndarray) -> np.ndarray:
    """None for half of the scenes; else anything, or close to what locks a jaw of the lead angle
    (n,)."""
    close = draw.uniform(0.8, 1.0) / np.tan(lead)
    some = np.where(draw.share(0.5), draw.log(1e-3, 10.0), close)
    return np.where(draw.share(0.5), 0.0, some)


def _blank(values: np.ndarray, word: str) -> np.ndarray:
    """A column of numbers in which `word` stands for NaN."""
    column = values.astype(object)
    column[np.isnan(values)] = word
    return column


class _Draw:
    """Draws of `count` values each."""

    def __init__(self, rng: np.random.Generator, count: int) -> None:
        self.rng, self.count = rng, count

    def uniform(self, low: float, high: float) -> np.ndarray:
        return self.rng.uniform(low, high, self.count)

    def log(self, low: float, high: float) -> np.ndarray:
        return np.exp(self.rng.uniform(np.log(low), np.log(high), self.count))

    def share(self, part: float) -> np.ndarray:
        return self.rng.uniform(size=self.count) < part

    def sign(self) -> np.ndarray:
        return np.where(self.share(0.5), 1.0, -1.0)

    def choice(self, values: tuple[object, ...]) -> np.ndarray:
        column = np.empty(self.count, dtype=object)
        column[:] = [values[k] for k in self.rng.integers(len(values), size=self.count)]
        return column
