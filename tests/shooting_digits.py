"""The equilibria of `shooting_many` in arithmetic of 34 digits, to judge the judge.

The same equations (there), for one finger at a time: Gragg's method with extrapolation (Bulirsch
and Stoer) in mpmath's arithmetic, and Newton's method with the Jacobian in double precision, which
gains some six digits in a step.
"""

from typing import Any

import mpmath
import numpy as np
import shooting_many
from shooting_many import Array, Claim, Fingers

DIGITS = 34
GUARD = 8
"""Digits more in the arithmetic."""
COLUMNS = 16
"""Of the extrapolation, whose substeps are 2, 4, ..., 2 COLUMNS."""
LOCAL = 1e-30
"""Error of a step."""
CLOSED = 1e-28
NEWTON_STEPS = 12

Number = Any
"""mpmath has no type hints."""


def normal_force(fingers: Fingers, claim: Claim, mu: float) -> Number | None:
    """The normal force (EI(0)/L^2) of one finger's equilibrium next to the claimed one, sliding
    with friction of 0 or +-mu; None where Newton's method does not close."""
    mp = mpmath.MPContext()
    mp.dps = DIGITS + GUARD
    jaw, target, q = shooting_many.features(fingers, claim)
    normal = shooting_many.turned(shooting_many.place_of(fingers, jaw, q)[1], claim.pose[:, 2])
    pressing = -np.einsum("ij,ij->i", claim.force, normal)
    lean = np.sign(normal[:, 0] * claim.force[:, 1] - normal[:, 1] * claim.force[:, 0]) * mu
    start = np.column_stack([pressing, q])
    inverse = np.linalg.inv(_slope(fingers, jaw, target, lean, start))
    unknowns = mp.matrix(start[0].tolist())
    finger = Finger(mp, fingers, int(jaw[0]), int(target[0]), float(lean[0]))
    large = 1.0 + float(fingers.radius[0]) + float(np.abs(fingers.at).max())
    for _ in range(NEWTON_STEPS):
        missed = finger.miss(unknowns)
        if max(abs(one) for one in missed) < CLOSED * large:
            return unknowns[0]
        unknowns -= mp.matrix(inverse.tolist()) * mp.matrix(missed)
    return None


def _slope(fingers: Fingers, jaw: Array, target: Array, lean: Array, at: Array) -> Array:
    """The Jacobian (2, 2) by central differences."""
    found = np.empty((2, 2))
    for k in range(2):
        step = np.zeros((1, 2))
        step[0, k] = shooting_many.DIFFERENCE * (abs(at[0, 0]) if k == 0 else 1.0)
        ahead, behind = (
            shooting_many.miss(fingers, jaw, target, lean, at + way * step)[0][0]
            for way in (1.0, -1.0)
        )
        found[:, k] = (ahead - behind) / (2.0 * step[0, k])
    return found


class Finger:
    """One finger in the arithmetic of `mp`, with the pair of features that touch."""

    def __init__(self, mp: Number, f: Fingers, jaw: int, target: int, lean: float) -> None:
        self.mp, self.jaw, self.target, self.lean = mp, jaw, target, mp.mpf(lean)
        exact = mp.mpf
        self.a, self.b, self.at = ([exact(x) for x in one[0].tolist()] for one in (f.a, f.b, f.at))
        self.half, self.back, self.radius, self.length = (
            exact(float(one[0])) for one in (f.half, f.back, f.radius, f.length)
        )
        self.shear = exact(float(f.shear[0])) if np.isfinite(f.shear[0]) else None
        self.grows = mp.log(exact(float(f.ratio[0])))
        self.pace = self.grows / mp.expm1(self.grows) if self.grows else exact(1)

    def turned(self, vector: list[Number], angle: Number) -> list[Number]:
        cos, sin = self.mp.cos(angle), self.mp.sin(angle)
        return [cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1]]

    def place(self, q: Number) -> tuple[list[Number], list[Number]]:
        """The jaw's place and outward normal in the tip's frame."""
        mp, a, b = self.mp, self.a, self.b
        if self.jaw in (shooting_many.CORNER_A, shooting_many.CORNER_B):
            return (a if self.jaw == shooting_many.CORNER_A else b), [mp.cos(q), mp.sin(q)]
        if self.jaw == shooting_many.RETURN:
            down = [-mp.cos(self.back), -mp.sin(self.back)]
            return [a[0] + q * down[0], a[1] + q * down[1]], [down[1], -down[0]]
        chord = [b[0] - a[0], b[1] - a[1]]
        size = mp.hypot(*chord)
        left = [-chord[1] / size, chord[0] / size]
        if not self.half:
            return [a[0] + q * chord[0], a[1] + q * chord[1]], left
        rho = size / 2 / mp.sin(self.half)
        normal = self.turned(left, self.half * (1 - 2 * q))
        return [
            (a[i] + b[i]) / 2 - rho * mp.cos(self.half) * left[i] + rho * normal[i] for i in (0, 1)
        ], normal

    def miss(self, unknowns: Number) -> list[Number]:
        """By how much jaw and target miss each other."""
        point, normal = self.place(unknowns[1])
        push = [
            unknowns[0] * (-normal[0] - self.lean * normal[1]),
            unknowns[0] * (-normal[1] + self.lean * normal[0]),
        ]
        clamp = self.integrated(point, push)
        psi = -clamp[2]
        tip = self.turned([-clamp[0], -clamp[1]], psi)
        contact, outward = self.turned(point, psi), self.turned(normal, psi)
        middle = [tip[i] + contact[i] + self.radius * outward[i] - self.at[i] for i in (0, 1)]
        on_return = self.jaw == shooting_many.RETURN and not self.radius
        if on_return or self.target == shooting_many.FAR:
            middle[0] -= self.length
        if self.target == shooting_many.UNDERSIDE:
            return [middle[1], outward[0]]
        if self.target == shooting_many.FACE:
            return [middle[0], outward[1]]
        if self.target == shooting_many.BACK:
            return [middle[0] - self.length, outward[1]]
        return middle

    def integrated(self, arm: list[Number], force: list[Number]) -> list[Number]:
        """The clamp's x, y, psi seen from the tip section."""
        mp = self.mp
        z, step, state = mp.mpf(1), mp.mpf(-0.125), [mp.mpf(0)] * 3
        while z > 0:
            step = -min(-step, z)
            new, error = self.step(z, step, state, arm, force)
            if error < LOCAL:
                z, state = z + step, new
                step *= 2 if error < 1e-6 * LOCAL else 1
            else:
                step /= 2
        return state

    def step(
        self, z: Number, step: Number, state: list[Number], arm: list[Number], force: list[Number]
    ) -> tuple[list[Number], Number]:
        """The extrapolated state after a step, and its error."""
        rows: list[list[list[Number]]] = []
        for j in range(1, COLUMNS + 1):
            row = [self.midpoint(z, step, 2 * j, state, arm, force)]
            for m in range(1, j):
                factor = (self.mp.mpf(j) / (j - m)) ** 2 - 1
                row.append([a + (a - b) / factor for a, b in zip(row[-1], rows[-1][m - 1],
                                                                 strict=True)])  # fmt: skip
            rows.append(row)
        best, other = rows[-1][-1], rows[-1][-2]
        scaled = (abs(a - b) / (1 + abs(a)) for a, b in zip(best, other, strict=True))
        return best, max(scaled)

    def midpoint(
        self, z: Number, step: Number, count: int, state: list[Number], arm: list[Number],
        force: list[Number],
    ) -> list[Number]:  # fmt: skip
        """Gragg's method with `count` substeps."""
        h = step / count
        before = state
        rate = self.slope(z, before, arm, force)
        now = [a + h * b for a, b in zip(before, rate, strict=True)]
        for i in range(1, count):
            rate = self.slope(z + i * h, now, arm, force)
            before, now = now, [a + 2 * h * b for a, b in zip(before, rate, strict=True)]
        rate = self.slope(z + step, now, arm, force)
        return [(a + b + h * c) / 2 for a, b, c in zip(before, now, rate, strict=True)]

    def slope(
        self, z: Number, state: list[Number], arm: list[Number], force: list[Number]
    ) -> list[Number]:
        """As `shooting_many._slope`."""
        mp, w = self.mp, self.mp.exp(self.grows * z)
        x, y, psi = state
        moment = (arm[0] - x) * force[1] - (arm[1] - y) * force[0]
        theta, change = psi, mp.mpf(1)
        while self.shear is not None and abs(change) > mp.mpf(10) ** (-DIGITS):
            cos, sin = mp.cos(theta), mp.sin(theta)
            along, across = force[0] * cos + force[1] * sin, force[1] * cos - force[0] * sin
            stiffness = self.shear * w
            change = (theta - psi - across / stiffness) / (1 + along / stiffness)
            theta -= change
        pace = self.pace * w
        return [pace * mp.cos(theta), pace * mp.sin(theta), self.pace * moment / w**2]
