"""An equilibrium without friction is followed from the first touch by SciPy's SLSQP, in small steps
of the target: the judge of whether the path leads to an answer where the package has none.

Nothing of the package is used. At each step the energy is minimised from the shape before, a little
shaken, so that only minima are followed. Where the shape moves too far, or the target's work does
not explain its energy, the step is divided; where that is still so in the smallest one, the branch
has ended in a limit point and the finger snaps, but never to a shape of more energy.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import minimize, nnls

Array = np.ndarray

REACHED, BEHIND, ENDS, UNKNOWN = "reached", "behind a snap", "no shape", "undecided"
"""The branch from first touch reaches the end of the path; a snap does, from the branch's end; no
shape is found from there; too many steps."""

LOOKS = 32
"""At how far the target is in the undeformed finger."""
LARGEST, SMALLEST = 1.0 / 20, 2.0**-18
"""Steps, of the target's way."""
NEAR = 0.15
"""How far a shape may move in a step, of its size."""
UNEXPLAINED = 0.25
"""Energy, of what is stored, that may be gained or lost in a step beside the target's work."""
NEAREST = 40
"""Gaps that a minimisation is told of; an answer must keep all."""
MOST_SOLVES = 150
MOST_SNAPS = 4
MOST_ITERATIONS = 100
FTOL = 1e-11
CLEAR = 1e-5
"""Penetration that a shape may have, of the undeformed finger's."""
KKT = 1e-2
"""Residual of the equilibrium that a shape may have, of its size."""
SHAKE = 1e-4


class Chain(Protocol):
    """A finger in unknowns z (n,) in which its energy is 1/2 z.z."""

    size: int

    def gaps(self, z: Array, position: float) -> Array:
        """Distances (m,) from the target."""

    def slopes(self, z: Array, position: float) -> Array:
        """Their derivatives (m, n)."""

    def is_clear(self, z: Array, position: float) -> bool:
        """Whether what the gaps do not see is outside, too."""


@dataclass(frozen=True)
class Followed:
    """What became of the branch, the shape (n,) there, and the position where it first snapped or
    ended (NaN: nowhere)."""

    what: str
    z: Array
    position: float


def first_touch(is_inside: Callable[[float], bool], ways: Array) -> float:
    """How far before the end of the path the undeformed finger is first touched; `ways` (k,), in
    ascending order, are looked at, and the touch is found by bisection. NaN: nowhere."""
    inside = [is_inside(float(way)) for way in ways]
    if not any(inside):
        return float("nan")
    last = int(np.flatnonzero(inside)[-1])
    low, high = ways[last], ways[min(last + 1, len(ways) - 1)]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_inside(middle) else (low, middle)
    return float(high)


def follow(chain: Chain, first: float, stop: float) -> Followed:
    """From the first touch to the end of the path."""
    z, rng = np.zeros(chain.size), np.random.default_rng(0)
    if np.isnan(first):
        return Followed(UNKNOWN, z, np.nan)
    way = first + np.linspace(0.0, 1.0, LOOKS + 1)[1:] * (stop - first)
    deep = -min(chain.gaps(z, float(position)).min() for position in way)
    # of the unknowns: what moves the finger as deep as the target is in the undeformed one
    unit = min(deep, 1.0) / np.linalg.norm(chain.slopes(z, first), axis=1).max()
    done, step, snapped, snaps, push = 0.0, LARGEST, np.nan, 0, 0.0
    for _ in range(MOST_SOLVES):
        to = min(done + step, 1.0)
        position = first + to * (stop - first)
        trial = _minimise(chain, z, position, unit, deep, rng)
        odd, ahead = 0.0, 0.0
        if trial is not None:
            ahead = _push(chain, trial, position, deep)
            work = 0.5 * (push + ahead) * (to - done) * (stop - first)
            before, after = 0.5 * z @ z, 0.5 * trial @ trial
            odd = (after - before - work) / max(before, after, np.finfo(float).tiny)
        far = trial is None or np.linalg.norm(trial - z) > NEAR * max(unit, np.linalg.norm(z))
        far = far or abs(odd) > UNEXPLAINED
        if far and step > SMALLEST:
            step *= 0.25
            continue
        if odd > UNEXPLAINED:
            trial = None
        if far:
            snapped = snapped if snaps else first + done * (stop - first)
            snaps += 1
            if trial is None or snaps > MOST_SNAPS:
                return Followed(ENDS if trial is None else UNKNOWN, z, snapped)
        z, push, done, step = trial, ahead, to, min(2.0 * step, LARGEST)
        if done == 1.0:
            clear = chain.is_clear(z, stop)
            what = BEHIND if snaps else REACHED
            return Followed(what if clear else UNKNOWN, z, snapped)
    return Followed(UNKNOWN, z, snapped)


def _minimise(
    chain: Chain, z: Array, position: float, unit: float, deep: float, rng: np.random.Generator
) -> Array | None:
    """The minimum next to z (n,); None: none that does not penetrate."""
    shake = SHAKE * max(unit, float(np.linalg.norm(z))) / np.sqrt(len(z))
    near = np.argsort(chain.gaps(z, position))[:NEAREST]
    found = minimize(
        lambda u: 0.5 * u @ u, (z + shake * rng.standard_normal(len(z))) / unit, jac=lambda u: u,
        method="SLSQP", options={"ftol": FTOL, "maxiter": MOST_ITERATIONS},
        constraints={
            "type": "ineq",
            "fun": lambda u: chain.gaps(unit * u, position)[near] / deep,
            "jac": lambda u: chain.slopes(unit * u, position)[near] * unit / deep,
        },
    )  # fmt: skip
    new = unit * found.x
    if not np.isfinite(new).all() or chain.gaps(new, position).min() < -CLEAR * deep:
        return None
    return (
        new if _held(chain, new, position, deep)[2] < KKT * max(unit, np.linalg.norm(new)) else None
    )


def _push(chain: Chain, z: Array, position: float, deep: float) -> float:
    """Work of the target per unit of its way: the forces that hold z (n,), times how fast their
    gaps close (central differences)."""
    touching, force, _ = _held(chain, z, position, deep)
    h = 1e-6 * max(1.0, abs(position))
    ahead, behind = chain.gaps(z, position + h), chain.gaps(z, position - h)
    return float(force @ (behind - ahead)[touching] / (2.0 * h))


def _held(chain: Chain, z: Array, position: float, deep: float) -> tuple[Array, Array, float]:
    """Which gaps touch (m,), the forces >= 0 in them that hold z (n,) best, and how far off that
    is."""
    touching = chain.gaps(z, position) < 10.0 * CLEAR * deep
    if not touching.any():
        return touching, np.zeros(0), float(np.linalg.norm(z))
    return touching, *nnls(chain.slopes(z, position)[touching].T, z)
