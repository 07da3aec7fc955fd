"""Random snap-fits: a straight or an arc-shaped jaw before a circle or a block, with the truth."""

import math
from dataclasses import dataclass

import numpy as np

from support import shooting
from support.rivals_problem import FEATURES, contradicted, geometry

SPAN = 0.010, 0.025
"""m, of the jaw."""
LEAD_ANGLE = math.radians(10.0), math.radians(45.0)
FOOT = -0.002, 0.004
"""m, height of the jaw's lower end b above the finger's axis."""
BULGE = 0.6, 4.0
"""Radius of an arc over its chord."""
CIRCLE = 0.003, 0.020
"""m, radius, on a logarithmic scale."""
UNDERCUT = 0.3, 0.95
"""Of the jaw's height: how far the target reaches down below the jaw's corner a."""
WAY = 0.05, 1.3
"""Where the path begins and ends, 0 at the first touch and 1 where the contact reaches a. Beyond 1
it is the corner a that touches."""
LENGTH = 0.057


@dataclass(frozen=True)
class RandomScene:
    """A case, the positions of its path (P,) in m and the forces there (P, 2) in N."""

    case: shooting.ShootingCase
    positions: np.ndarray
    truth: np.ndarray


def random_scenes(count: int, positions: int, seed: int) -> tuple[list[RandomScene], int]:
    """`count` scenes for which shooting finds a solution at every position, and how many had to be
    drawn again because it does not: the target would slip past b; or the top of an arc, and not its
    end a, slide along the block's underside, a pair that shooting and the rivals do not know; or
    the finger snap where the contact reaches a, so that no equilibrium goes on from there."""
    random = np.random.default_rng(seed)
    scenes: list[RandomScene] = []
    again = 0
    while len(scenes) < count:
        case, end = _draw(random)
        try:
            scenes.append(_solved(case, end, positions))
        except ValueError:
            again += 1
    return scenes, again


def _draw(random: np.random.Generator) -> tuple[shooting.ShootingCase, float]:
    """A case, and where on its way the path ends."""
    span, lead = random.uniform(*SPAN), random.uniform(*LEAD_ANGLE)
    foot, height = random.uniform(*FOOT), span * math.tan(lead)
    chord = math.hypot(span, height)
    arc = chord * random.uniform(*BULGE) if random.random() < 0.5 else None
    radius = math.exp(random.uniform(*np.log(CIRCLE))) if random.random() < 0.5 else None
    lowest = foot + height * (1.0 - random.uniform(*UNDERCUT))
    case = shooting.ShootingCase(
        a=(LENGTH, foot + height),
        b=(LENGTH + span, foot),
        path_y=lowest + (radius or 0.0),
        target_radius=radius,
        jaw_radius=arc,
    )
    return case, random.uniform(0.1, WAY[1])


def _solved(case: shooting.ShootingCase, end: float, count: int) -> RandomScene:
    """The scene; raises ValueError where there is no solution."""
    touch, passage = shooting.touch_position(case), shooting.peak_position(case)
    if not 0.0 <= shooting.touch_place(case) <= 1.0 or passage.position >= touch:
        raise ValueError("first touched beside the jaw's edge")
    if case.target_radius is None and passage.force_x >= 0.0:
        raise ValueError("the arc's top is before its end a")
    positions = touch + np.linspace(WAY[0], end, count) * (passage.position - touch)
    found = [shooting.solve(case, position) for position in positions]
    numbers = geometry(case)
    for one in found:
        pose = one.tip_pose / [case.length, case.length, 1.0]
        part = FEATURES.index(one.feature)
        if contradicted(numbers, part, one.position / case.length, pose):
            raise ValueError("a force from beside the jaw's corner")
    return RandomScene(case, positions, np.array([[one.force_x, one.force_y] for one in found]))
