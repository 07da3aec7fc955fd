"""The closed-form formula of snap-fit design guides (Bayer, "Snap-fit joints for plastics"):

    P = 3 E I y / L^3,    W = P (mu + tan(beta)) / (1 - mu tan(beta))

P deflects the beam's end by y, W pushes the target; beta is the lead angle. y is by how far the
undeformed jaw would have to be lowered.
"""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
from support import shooting

import fastncm

THICKNESSES = (0.0022, 0.0027, 0.0032, 0.0037, 0.0042)
FRICTIONS = (0.0, 0.2, 0.4)
HEIGHTS = {
    "snapfit-circle": (0.0069, 0.0079, 0.0089, 0.0099, 0.0109),
    "snapfit-corner": (0.0059, 0.0064, 0.0069, 0.0074, 0.0079),
}
"""Around the paper's 0.0089 and 0.0069 m."""


def lead_angle(case: shooting.ShootingCase) -> float:
    """Of the jaw's chord, rad."""
    return math.atan2(case.a[1] - case.b[1], case.b[0] - case.a[0])


def overlap(case: shooting.ShootingCase, position: float) -> float:
    """y (m): by how far the undeformed jaw's edge reaches into the target at `position` (m)."""
    if case.target_radius is not None:  # a straight edge: along its normal, then downwards
        beta = lead_angle(case)
        dx, dy = position - case.a[0], case.path_y - case.a[1]
        return (case.target_radius - math.sin(beta) * dx - math.cos(beta) * dy) / math.cos(beta)
    (ax, ay), (bx, by), radius = case.a, case.b, case.jaw_radius
    assert radius is not None
    chord = math.dist(case.a, case.b)
    sense = 1.0 if case.convex else -1.0
    rise = sense * math.sqrt(radius**2 - chord**2 / 4.0)
    centre_x = (ax + bx) / 2.0 - rise * (ay - by) / chord
    centre_y = (ay + by) / 2.0 - rise * (bx - ax) / chord
    return centre_y + sense * math.sqrt(radius**2 - (position - centre_x) ** 2) - case.path_y


def pushed(case: shooting.ShootingCase, deflection: float) -> tuple[float, float]:
    """P and W in N for a deflection y (m)."""
    slope = math.tan(lead_angle(case))
    p = 3.0 * case.bending_stiffness(0.0) * deflection / case.length**3
    return p, p * (case.mu + slope) / (1.0 - case.mu * slope)


def force(case: shooting.ShootingCase, position: float) -> tuple[float, float]:
    """The force on the finger (x, y) in N while the jaw's edge touches."""
    p, w = pushed(case, overlap(case, position))
    return -w, -p


def on_edge(case: shooting.ShootingCase, positions: np.ndarray) -> np.ndarray:
    """Where it is the edge that touches, and not yet the corner behind it (P,) bool."""
    return positions >= shooting.peak_position(case).position


def peak(case: shooting.ShootingCase) -> float:
    """W in N with the jaw's corner a pressed down under the target."""
    lowest = case.path_y - (case.target_radius or 0.0)
    return pushed(case, case.a[1] - lowest)[1]


def peaks() -> pd.DataFrame:
    """Peak insertion forces over thickness, jaw height and friction: by the formula, by fastncm,
    and by shooting, where it must be the corner's passage that is the peak."""
    rows = []
    for name, heights in HEIGHTS.items():
        scene = fastncm.load_scene(name).replace({"solver.rtol": 1e-8, "path.steps": 200})
        base = shooting.SNAPFIT_CIRCLE if scene.target.radius else shooting.SNAPFIT_CORNER
        designs = [(w, h, mu) for w in THICKNESSES for h in heights for mu in FRICTIONS]
        table = pd.DataFrame(designs, columns=["finger.thickness", "jaw.height", "friction.mu"])
        solved = fastncm.solve_cases(scene, table)
        for (w, height, mu), ours in zip(designs, solved["peak_force_N"], strict=True):
            a = base.a[0], base.b[1] + height
            case = replace(base, a=a, thickness=w, mu=mu)
            truth = -shooting.peak_position(case).force_x
            rows.append((name, w, height, mu, peak(case), float(ours), truth))
    columns = ["scene", "thickness_m", "jaw_height_m", "mu", "formula_N", "fastncm_N"]
    return pd.DataFrame(rows, columns=[*columns, "shooting_N"])
