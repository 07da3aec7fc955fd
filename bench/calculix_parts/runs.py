"""Running CalculiX in a temporary folder and reading its forces back."""

import os
import re
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .deck import Increments, deck
from .model import SLICE, Model

PROGRAM = "ccx"
STRAYED = 0.1
"""A force that leaves the range of its neighbours along the path by more than this part of itself
belongs to another equilibrium, which a large increment has thrown the finger into."""


@dataclass(frozen=True)
class Run:
    """What CalculiX has found for a path."""

    forces: np.ndarray
    """(positions, 2) N on the finger; NaN where it did not get to."""
    seconds: float
    """CPU time of the program, on one thread."""
    wall: float
    """Time by the clock, s."""
    increments: int
    iterations: int
    attempts: int
    message: str
    """Its last words where it has given up, else empty."""


def available() -> bool:
    """Is there a CalculiX on the PATH?"""
    return shutil.which(PROGRAM) is not None


def version() -> str:
    """Of CalculiX."""
    said = subprocess.run([PROGRAM, "-v"], capture_output=True, text=True, check=False).stdout
    return said.strip().rpartition(" ")[2]


def run(model: Model, mu: float, increments: Increments, limit: float) -> Run:
    """Solve the model's path, in at most `limit` seconds by the clock; where CalculiX gives up or
    strays, once more with half the increments. The cost is that of both attempts."""
    first = _attempt(model, mu, increments, limit)
    if not first.message:
        return first
    half = Increments(0.5 * increments.first, 0.5 * increments.largest)
    second = _attempt(model, mu, half, limit)
    return replace(
        second,
        seconds=first.seconds + second.seconds,
        wall=first.wall + second.wall,
        increments=first.increments + second.increments,
        iterations=first.iterations + second.iterations,
        attempts=2,
    )


def _attempt(model: Model, mu: float, increments: Increments, limit: float) -> Run:
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "job.inp").write_text(deck(model, mu, increments))
        before, begin, message = os.times(), time.perf_counter(), ""
        with (folder / "log").open("w") as log:
            try:
                subprocess.run(
                    [PROGRAM, "job"],
                    cwd=folder,
                    env=environment,
                    stdout=log,
                    stderr=log,
                    timeout=limit,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                message = f"not done after {limit:g} s"
        wall, after = time.perf_counter() - begin, os.times()
        said = (folder / "log").read_text(errors="replace")
        found = totals(folder / "job.dat")
    forces = np.full((len(model.times), 2), np.nan)
    forces[: len(found)] = -found * model.width / SLICE
    message = message or strayed(forces) or " ".join(re.findall(r"\*ERROR:? *(.*)", said)[-1:])
    if len(found) < len(forces):
        message = message or "stopped without a word"
    return Run(
        forces=forces,
        seconds=after.children_user + after.children_system
        - before.children_user - before.children_system,
        wall=wall,
        increments=len(re.findall(r"^ increment \d+ attempt 1 *$", said, re.MULTILINE)),
        iterations=len(re.findall(r"^ iteration \d+ *$", said, re.MULTILINE)),
        attempts=1,
        message=message,
    )  # fmt: skip


def strayed(forces: np.ndarray) -> str:
    """What to say where a force (positions, 2) is on another branch than its neighbours."""
    before, here, after = forces[:-2], forces[1:-1], forces[2:]
    low, high = np.minimum(before, after), np.maximum(before, after)
    off = np.maximum(low - here, here - high).max(axis=1)
    places = np.flatnonzero(off > STRAYED * np.hypot(*here.T)) + 1
    return f"on another branch at position {places[0]}" if len(places) else ""


def totals(file: Path) -> np.ndarray:
    """Total reaction at the clamp at the model's times (times, 2), N, from CalculiX's .dat file."""
    lines = file.read_text().splitlines() if file.exists() else []
    rows = [
        [float(cell) for cell in lines[number + 2].split()[:2]]
        for number, line in enumerate(lines[:-2])
        if line.strip().startswith("total force")
    ]
    return np.array(rows).reshape(-1, 2)
