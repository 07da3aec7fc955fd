"""From scenes in SI units to dimensionless problems: the only place where units are stripped.

Lengths are divided by the finger's length L, forces by ``E I / L^2``, energies by ``E I / L``, with
E I of the clamp's section (``I = b w^3 / 12``, Lan & Lee 2008, eq. (2)). Cases whose dimensionless
problems are equal are one problem: a uniform finger without shear has a shape that does not depend
on E, b or w at all.
"""

from dataclasses import dataclass

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.basis import grade, profiles, quadrature, quadrature_points
from fastncm.kernels.problem import Problem
from fastncm.path.touch import first_touches
from fastncm.scene import CaseGroup, Scene

Array = np.ndarray

#: Columns that never enter the dimensionless problem; and those that enter it only with shear.
_SCALE_ONLY = ("finger.young", "finger.width")
_SCALE_ONLY_WITHOUT_SHEAR = ("finger.thickness", "finger.poisson", "finger.shear_modulus")
_FORMS = {
    "closest": c.CLOSEST,
    "points-on-finger": c.POINTS_ON_FINGER,
    "points-on-target": c.POINTS_ON_TARGET,
}


@dataclass(frozen=True)
class Scale:
    """What turns dimensionless answers into SI units; every field has shape (C,), one entry per
    case."""

    length: Array  #: m
    force: Array  #: N, E I / L^2
    strain: (
        Array  #: thickness at the clamp over twice the length: strain per unit of curvature L psi'
    )


@dataclass(frozen=True)
class Lowered:
    """The different dimensionless problems of a group of cases, and how the cases use them.

    ratio, shear_stiffness: (D,); jaw: (D, JAW_COLUMNS); target: (D, TARGET_COLUMNS); mu: (D,)
    friction of the model "equilibrium"; positions: (D, N); direction: (D,), +1 or -1, the sense of
    the target's motion along x on the scene's own path, by which the insertion force is counted
    whatever the order of the positions. problem_of: (C,) int64, which problem each case uses;
    scale: of the cases; turned: (C,) friction of the model "recovered", by which forces are turned
    afterwards. turn: the row at which the target turns back (the last one where it does not).
    """

    scene: Scene
    ratio: Array
    shear_stiffness: Array
    jaw: Array
    target: Array
    mu: Array
    positions: Array
    direction: Array
    problem_of: Array
    scale: Scale
    turned: Array
    turn: int

    def problem(self, order: int, designs: Array) -> Problem:
        """The `designs` (indices) as the kernels want them, with `order` modes per field; their
        tapers are of one grade (`kernels.basis.grade`)."""
        shear = self.scene.model.shear
        graded = int(grade(self.ratio[designs[:1]])[0])
        ratios, profile_of = np.unique(self.ratio[designs], return_inverse=True)
        return Problem(
            rule=quadrature(quadrature_points(order, graded), graded),
            profile=profiles(ratios, order, shear, graded),
            profile_of=profile_of.astype(np.int64),
            ratio=self.ratio[designs],
            shear_stiffness=self.shear_stiffness[designs],
            printed_section=int(self.scene.model.section == "psi+gamma"),
            jaw=self.jaw[designs],
            target=self.target[designs],
            mu=self.mu[designs],
            positions=self.positions[designs],
            kind=c.CIRCLE if self.scene.target.shape == "circle" else c.BLOCK,
            form=_FORMS[self.scene.solver.contact],
            points=self.scene.solver.points,
        )


def scale_only_names(scene: Scene) -> frozenset[str]:
    """Dotted names that change only the scale of this scene's answers: cases that differ in nothing
    else share one dimensionless problem."""
    names = set(_SCALE_ONLY)
    if scene.friction.model == "recovered":
        names.add("friction.mu")
    tapered = isinstance(scene.finger.thickness, tuple)
    if not scene.model.shear:
        names.update(n for n in _SCALE_ONLY_WITHOUT_SHEAR if n != "finger.thickness" or not tapered)
    return frozenset(names)


def lower(group: CaseGroup, positions: Array | None = None) -> Lowered:
    """The dimensionless problems of a group of cases.

    positions: (N,) of the target in metres, in the order to solve; default: the path of the scene.
    """
    v = group.values
    scene = group.scene
    length, clamp = v["length"], v["thickness_clamp"]
    stiffness = v["young"] * v["width"] * clamp**3 / 12.0
    ratio = v["thickness_tip"] / clamp
    shear_stiffness = np.ones_like(length)
    if scene.model.shear:
        kappa = (5.0 + 5.0 * v["poisson"]) / (6.0 + 5.0 * v["poisson"])  # Lan & Lee 2008, eq. (20)
        shear_stiffness = kappa * v["shear_modulus"] * v["width"] * clamp * length**2 / stiffness
    key = np.column_stack(
        [
            ratio,
            shear_stiffness,
            v["a_x"] / length,
            v["a_y"] / length,
            v["b_x"] / length,
            v["b_y"] / length,
            _or_zero(v["jaw_radius"] / length),
            _or_zero(v["target_radius"] / length),
            v["y"] / length,
            v["start"] / length,
            v["stop"] / length,
            v["return_angle"],
            _or_zero(v["target_length"] / length),
            v["mu"] if scene.friction.model == "equilibrium" else np.zeros_like(length),
        ]
    )
    different, problem_of = unique_rows(key)
    ratio, shear_stiffness, ax, ay, bx, by, rho, radius, y, start, stop, back, reach, mu = (
        different.T
    )
    concave = scene.jaw is not None and not scene.jaw.convex
    jaw = _jaw(ax - 1.0, ay, bx - 1.0, by, -rho if concave else rho, back)
    target = np.column_stack([radius, y, reach])
    if positions is None:
        kind = c.CIRCLE if scene.target.shape == "circle" else c.BLOCK
        start = _first_contact(kind, jaw, target, start, stop)
        path = np.linspace(start, stop, scene.path.steps, axis=1)
        if scene.path.withdraw:
            path = np.hstack([path, path[:, -2::-1]])
    else:
        # the given positions are the same in metres for every case; lengths differ only between
        # problems
        lengths = np.empty(len(different))
        lengths[problem_of] = length
        path = np.asarray(positions, dtype=np.float64)[None, :] / lengths[:, None]
    return Lowered(
        scene=scene,
        ratio=np.ascontiguousarray(ratio),
        shear_stiffness=np.ascontiguousarray(shear_stiffness),
        jaw=jaw,
        target=target,
        mu=np.ascontiguousarray(mu),
        positions=np.ascontiguousarray(path),
        direction=np.where(start < stop, 1.0, -1.0),  # NaN, the first touch, lies before stop
        problem_of=problem_of,
        scale=Scale(length, stiffness / length**2, clamp / (2.0 * length)),
        turn=scene.path.steps - 1 if positions is None else path.shape[1] - 1,
        turned=v["mu"] if scene.friction.model == "recovered" else np.zeros_like(length),
    )


def _or_zero(values: Array) -> Array:
    """NaN stands for "has none" in the case table; the kernels want a zero."""
    return np.where(np.isnan(values), 0.0, values)


def unique_rows(key: Array) -> tuple[Array, Array]:
    """The different rows of `key` (C, k) and, for each row, which of them it is. NaNs are equal
    here."""
    if len(key) == 1:
        return key, np.zeros(1, dtype=np.int64)
    key = np.ascontiguousarray(key + 0.0)  # -0.0 and 0.0 are the same
    as_bytes = key.view(np.dtype((np.void, key.dtype.itemsize * key.shape[1]))).ravel()
    _, first, inverse = np.unique(as_bytes, return_index=True, return_inverse=True)
    # number the problems in the order of their first case, so that the table's order is the cases'
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return key[first[order]], rank[inverse].astype(np.int64)


def _jaw(ax: Array, ay: Array, bx: Array, by: Array, rho: Array, back: Array) -> Array:
    """The jaws' geometry in the tip's frame (`kernels.constants`), from corners, signed radius and
    the return face's angle (D,).

    The outside lies to the left on the way from a to b; a convex arc bulges towards it.
    """
    chord_x, chord_y = bx - ax, by - ay
    chord = np.hypot(chord_x, chord_y)
    tx, ty = chord_x / chord, chord_y / chord
    # centre of the arc: off the chord's middle, to the inside where convex, to the outside where
    # concave
    height = np.sqrt(np.maximum(rho**2 - 0.25 * chord**2, 0.0)) * np.sign(rho)
    mx, my = 0.5 * (ax + bx) + height * ty, 0.5 * (ay + by) - height * tx
    curved = rho != 0.0
    safe = np.where(curved, rho, 1.0)
    jaw = np.empty((len(ax), c.JAW_COLUMNS))
    jaw[:, c.AX], jaw[:, c.AY], jaw[:, c.BX], jaw[:, c.BY] = ax, ay, bx, by
    jaw[:, c.TAX] = np.where(curved, (ay - my) / safe, tx)
    jaw[:, c.TAY] = np.where(curved, -(ax - mx) / safe, ty)
    jaw[:, c.TBX] = np.where(curved, (by - my) / safe, tx)
    jaw[:, c.TBY] = np.where(curved, -(bx - mx) / safe, ty)
    jaw[:, c.MX], jaw[:, c.MY], jaw[:, c.RHO] = mx, my, rho
    jaw[:, c.TRX], jaw[:, c.TRY] = np.cos(back), np.sin(back)
    return jaw


def _first_contact(kind: int, jaw: Array, target: Array, start: Array, stop: Array) -> Array:
    """Start of the path where it is "touch" (NaN): the first contact of a target that comes from
    beyond the tip. Where there is none, the path starts clear of the jaw."""
    missing = np.isnan(start)
    if not missing.any():
        return start
    reach = np.hypot(jaw[:, [c.AX, c.BX]], jaw[:, [c.AY, c.BY]]).max(axis=1)
    far = 1.0 + reach + 2.0 * np.abs(jaw[:, c.RHO]) + target[:, c.TARGET_RADIUS]
    touch = first_touches(kind, jaw, target, np.maximum(far, stop + 1e-3), stop)
    return np.where(missing, touch, start)
