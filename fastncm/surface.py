"""Fingers in direct contact: from scenes in SI units to dimensionless problems, and their solution.

Lengths are divided by the finger's length L, forces by ``E I / L^2`` of the clamp's section, as for
jaws (`fastncm.lowering`). The finger's base stands still in the compiled code: base and target move
relative to each other, and the relative motion is the target's (its placement).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fastncm.kernels import distance
from fastncm.kernels.nodal import AROUND, NodalProblem
from fastncm.lowering import Scale, unique_rows
from fastncm.path import surface_rows
from fastncm.path.surface_friction import turn_forces
from fastncm.path.surface_trace import SurfaceTrace, make_surface_trace, trace_surfaces
from fastncm.path.surface_way import make_walk
from fastncm.scene import CaseGroup, Scene
from fastncm.surface_touch import first_touches, rotation_touches

Array = np.ndarray

#: The KKT residual's part of `solver.rtol`, and its limits: below is rounding, above equilibrium of
#: each row would not hold to 1e-9.
_ALGEBRAIC_SHARE, _TIGHTEST, _LOOSEST = 1e-2, 1e-13, 1e-10
#: Corners of a polygon are contact points where an edge beside them is longer than this part of an
#: interval of the finger, or where the outline turns by this angle (rad) within an interval.
_EDGE, _TURN = 1.0, 0.2
#: No nodes touch up to this part of an interval (and less) beside a point of an ellipse; halvings
#: that find where that is.
_BESIDE, _HALVINGS = 0.6, 40
#: Fingers in one call of the compiled code.
_CHUNK = 512
#: Columns of the key of `lower_surface`.
_TILT, _Y, _PATH_X, _SPEED, _START, _STOP, _MU = 5, 7, 8, 9, 11, 12, 13
_SHAPES = {
    "ellipse": distance.ELLIPSE,
    "circle": distance.ELLIPSE,
    "polygon": distance.POLYGON,
    "half-plane": distance.HALF_PLANE,
}


@dataclass(frozen=True)
class LoweredSurface:
    """The different dimensionless problems of a group of cases, and how the cases use them.

    problem: of all D fingers. positions: (D, P), in finger lengths or rad; sense: (D,) +1 or -1, of
    the scene's own path; turned: (D,) friction by which the model "recovered" turns the forces;
    turn: the last position of the way in. problem_of: (C,) int64, which finger each case uses;
    scale: of the cases; mu: (C,).
    """

    scene: Scene
    problem: NodalProblem
    positions: Array
    sense: Array
    turned: Array
    turn: int
    problem_of: Array
    scale: Scale
    mu: Array


@dataclass(frozen=True)
class SolvedSurface:
    """Paths of some of the fingers of a `LoweredSurface`. designs: (D,) their indices there."""

    designs: Array
    trace: SurfaceTrace


def lower_surface(group: CaseGroup, positions: Array | None = None) -> LoweredSurface:
    """The dimensionless problems of a group of cases whose fingers touch with their own side.

    positions: (P,) in m or rad, in the order to solve; default: the path of the scene.
    """
    scene, v = group.scene, group.values
    length, clamp = v["length"], v["thickness_clamp"]
    stiffness = v["young"] * v["width"] * clamp**3 / 12.0
    shear = np.zeros_like(length)
    if scene.model.shear:
        kappa = (5.0 + 5.0 * v["poisson"]) / (6.0 + 5.0 * v["poisson"])  # Lan & Lee 2008, eq. (20)
        shear = stiffness / (kappa * v["shear_modulus"] * v["width"] * clamp * length**2)
    circle = scene.target.shape == "circle"
    semi_x = v["target_radius"] if circle else v["semi_x"]
    semi_y = v["target_radius"] if circle else v["semi_y"]
    turns = scene.path.kind == "rotation"
    touches = scene.path.start == "touch" and positions is None
    start = v["start"]
    if touches:  # in a rotation it is looked for below
        start = v["stop"] if turns else first_touches(group)
    scaled = [
        v["thickness_tip"] / clamp,
        clamp / length,
        shear,
        semi_x / length,
        semi_y / length,
        v["tilt"],
        v["offset"] / length,
        v["y"] / length,
        v["path_x"] / length,
        v["speed_ratio"] / length,
        v["path_angle"],
        start if turns else start / length,
        v["stop"] if turns else v["stop"] / length,
        v["mu"],
        length if scene.finger.profile or scene.target.vertices or positions is not None else 0.0,
    ]
    key = np.column_stack([np.broadcast_to(np.nan_to_num(x), length.shape) for x in scaled])
    different, problem_of = unique_rows(key)
    if touches and turns:
        still = _problem(scene, different, np.ones(len(different)), np.zeros(1))
        columns = [_PATH_X, _SPEED, _Y, _TILT]
        different[:, _START] = rotation_touches(still, different[:, columns], different[:, _STOP])
    sense = np.where(different[:, _STOP] > different[:, _START], 1.0, -1.0)
    problem = _problem(scene, different, sense, positions)
    withdraws = scene.path.withdraw and positions is None
    return LoweredSurface(
        scene=scene,
        problem=problem,
        positions=problem.positions,
        sense=sense,
        turned=np.ascontiguousarray(different[:, _MU]),
        turn=(scene.path.steps if withdraws else problem.positions.shape[1]) - 1,
        problem_of=problem_of,
        scale=Scale(length, stiffness / length**2, clamp / (2.0 * length)),
        mu=v["mu"],
    )


def _problem(scene: Scene, different: Array, sense: Array, positions: Array | None) -> NodalProblem:
    """The problem of the D different fingers, one row of the key of `lower_surface` each."""
    (
        ratio,
        slenderness,
        shear,
        semi_x,
        semi_y,
        tilt,
        offset,
        y,
        path_x,
        speed,
        path_angle,
        start,
        stop,
        mu,
        length,
    ) = different.T
    count, intervals = len(different), scene.solver.intervals
    s = np.linspace(0.0, 1.0, intervals + 1)
    node, middle = _thickness(scene, ratio, length, s)
    bent, sheared = _flexibilities(scene, node, length, s)
    left = scene.finger.side == "left"
    half = (0.5 if left else -0.5) * slenderness[:, None] * node
    if scene.model.surface == "axis":
        half = np.zeros_like(half)
    turns = scene.path.kind == "rotation"
    if positions is None:
        path = np.linspace(start, stop, scene.path.steps, axis=1)
        if scene.path.withdraw:
            path = np.hstack([path, path[:, -2::-1]])
    else:
        path = np.asarray(positions)[None, :] / (np.ones(count) if turns else length)[:, None]
    path = np.broadcast_to(path, (count, path.shape[1])).copy()
    vertices = _vertices(scene, semi_x, semi_y, length)
    base = path if turns else np.broadcast_to(path_angle[:, None], path.shape)
    x = path_x[:, None] + speed[:, None] * (path - 0.5 * np.pi) if turns else path
    placement, motion = _placements(base, x, y, tilt, offset, speed if turns else 1.0, turns)
    motion *= sense[:, None, None]
    if positions is None:
        motion[:, scene.path.steps :] *= -1.0  # on the way back
    return NodalProblem(
        step=np.full(intervals, 1.0 / intervals),
        arc=s,
        bending=intervals / bent,
        flexibility=bent / intervals,
        shear_flexibility=shear[:, None] * sheared * intervals,
        thickness=middle,
        offset=np.column_stack([half, -half[:, -1]]),
        nodes_touch=int(scene.solver.contact != "points-on-target"),
        points=_target_points(scene, vertices),
        vertices=vertices,
        shape=_SHAPES[scene.target.shape],
        positions=path,
        placement=placement,
        motion=motion,
        base=np.array(base),  # writeable, as the others: compiled code is made for one kind
        arm=np.ascontiguousarray(offset),
        mu=np.ascontiguousarray(mu) if scene.friction.model == "equilibrium" else np.zeros(count),
        left=int(left),
        printed_section=int(scene.model.section == "psi+gamma"),
    )


def _thickness(scene: Scene, ratio: Array, length: Array, s: Array) -> tuple[Array, Array]:
    """Thickness over that at the clamp at the nodes `s` (D, N + 1) and at midpoints (D, N)."""
    middle = 0.5 * (s[1:] + s[:-1])
    if scene.finger.profile is None:
        taper = ratio[:, None] - 1.0
        return 1.0 + taper * s, 1.0 + taper * middle
    at, w = np.array(scene.finger.profile).T
    node = np.array([np.interp(s * one, at, w) for one in length]) / w[0]
    between = np.array([np.interp(middle * one, at, w) for one in length]) / w[0]
    return node, between


def _flexibilities(scene: Scene, node: Array, length: Array, s: Array) -> tuple[Array, Array]:
    """Means over each interval (D, N) of ``1 / w^3`` and ``1 / w``, exact for a thickness that is
    linear between its stations: on a steep taper an interval's thin end gives nearly all of it."""
    if scene.finger.profile is None:
        return _piece(node[:, :-1], node[:, 1:])
    bent, sheared = np.empty((2, len(length), len(s) - 1))
    at, w = np.array(scene.finger.profile).T
    for d, one in enumerate(length):
        ends = np.union1d(s, at / one)
        ends = ends[ends <= 1.0]
        thickness = np.interp(ends * one, at, w) / w[0]
        share = np.diff(ends) * (len(s) - 1)
        interval = np.clip(np.searchsorted(s, ends[:-1], "right") - 1, 0, len(s) - 2)
        for out, mean in zip((bent, sheared), _piece(thickness[:-1], thickness[1:]), strict=True):
            out[d] = np.bincount(interval, weights=share * mean, minlength=len(s) - 1)
    return bent, sheared


def _piece(w0: Array, w1: Array) -> tuple[Array, Array]:
    """Means of ``1 / w^3`` and ``1 / w`` where w goes linearly from w0 to w1."""
    grown = w1 / w0 - 1.0
    even = grown == 0.0
    sheared = np.where(even, 1.0, np.log1p(grown) / np.where(even, 1.0, grown)) / w0
    return (w0 + w1) / (2.0 * w0**2 * w1**2), sheared


def _vertices(scene: Scene, semi_x: Array, semi_y: Array, length: Array) -> Array:
    """(D, V, 2): corners of a polygon; ``[[a, b]]`` of an ellipse; nothing of a half-plane."""
    if scene.target.vertices is not None:
        corners: Array = np.array(scene.target.vertices) / length[:, None, None]
        return corners
    return np.ascontiguousarray(np.column_stack([semi_x, semi_y])[:, None, :])


def _target_points(scene: Scene, vertices: Array) -> Array:
    """Points (D, M, 2) of the target that are contact points: `solver.points` all around it (10b),
    or, where the finger's nodes are (10a), what is too sharp to be seen by them: a polygon's
    corners, and where an ellipse is as sharp as those."""
    shape, interval = scene.target.shape, 1.0 / scene.solver.intervals
    if scene.solver.contact != "points-on-target":
        if shape == "half-plane" or scene.solver.contact != "closest":
            return np.zeros((len(vertices), 0, 2))
        if shape == "polygon":
            return np.ascontiguousarray(vertices[:, _sharp(vertices, interval)])
        return _sharp_ends(vertices[:, 0], interval)
    fraction = np.arange(scene.solver.points) / scene.solver.points
    if shape == "half-plane":  # as far as the finger reaches to both sides
        along = 4.0 * fraction - 2.0
        points = np.stack([along, np.zeros_like(along)], axis=-1)
        everywhere: Array = np.broadcast_to(points, (len(vertices), *points.shape)).copy()
        return everywhere
    if shape == "polygon":
        corners = len(vertices[0])
        low = (fraction * corners).astype(np.int64)
        share = (fraction * corners - low)[None, :, None]
        edges = np.roll(vertices, -1, axis=1) - vertices
        return np.ascontiguousarray(vertices[:, low] + share * edges[:, low])
    angle = 2.0 * np.pi * fraction
    return np.ascontiguousarray(vertices * np.column_stack([np.cos(angle), np.sin(angle)]))


def _sharp_ends(axes: Array, interval: float) -> Array:
    """Points (D, M, 2) of the ellipses with the semi-axes `axes` (D, 2) where their radius of
    curvature is below an `interval`; M = 0 where no ellipse has any.

    About both ends of the longer axis the outline's normal turns by the same angle from point to
    point. A last one on each side is where the nodes touch again (`kernels.nodal`), so that no part
    of the outline lies between. An ellipse without sharp ends has all its points in its centre,
    where nothing touches.
    """
    long, short = np.maximum(*axes.T)[:, None], np.minimum(*axes.T)[:, None]
    # at the angle t between normal and long axis the radius is (long short)^2 / size^3 with
    # size^2 = short^2 + (long^2 - short^2) cos^2 t
    size = ((long * short) ** 2 / interval) ** (2.0 / 3.0)
    sharp = long**2 > size
    if not sharp.any():
        return np.zeros((len(axes), 0, 2))
    focal = np.where(long > short, long**2 - short**2, 1.0)
    limit = np.arccos(np.sqrt(np.clip((size - short**2) / focal, 0.0, 1.0)))
    low, high, last = limit, np.full_like(limit, 0.5 * np.pi), _outline(long, short, limit)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        away = np.linalg.norm(_outline(long, short, middle) - last, axis=-1)
        low = np.where(away < _BESIDE * interval, middle, low)
        high = np.where(away < _BESIDE * interval, high, middle)
    turned = np.hstack([-high, limit * np.linspace(-1.0, 1.0, AROUND // 2 - 1), high])
    end = _outline(long, short, turned)
    points = np.concatenate([end, -end], axis=1)
    points = np.where((axes[:, 0] >= axes[:, 1])[:, None, None], points, points[..., ::-1])
    found: Array = np.where(sharp[:, :, None], points, 0.0)
    return found


def _outline(long: Array, short: Array, angle: Array) -> Array:
    """Points (D, K, 2), first along the longer axis, of ellipses where the normal is at the `angle`
    (D, K) to it; long, short: (D, 1)."""
    along, across = long * np.cos(angle), short * np.sin(angle)
    size = np.hypot(along, across)[..., None]
    point: Array = np.stack([long * along, short * across], axis=-1) / size
    return point


def _sharp(vertices: Array, interval: float) -> Array:
    """(V,) bool: which corners of the polygons (D, V, 2) nodes an `interval` apart would not see.

    Where a smooth outline is given by many short edges, the nodes see it as they see an ellipse.
    """
    ahead = np.roll(vertices, -1, axis=1) - vertices
    length = np.hypot(*np.moveaxis(ahead, -1, 0))
    direction = np.unwrap(np.arctan2(ahead[..., 1], ahead[..., 0]), axis=1)
    longer = np.maximum(length, np.roll(length, 1, axis=1)) > _EDGE * interval
    # the outline's direction over its length, twice around: how far it turns about each corner
    turns = np.zeros(vertices.shape[:2], dtype=bool)
    for d in range(len(vertices)):
        at = np.concatenate([[0.0], np.cumsum(np.tile(length[d], 3))])
        around = np.concatenate([direction[d] + 2.0 * np.pi * k for k in range(3)])
        corner = at[len(length[d]) + np.arange(len(length[d]))]
        before = np.searchsorted(at, corner - 0.5 * interval, side="right") - 1
        after = np.searchsorted(at, corner + 0.5 * interval, side="right") - 1
        # a polygon smaller than an interval turns by all that is known of it
        after, before = np.minimum(after, len(around) - 1), np.maximum(before, 0)
        turns[d] = around[after] - around[before] > _TURN
    sharp: Array = (longer | turns).any(axis=0)
    return sharp


def _placements(
    base: Array, x: Array, y: Array, tilt: Array, offset: Array, speed: Array | float, turns: bool
) -> tuple[Array, Array]:
    """Placement of the target in the base's frame (D, P, 3), and its derivative by the position.

    base: (D, P) direction of the base; x: (D, P), y, tilt: (D,) of the target in space; offset:
    (D,) of the clamp from the pivot; speed: (D,) of x per unit of position.
    """
    cos, sin = np.cos(base), np.sin(base)
    here_x = cos * x + sin * y[:, None] - offset[:, None]
    here_y = cos * y[:, None] - sin * x
    placement = np.stack([here_x, here_y, tilt[:, None] - base], axis=-1)
    rate = np.broadcast_to(speed, y.shape)[:, None]
    turn = 1.0 if turns else 0.0
    motion = np.stack(
        [
            cos * rate + turn * here_y,
            -sin * rate - turn * (here_x + offset[:, None]),
            np.full_like(base, -turn),
        ],
        axis=-1,
    )
    return placement, motion


def solve_surfaces(lowered: LoweredSurface, shapes: bool) -> Iterator[SolvedSurface]:
    """Solve all fingers; each comes out once. shapes: whether to keep angles and forces."""
    everything = lowered.problem
    tolerance = min(max(_ALGEBRAIC_SHARE * lowered.scene.solver.rtol, _TIGHTEST), _LOOSEST)
    for first in range(0, len(lowered.positions), _CHUNK):
        chosen = slice(first, first + _CHUNK)
        arrays = {
            name: getattr(everything, name)[chosen]
            for name in NodalProblem._fields
            if isinstance(getattr(everything, name), np.ndarray) and name not in ("step", "arc")
        }
        problem = everything._replace(**arrays)
        trace = make_surface_trace(problem, shapes)
        trace_surfaces(problem, make_walk(problem), tolerance, trace)
        if lowered.scene.friction.model == "recovered":
            turn_forces(problem, lowered.turned[chosen], trace.rows)
        yield SolvedSurface(np.arange(first, first + len(problem.positions)), trace)


def finger_at(lowered: LoweredSurface, solved: SolvedSurface, d: int, i: int) -> dict[str, Array]:
    """The finger `d` of `solved` at position `i` in space, dimensionless: s, x, y, psi, gamma,
    moment (N + 1,) at its nodes; needs the shapes."""
    problem, trace, design = lowered.problem, solved.trace, solved.designs[d]
    psi, gamma, contact = trace.psi[d, i], trace.gamma[d, i], trace.contact[d, i]
    base, arm = problem.base[design, i], problem.arm[design]
    theta = 0.5 * (psi[1:] + psi[:-1]) + gamma[1:]
    x = np.concatenate([[0.0], np.cumsum(problem.step * np.cos(theta))])
    y = np.concatenate([[0.0], np.cumsum(problem.step * np.sin(theta))])
    # the moment about each node of the forces that act beyond it
    at, px, py, fx, fy = contact[contact[:, 3:].any(axis=1)].T
    turn = (px - x[:, None]) * fy - (py - y[:, None]) * fx
    moment = np.where(at > problem.arc[:, None], turn, 0.0).sum(axis=1)
    between = np.concatenate([gamma[1:2], 0.5 * (gamma[1:-1] + gamma[2:]), gamma[-1:]])
    x_space, y_space = _in_space(base, arm + x, y)
    return {
        "s": problem.arc,
        "x": x_space,
        "y": y_space,
        "psi": base + psi,
        "gamma": between,
        "moment": moment,
    }


def contacts_at(lowered: LoweredSurface, solved: SolvedSurface, d: int, i: int) -> dict[str, Array]:
    """The k touching points of finger `d` of `solved` at position `i` in space, dimensionless: s,
    x, y, force_x, force_y (k,); needs the shapes."""
    problem, design = lowered.problem, solved.designs[d]
    contact = solved.trace.contact[d, i]
    s, px, py, fx, fy = contact[contact[:, 3:].any(axis=1)].T
    base = problem.base[design, i]
    x, y = _in_space(base, problem.arm[design] + px, py)
    force_x, force_y = _in_space(base, fx, fy)
    if len(s) == 1:  # that of the row, which the recovered rule may have turned
        row = solved.trace.rows[d, i]
        force_x, force_y = row[[surface_rows.FORCE_X]], row[[surface_rows.FORCE_Y]]
    return {"s": s, "x": x, "y": y, "force_x": force_x, "force_y": force_y}


def _in_space(base: float, x: Array, y: Array) -> tuple[Array, Array]:
    """Vectors of the base's frame in space."""
    return np.cos(base) * x - np.sin(base) * y, np.sin(base) * x + np.cos(base) * y
