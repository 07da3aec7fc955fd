"""Fingers in direct contact: from scenes in SI units to dimensionless problems.

Lengths are divided by the finger's length L, forces by ``E I / L^2`` of the clamp's section, as for
jaws (`fastncm.lowering`). The finger's base stands still in the compiled code: base and target move
relative to each other, and the relative motion is the target's (its placement).
"""

from dataclasses import dataclass

import numpy as np

from fastncm.direct.targets import target_points, target_vertices
from fastncm.direct.touch import first_touches, rotation_touches
from fastncm.kernels import distance
from fastncm.kernels.nodal import NodalProblem
from fastncm.lowering import Scale, unique_rows
from fastncm.scene import CaseGroup, Scene

Array = np.ndarray

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
    touches = scene.path.start == "touch"  # with positions of one's own for the sense only
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
    vertices = target_vertices(scene, semi_x, semi_y, length)
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
        points=target_points(scene, vertices),
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
