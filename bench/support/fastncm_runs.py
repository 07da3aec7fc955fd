"""fastncm at given positions of random snap-fits: one scene at a time, or side by side."""

import time
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
import pandas as pd

import fastncm
from fastncm.columns import curve_columns
from fastncm.lowering import Lowered, Scale, lower
from fastncm.scene import Scene, tabulate
from fastncm.trace import Solved, solve_paths
from support import rivals, shooting
from support.random_scenes import RandomScene

ROUNDS = 3
"""Of a timing; the fastest counts."""


def scene_of(case: shooting.ShootingCase, rtol: float) -> Scene:
    """The scene of a case without friction."""
    values: dict[str, dict[str, object]] = {
        "finger": {name: getattr(case, name) for name in ("length", "thickness", "width", "young")},
        "jaw": {"shape": "segment", "a": case.a, "b": case.b},
        "target": {"shape": "block"},
        "path": {"y": case.path_y, "stop": 0.0},
        "solver": {"rtol": rtol},
    }
    if case.jaw_radius is not None:
        values["jaw"] |= {"shape": "arc", "radius": case.jaw_radius, "convex": case.convex}
    if case.target_radius is not None:
        values["target"] = {"shape": "circle", "radius": case.target_radius}
    return fastncm.Scene.from_dict({"name": "random", **values})


class FastNcm:
    """One scene, set up; called with positions it gives a row for each."""

    def __init__(self, case: shooting.ShootingCase, rtol: float) -> None:
        self.case = case
        self.lowered = lower(tabulate(scene_of(case, rtol), {})[0])

    def __call__(self, positions: Sequence[float]) -> pd.DataFrame:
        """success, force_x_N, force_y_N, CPU seconds at the positions (m), in this order."""
        lowered = _at(self.lowered, np.asarray(positions)[None, :] / self.case.length)
        begin = time.process_time()
        solved = list(solve_paths(lowered))
        seconds = time.process_time() - begin
        return _rows(lowered, solved)[0].assign(seconds=seconds / len(positions))


def _rows(lowered: Lowered, parts: Sequence[Solved]) -> list[pd.DataFrame]:
    """success, force_x_N, force_y_N over the positions, for each design."""
    found: dict[int, pd.DataFrame] = {}
    for solved in parts:
        here = np.arange(len(solved.designs))
        columns = curve_columns(solved.trace.rows, lowered, solved.designs, here)
        shape = (len(here), lowered.positions.shape[1])
        status, x, y = (
            np.asarray(columns[name]).reshape(shape)
            for name in ("status", "force_x_N", "force_y_N")
        )
        for i, design in enumerate(solved.designs):
            rows = {"success": status[i] == "converged", "force_x_N": x[i], "force_y_N": y[i]}
            found[int(design)] = pd.DataFrame(rows)
    return [found[i] for i in sorted(found)]


def _at(lowered: Lowered, positions: np.ndarray) -> Lowered:
    """The same problems at positions (D, P) in finger lengths."""
    return replace(lowered, positions=positions, turn=positions.shape[1] - 1)


def solve_together(scenes: Sequence[RandomScene], rtols: Sequence[float]) -> pd.DataFrame:
    """All scenes in as few calls as there are kinds of targets, for each tolerance, cold at the
    last position and warm along the path: scene, start, step (the tolerance), converged, error,
    seconds (each scene's share of its call)."""
    rows = []
    for block in (False, True):
        kind = [i for i, s in enumerate(scenes) if (s.case.target_radius is None) == block]
        for rtol in rtols if kind else ():
            lowered = [lower(tabulate(scene_of(scenes[i].case, rtol), {})[0]) for i in kind]
            for start, chosen in (("cold", slice(-1, None)), ("warm", slice(None))):
                positions = [scenes[i].positions[chosen] / scenes[i].case.length for i in kind]
                joint = _at(_joined(lowered), np.array(positions))
                seconds = np.inf
                for _ in range(ROUNDS):
                    begin = time.process_time()
                    solved = list(solve_paths(joint))
                    seconds = min(seconds, time.process_time() - begin)
                for i, found in zip(kind, _rows(joint, solved), strict=True):
                    good = bool(found["success"].all())
                    error = rivals.relative_errors(found, scenes[i].truth[chosen]).max()
                    share = seconds / len(kind)
                    rows.append((i, start, rtol, good, error if good else np.inf, share))
    columns = ["scene", "start", "step", "converged", "error", "seconds"]
    return pd.DataFrame(rows, columns=columns)


def _joined(parts: Sequence[Lowered]) -> Lowered:
    """Problems of one kind of target as one table."""
    arrays = {
        item.name: np.concatenate([getattr(part, item.name) for part in parts])
        for item in fields(Lowered)
        if isinstance(getattr(parts[0], item.name), np.ndarray)
    }
    scales = {
        item.name: np.concatenate([getattr(part.scale, item.name) for part in parts])
        for item in fields(Scale)
    }
    arrays["problem_of"] = np.arange(len(parts), dtype=np.int64)
    return replace(parts[0], **arrays, scale=Scale(**scales))
