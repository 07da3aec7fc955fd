"""Shooting by SciPy's `solve_ivp` and `root` as a rival in direct contact, with friction or not.

`tests/shooting_surface.py` at several tolerances of the integration, from position to position. It
is told that there is one interval of contact, which slides, and where it is at the first position.
"""

import time
from collections.abc import Sequence

import numpy as np
import pandas as pd

from fastncm.scene import Scene
from support import shooting_surface


def follow(
    scene: Scene,
    finger: shooting_surface.Finger,
    positions: Sequence[float],
    start: np.ndarray,
    local: float,
) -> pd.DataFrame:
    """One row per position (rad): success, force_x_N, force_y_N, iterations, seconds (CPU).

    start: (5,) unknowns near the first position's; the others start from the parabola through the
    last three, or from the last one.
    """
    rows, before = [], [start]
    for position in positions:
        pose = scene.pose(position)
        centre = np.array([pose.target_x, pose.target_y])
        guess = before[-1]
        if len(before) > 3:
            guess = 3.0 * (before[-1] - before[-2]) + before[-3]
        begin = time.process_time()
        try:
            touch = shooting_surface.solve(finger, position, centre, guess, local)
            success, force = True, touch.force
            before.append(touch.unknowns)
        except ValueError:
            success, force, before = False, np.full(2, np.nan), before[-1:]
        rows.append((success, *force, 0, time.process_time() - begin))
    columns = ["success", "force_x_N", "force_y_N", "iterations", "seconds"]
    return pd.DataFrame(rows, columns=columns)
