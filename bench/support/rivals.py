"""How rivals follow a path: warm starts, which part of the jaw touches, time, failures kept."""

import time
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
import pandas as pd

from support import shooting
from support.rivals_problem import CORNER, EDGE, contradicted, geometry

FAILED = np.array([np.nan, np.nan])


class Answer(NamedTuple):
    """What a rival says about one position."""

    success: bool  # in the rival's own words
    force: np.ndarray  # (2,) N, on the finger
    pose: np.ndarray  # (3,) of the tip: x/L, y/L, psi
    iterations: int
    state: object  # what the next position may start from


class Rival(Protocol):
    """A solver set up for one scene. `solve` takes the position in m and the states of the
    positions before, the last one last; none: a cold start from the undeformed finger."""

    case: shooting.ShootingCase

    def solve(self, feature: int, position: float, before: Sequence[object]) -> Answer:
        """The contact at `position` (m) of this part of the jaw."""


def follow(rival: Rival, positions: Sequence[float], cap: float = np.inf) -> pd.DataFrame:
    """One row per position: success, force_x_N, force_y_N, iterations, seconds (CPU).

    Each starts from what was solved before it. The part of the jaw is that of the position before;
    where the answer contradicts it, the other part is tried from there, and the time of both
    counts. After `cap` CPU seconds at one position a success counts as a failure.
    """
    numbers, length = geometry(rival.case), rival.case.length
    feature, before, rows = EDGE, [], []
    for position in positions:
        begin = time.process_time()
        iterations, start = 0, before
        for part in (feature, CORNER if feature == EDGE else EDGE):
            answer = rival.solve(part, position, start)
            iterations += answer.iterations
            right = not contradicted(numbers, part, position / length, answer.pose)
            if answer.success and right:
                feature = part
                break
            start = [answer.state] if answer.success else before
        seconds = time.process_time() - begin
        success = answer.success and right and seconds <= cap
        before = [*before[-2:], answer.state] if success else []
        force = answer.force if success else FAILED
        rows.append((position, success, *force, iterations, seconds))
    columns = ["position", "success", "force_x_N", "force_y_N", "iterations", "seconds"]
    return pd.DataFrame(rows, columns=columns)


def extrapolated(before: Sequence[np.ndarray], cold: np.ndarray) -> np.ndarray:
    """The parabola through the last three states, or the last one, or the cold start."""
    if not before:
        return cold
    if len(before) < 3:
        return before[-1]
    return 3.0 * (before[-1] - before[-2]) + before[-3]


def relative_errors(found: pd.DataFrame, truth: np.ndarray) -> np.ndarray:
    """Error of the force over the true force (P, 2) at each position; NaN where there is none."""
    forces = found[["force_x_N", "force_y_N"]].to_numpy(dtype=float)
    error: np.ndarray = np.hypot(*(forces - truth).T) / np.hypot(*truth.T)
    return error
