"""SciPy's SLSQP on any of the atlas's fingers with a jaw, from several starts, without friction.

To learn whether there is a shape where the package finds none, with nothing of it: the finger is a
chain of N_LINKS links of equal flexibility, the jaw a row of points that stay outside the target,
the energy is minimised from the undeformed finger and from fingers bent down and up. Lengths in
units of the finger's, energies of EI/L at the clamp.
"""

from dataclasses import dataclass

import extremes
import numpy as np
import shooting_many
from scipy.optimize import minimize

Array = np.ndarray

N_LINKS = 30
EDGE_POINTS = 81
RETURN_POINTS = 20
CURVATURES = (0.0, -1.0, -3.0, 2.0)
"""Of the starts, 1/L."""
MOST_ITERATIONS = 300
FTOL = 1e-10
CLEAR = 1e-7
"""Penetration that an answer may have."""


@dataclass(frozen=True)
class Shape:
    """A jaw's finger at one position: links (n,) and their compliances, jaw points (P, 2) from the
    tip, the target's point, radius (0: a block) and length of the block's underside (0: endless).
    """

    links: Array
    bending: Array
    shearing: Array | None
    jaw: Array
    at: Array
    radius: float
    length: float


def shape_of(columns: extremes.Columns, row: int) -> Shape:
    """The scene in row `row` of a table at the end of its path."""
    rows = np.array([row])
    f = shooting_many.fingers(columns, rows, columns["path.stop"][rows].astype(float))
    ratio, shear = float(f.ratio[0]), float(f.shear[0])
    grows = np.log(ratio)
    z = np.linspace(0.0, 1.0, N_LINKS + 1)
    s = z if abs(grows) < 1e-12 else np.expm1(grows * z) / (ratio - 1.0)
    links, middle = np.diff(s), 0.5 * (s[1:] + s[:-1])
    thick = 1.0 + (ratio - 1.0) * middle
    place = np.linspace(0.0, 1.0, EDGE_POINTS)
    edge = extremes.jaw_point(
        np.repeat(f.a, len(place), 0), np.repeat(f.b, len(place), 0),
        np.repeat(f.half, len(place)), place,
    )[0]  # fmt: skip
    down = -np.array([np.cos(f.back[0]), np.sin(f.back[0])])
    size = float(np.hypot(*(f.b - f.a)[0]))
    far = np.linspace(0.0, 3.0 * size, RETURN_POINTS + 1)[1:]
    return Shape(
        links=links,
        bending=thick**3,
        shearing=shear * thick if np.isfinite(shear) else None,
        jaw=np.vstack([edge, f.a + far[:, None] * down]),
        at=f.at[0],
        radius=float(f.radius[0]),
        length=float(f.length[0]),
    )


def pose(shape: Shape, unknowns: Array) -> Array:
    """The tip's x, y, psi; unknowns: the links' curvatures (n,), then shear angles (n,)."""
    n = len(shape.links)
    turn = np.cumsum(unknowns[:n] * shape.links)
    middle = turn - 0.5 * unknowns[:n] * shape.links
    theta = middle + (unknowns[n:] if shape.shearing is not None else 0.0)
    return np.array([shape.links @ np.cos(theta), shape.links @ np.sin(theta), turn[-1]])


def gaps(shape: Shape, where: Array) -> Array:
    """Distances (P,) of the jaw's points from the target, negative inside."""
    cos, sin = np.cos(where[2]), np.sin(where[2])
    p = where[:2] + shape.jaw @ np.array([[cos, sin], [-sin, cos]]) - shape.at
    if shape.radius > 0.0:
        return np.hypot(*p.T) - shape.radius
    # a block to the right of and above its corner
    out = np.column_stack([-p[:, 0], -p[:, 1]])
    if shape.length > 0.0:
        out = np.column_stack([out, p[:, 0] - shape.length])
    across = np.maximum(out[:, 0], out[:, 2]) if shape.length > 0.0 else out[:, 0]
    outside = np.hypot(np.maximum(across, 0.0), np.maximum(out[:, 1], 0.0))
    return np.where(outside > 0.0, outside, np.maximum(across, out[:, 1]))


def solve(shape: Shape) -> tuple[bool, Array, float]:
    """Whether any start ends in a shape that does not penetrate, of the least energy found; the
    unknowns and the energy."""
    n = len(shape.links)
    weight = shape.bending * shape.links
    if shape.shearing is not None:
        weight = np.concatenate([weight, shape.shearing * shape.links])
    scale = 1.0 / np.sqrt(weight)  # unknowns in which the energy is 1/2 z.z
    outside = {"type": "ineq", "fun": lambda z: gaps(shape, pose(shape, scale * z))}
    best: tuple[bool, Array, float] = (False, np.zeros(len(scale)), np.inf)
    for curvature in CURVATURES:
        start = np.zeros(len(scale))
        start[:n] = curvature / scale[:n]
        found = minimize(
            lambda z: 0.5 * z @ z, start, jac=lambda z: z, method="SLSQP", constraints=outside,
            options={"ftol": FTOL, "maxiter": MOST_ITERATIONS},
        )  # fmt: skip
        inside = gaps(shape, pose(shape, scale * found.x)).min() < -CLEAR
        if found.success and not inside and found.fun < best[2]:
            best = True, scale * found.x, float(found.fun)
    return best
