"""Exact equilibria of many snap-fit fingers at once, by shooting from claimed ones.

Like `shooting`, which solves one scene from scratch, this integrates the equilibrium equation from
the tip to the clamp in the frame of the tip section, for a given normal force N and a given place q
on the jaw; the two unknowns are those for which the jaw's place meets the target. It starts from a
claimed answer and keeps its pair of touching features, so that what comes out is the equilibrium
next to it, and which of them touch is to be checked otherwise. It imports nothing of the package.

All arrays are over n scenes; lengths in units of the finger's length, forces in EI(0)/L^2.
"""

from dataclasses import dataclass

import numba
import numpy as np
from scipy.integrate import DOP853

Array = np.ndarray

LOCAL_ERROR = 1e-11
"""Of the embedded method of order 5 in one step; that of order 8, which goes on, is far below."""
COARSE_ERROR = 1e-8
"""With it the integration's own error shows, which falls at least in proportion."""
MOST_STEPS = 3000
DIFFERENCE = 1e-6
NEWTON_STEPS = 40
SAME_PLACE = 1e-9
"""Distance (finger lengths) up to which two claimed places are one."""

EDGE, CORNER_A, CORNER_B, RETURN = range(4)
"""What of the jaw touches: q is the place on the edge from 0 at a to 1 at b; the angle of the
normal at a corner; the distance from a down the return face."""
POINT, UNDERSIDE, FACE, BACK, FAR = range(5)
"""What of the target touches: the circle about its point (radius 0: the block's corner), a side, or
the block's far corner."""


@dataclass(frozen=True)
class Fingers:
    """n fingers with their jaws and targets.

    a, b: (n, 2) the jaw's ends from the tip; half: (n,) half the angle of its arc, negative where
    concave, 0: straight; back: (n,) the return face's angle; ratio: (n,) thickness of tip over
    clamp; shear: (n,) kappa G A L^2 / EI at the clamp, infinite: none; radius: (n,) of the circle,
    0: a block; length: (n,) of the block's underside; at: (n, 2) the target's point.
    """

    a: Array
    b: Array
    half: Array
    back: Array
    ratio: Array
    shear: Array
    radius: Array
    length: Array
    at: Array


@dataclass(frozen=True)
class Claim:
    """What a solver says: force: (n, 2) on the finger; contact: (n, 2) where; pose: (n, 3) of the
    tip; lean: (n,) friction over normal force, signed as `shear force along (-ny, nx)` of the jaw's
    outward normal."""

    force: Array
    contact: Array
    pose: Array


@dataclass(frozen=True)
class Truth:
    """normal: (n,) normal force; force, contact: (n, 2) and pose: (n, 3) of the exact equilibrium;
    rounding: (n,) what rounding, and what shooting left to do, may do to the normal force; found:
    (n,) bool, whether shooting closed."""

    normal: Array
    force: Array
    contact: Array
    pose: Array
    rounding: Array
    found: Array


def fingers(columns: dict[str, Array], rows: Array, position: Array) -> Fingers:
    """Cases `rows` (n,) of a table of dotted names, with their targets at `position` (n,) in m."""

    def pick(name: str) -> Array:
        return columns[name][rows]

    length, thickness, poisson = map(pick, ("finger.length", "finger.thickness", "finger.poisson"))
    kappa = (5.0 + 5.0 * poisson) / (6.0 + 5.0 * poisson)  # Lan & Lee 2008, eq. (20)
    shear = kappa / (2.0 + 2.0 * poisson) * 12.0 * (length / thickness[:, 0]) ** 2
    a, b = (pick(name) / length[:, None] - [1.0, 0.0] for name in ("jaw.a", "jaw.b"))
    half, zero = np.zeros(len(rows)), np.zeros(len(rows))
    if "jaw.radius" in columns:
        sine = np.minimum(np.hypot(*(b - a).T) / 2.0 / (pick("jaw.radius") / length), 1.0)
        half = np.arcsin(sine) * np.where(pick("jaw.convex").astype(bool), 1.0, -1.0)
    circle = "target.radius" in columns
    block = [0.0 if one == "endless" else one for one in ([] if circle else pick("target.length"))]
    return Fingers(
        a=a,
        b=b,
        half=half,
        back=pick("jaw.return_angle"),
        ratio=thickness[:, 1] / thickness[:, 0],
        shear=np.where(pick("model.shear").astype(bool), shear, np.inf),
        radius=pick("target.radius") / length if circle else zero,
        length=zero if circle else np.array(block, dtype=float) / length,
        at=np.column_stack([position, pick("path.y")]) / length[:, None],
    )


def force_unit(columns: dict[str, Array], rows: Array) -> Array:
    """EI(0)/L^2 (n,) in N."""
    clamp = columns["finger.thickness"][rows, 0]
    stiffness = columns["finger.young"][rows] * columns["finger.width"][rows] * clamp**3 / 12.0
    unit: Array = stiffness / columns["finger.length"][rows] ** 2
    return unit


def exact(fingers: Fingers, claim: Claim, mu: Array) -> Truth:
    """The equilibria next to the claimed ones, sliding with friction of 0 or +-mu (n,)."""
    jaw, target, q = features(fingers, claim)
    normal = turned(place_of(fingers, jaw, q)[1], claim.pose[:, 2])
    pressing = -np.einsum("ij,ij->i", claim.force, normal)
    along = normal[:, 0] * claim.force[:, 1] - normal[:, 1] * claim.force[:, 0]
    lean = np.sign(along) * mu
    unknowns = np.column_stack([pressing, q])
    scale = np.column_stack([np.abs(pressing), np.ones(len(q))])
    missed, pose = miss(fingers, jaw, target, lean, unknowns)
    large = 1.0 + fingers.radius + np.abs(fingers.at).max(axis=1)  # of what rounding is a share
    jacobian, damping = np.zeros((len(q), 2, 2)), np.ones(len(q))
    for _ in range(NEWTON_STEPS):
        for k in range(2):
            aside = unknowns.copy()
            aside[:, k] += DIFFERENCE * scale[:, k]
            jacobian[:, :, k] = (miss(fingers, jaw, target, lean, aside)[0] - missed) / DIFFERENCE
        size = np.abs(missed).max(axis=1)
        step = -np.einsum("nij,nj->ni", np.linalg.pinv(_finite(jacobian)), _finite(missed))
        trial = unknowns + damping[:, None] * np.clip(step, -0.5, 0.5) * scale
        new, new_pose = miss(fingers, jaw, target, lean, trial)
        better = np.abs(new).max(axis=1) < size
        unknowns[better], missed[better], pose[better] = (
            trial[better],
            new[better],
            new_pose[better],
        )
        damping = np.where(better, np.minimum(4.0 * damping, 1.0), 0.25 * damping)
        if not ((size > 1e-13 * large) & (damping > 1e-4)).any():
            break
    inverse = np.linalg.pinv(_finite(jacobian))
    rounding = np.abs(inverse[:, 0]).sum(axis=1) * 3e-14 * large
    coarse, _ = miss(fingers, jaw, target, lean, unknowns, COARSE_ERROR)
    shows = np.abs(np.einsum("nj,nj->n", inverse[:, 0], _finite(coarse - missed)))
    rounding += LOCAL_ERROR / COARSE_ERROR * shows
    left = np.abs(inverse[:, 0]) * np.abs(_finite(missed))  # to do; their signs are rounding's
    rounding += left.sum(axis=1)
    found = (np.abs(missed).max(axis=1) < 1e-11 * large) & (unknowns[:, 0] > 0.0)
    point, normal = (turned(one, pose[:, 2]) for one in place_of(fingers, jaw, unknowns[:, 1]))
    force = unknowns[:, :1] * (-normal + lean[:, None] * _left(normal))
    return Truth(unknowns[:, 0], force, pose[:, :2] + point, pose, rounding, found)


def features(f: Fingers, claim: Claim) -> tuple[Array, Array, Array]:
    """What of jaw and target touch by the claimed place of contact, and q."""
    count = len(f.ratio)
    place = turned(claim.contact - claim.pose[:, :2], -claim.pose[:, 2])
    to_a, to_b = place - f.a, place - f.b
    down = -np.column_stack([np.cos(f.back), np.sin(f.back)])
    below = np.einsum("ij,ij->i", to_a, down)
    aside = np.abs(down[:, 0] * to_a[:, 1] - down[:, 1] * to_a[:, 0])
    jaw = np.full(count, EDGE)
    q = _place_on_edge(f, place)
    at_a = np.hypot(*to_a.T) < SAME_PLACE
    at_b = np.hypot(*to_b.T) < SAME_PLACE
    block = f.radius == 0.0
    far = f.at + np.column_stack([f.length, np.zeros(count)])
    gap = claim.contact - f.at
    on_corner = np.hypot(*gap.T) < SAME_PLACE
    on_far = np.hypot(*(claim.contact - far).T) < SAME_PLACE
    face = (aside < SAME_PLACE) & (below > 0.0) & (~block | on_far)
    face &= np.abs(_edge_distance(f, place)) > SAME_PLACE
    jaw[at_a], jaw[at_b], jaw[face & ~at_a] = CORNER_A, CORNER_B, RETURN
    target = np.full(count, POINT)
    side = block & ~on_corner & (jaw != RETURN)
    target[side & (np.abs(gap[:, 1]) < SAME_PLACE)] = UNDERSIDE
    target[side & (np.abs(gap[:, 0]) < SAME_PLACE)] = FACE
    behind = (f.length > 0.0) & (np.abs(claim.contact[:, 0] - far[:, 0]) < SAME_PLACE)
    target[side & ~on_far & behind] = BACK
    target[block & on_far & (jaw == EDGE)] = FAR
    # a corner of the jaw on the block's own corner: the edge's end
    ends = block & on_corner & at_a | block & on_corner & at_b
    jaw[ends] = EDGE
    corner = (jaw == CORNER_A) | (jaw == CORNER_B)
    # the force points into the jaw: its direction without friction is the normal
    outward = np.where(
        block[:, None],
        np.select(
            [(target == UNDERSIDE)[:, None], (target == FACE)[:, None]],
            [[0.0, 1.0], [1.0, 0.0]],
            [-1.0, 0.0],
        ),
        f.at - claim.contact,
    )
    seen = turned(outward, -claim.pose[:, 2])
    q = np.where(corner, np.arctan2(seen[:, 1], seen[:, 0]), np.where(jaw == RETURN, below, q))
    return jaw, target, q


def _place_on_edge(f: Fingers, place: Array) -> Array:
    """From 0 at a to 1 at b."""
    chord = f.b - f.a
    size = np.hypot(*chord.T)
    straight = np.einsum("ij,ij->i", place - f.a, chord) / size**2
    centre, _ = _arc(f)
    left = _left(chord) / size[:, None]
    arm = (place - centre) * np.sign(f.half)[:, None]
    turn = np.arctan2(
        left[:, 0] * arm[:, 1] - left[:, 1] * arm[:, 0], np.einsum("ij,ij->i", left, arm)
    )
    safe = np.where(f.half == 0.0, 1.0, f.half)
    return np.where(f.half == 0.0, straight, 0.5 * (1.0 - turn / safe))


def _edge_distance(f: Fingers, place: Array) -> Array:
    """Distance of points in the tip's frame from the edge's line or circle."""
    chord = f.b - f.a
    left = _left(chord) / np.hypot(*chord.T)[:, None]
    centre, rho = _arc(f)
    straight = np.einsum("ij,ij->i", place - f.a, left)
    return np.where(f.half == 0.0, straight, np.hypot(*(place - centre).T) - np.abs(rho))


def _arc(f: Fingers) -> tuple[Array, Array]:
    """Centre (n, 2) and signed radius (n,) of the arcs."""
    chord = f.b - f.a
    size = np.hypot(*chord.T)
    left = _left(chord) / size[:, None]
    safe = np.where(f.half == 0.0, 1.0, f.half)
    rho = 0.5 * size / np.sin(safe)
    return 0.5 * (f.a + f.b) - (rho * np.cos(safe))[:, None] * left, rho


def place_of(f: Fingers, jaw: Array, q: Array) -> tuple[Array, Array]:
    """The jaw's places (n, 2) and outward normals there, in the tip's frame."""
    chord = f.b - f.a
    left = _left(chord) / np.hypot(*chord.T)[:, None]
    normal = turned(left, f.half * (1.0 - 2.0 * q))
    centre, rho = _arc(f)
    bent = centre + rho[:, None] * normal
    point = np.where((f.half == 0.0)[:, None], f.a + q[:, None] * chord, bent)
    down = -np.column_stack([np.cos(f.back), np.sin(f.back)])
    corner = np.column_stack([np.cos(q), np.sin(q)])
    for kind, where, direction in (
        (CORNER_A, f.a, corner),
        (CORNER_B, f.b, corner),
        (RETURN, f.a + q[:, None] * down, _left(-down)),
    ):
        chosen = (jaw == kind)[:, None]
        point, normal = np.where(chosen, where, point), np.where(chosen, direction, normal)
    return point, normal


def miss(
    f: Fingers,
    jaw: Array,
    target: Array,
    lean: Array,
    unknowns: Array,
    local: float = LOCAL_ERROR,
) -> tuple[Array, Array]:
    """By how much jaw and target miss each other (n, 2), and the tip's pose (n, 3)."""
    force, q = unknowns.T
    point, normal = place_of(f, jaw, q)
    push = force[:, None] * (-normal + lean[:, None] * _left(normal))
    clamp = _integrate(f, point, push, local)
    psi = -clamp[:, 2]
    pose = np.column_stack([-turned(clamp[:, :2], psi), psi])
    contact = pose[:, :2] + turned(point, psi)
    outward = turned(normal, psi)
    # the circle's centre, or the block's corner
    middle = contact + f.radius[:, None] * outward - f.at
    far = (jaw == RETURN) & (f.radius == 0.0) | (target == FAR)
    middle[:, 0] -= np.where(far, f.length, 0.0)
    missed = middle
    for kind, height, level in (
        (UNDERSIDE, middle[:, 1], outward[:, 0]),
        (FACE, middle[:, 0], outward[:, 1]),
        (BACK, middle[:, 0] - f.length, outward[:, 1]),
    ):
        missed = np.where((target == kind)[:, None], np.column_stack([height, level]), missed)
    return missed, pose


def _integrate(f: Fingers, arm: Array, force: Array, local: float) -> Array:
    """The clamp's x, y, psi (n, 3) seen from the tip section, where `force` (n, 2) acts at `arm`;
    NaN where that takes too many steps."""
    clamp = np.empty((len(f.ratio), 3))
    _integrate_all(
        f.ratio, f.shear, arm, force, DOP853.A, DOP853.B, DOP853.C, DOP853.E5, local, clamp
    )
    return clamp


@numba.njit(cache=True)
def _slope(z, x, y, psi, grows, pace, shear, arm, force):  # type: ignore[no-untyped-def]
    """Derivatives by z, which is evenly spaced in the logarithm of the thickness: where a finger is
    thin it bends most. du = pace w dz, w = ratio^z over the clamp's thickness."""
    w = np.exp(grows * z)
    moment = (arm[0] - x) * force[1] - (arm[1] - y) * force[0]
    theta = psi
    if shear < np.inf:
        for _ in range(4):
            along = force[0] * np.cos(theta) + force[1] * np.sin(theta)
            across = force[1] * np.cos(theta) - force[0] * np.sin(theta)
            stiffness = shear * w
            theta -= (theta - psi - across / stiffness) / (1.0 + along / stiffness)
    return pace * w * np.cos(theta), pace * w * np.sin(theta), pace * moment / w**2


@numba.njit(cache=True)
def _integrate_all(ratio, shear, arms, forces, a, b, c, e, local, out):  # type: ignore[no-untyped-def]
    """Dormand and Prince's method of order 8 with steps that its own error estimate chooses."""
    stages = len(b)
    k = np.zeros((stages + 1, 3))
    for i in range(len(ratio)):
        grows = np.log(ratio[i])
        pace = 1.0 if abs(grows) < 1e-12 else grows / np.expm1(grows)
        z, step = 1.0, -0.05
        state = np.zeros(3)
        steps = 0
        while z > 0.0 and steps < MOST_STEPS:
            steps += 1
            step = -min(-step, z)
            for s in range(stages + 1):
                at = state.copy()
                for j in range(s):
                    at += step * (a[s, j] if s < stages else b[j]) * k[j]
                where = z + step * (c[s] if s < stages else 1.0)
                k[s] = _slope(where, at[0], at[1], at[2], grows, pace, shear[i], arms[i], forces[i])
            new = state.copy()
            for j in range(stages):
                new += step * b[j] * k[j]
            error = 0.0
            for m in range(3):
                wrong = 0.0
                for j in range(stages + 1):
                    wrong += e[j] * k[j, m]
                error = max(error, abs(step * wrong) / (1.0 + abs(new[m])))
            if not error < np.inf:
                break
            if error <= local:
                z = 0.0 if -step >= z else z + step
                state = new
            step *= min(5.0, max(0.2, 0.9 * (local / max(error, 1e-300)) ** (1.0 / 6.0)))
        out[i] = state if z == 0.0 else np.full(3, np.nan)


def turned(vectors: Array, angle: Array) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = vectors.T
    return np.column_stack([cos * x - sin * y, sin * x + cos * y])


def _left(vectors: Array) -> Array:
    return np.column_stack([-vectors[:, 1], vectors[:, 0]])


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, 0.0)
