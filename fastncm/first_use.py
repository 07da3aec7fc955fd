"""The first use of a version on a machine compiles: a word to who waits, and two processes at it.

Nearly all of the time goes into a few functions that Python calls, each compiled together with all
that it calls. The largest that a scene needs is compiled in a process of its own, while this one
compiles the rest.
"""

import gc
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from fastncm.kernels import constants as c
from fastncm.kernels.basis import profiles
from fastncm.kernels.cache import is_compiled
from fastncm.kernels.problem import no_designs
from fastncm.path import reduce, rows
from fastncm.path.careful import trace_carefully
from fastncm.path.run import trace_lanes
from fastncm.path.touch import first_touches
from fastncm.path.trace import make_trace
from fastncm.scene import Scene
from fastncm.sqp.solve import Options

#: The functions that take long, as the cache names them.
LANES, SQP, DIRECT = "run._run_lanes", "careful._trace", "surface_trace.trace_surfaces"
_PACKAGE = Path(__file__).resolve().parent


def prepare(scene: Scene) -> None:
    """Compile what the scene's first solve on this machine needs."""
    if scene.jaw is None:
        announce(DIRECT)
        return
    solver = scene.solver
    entry = LANES if solver.contact == "closest" and solver.hessian == "exact" else SQP
    if not announce(entry):
        return
    other = _compile_elsewhere(entry)
    try:
        _compile_rest()
        other.wait()  # should it fail, the first solve compiles
    finally:
        other.kill()


def announce(entry: str) -> bool:
    """Say on stderr that `entry` (LANES, SQP or DIRECT) is to be compiled; whether it is."""
    if is_compiled(entry):
        return False
    print(
        "compiling the solver (first use only, about half a minute) ...",
        file=sys.stderr,
        flush=True,
    )
    return True


def compile_alone(entry: str) -> None:
    """Compile `entry` (LANES or SQP), by solving no designs."""
    gc.disable()  # it would search the millions of small objects that compiling leaves
    problem, trace = no_designs(), make_trace(0, 0, 1, 1)
    if entry == LANES:
        trace_lanes(problem, 1.0, 1.0, trace)
    else:
        trace_carefully(problem, Options(1.0, 1.0, 1, True, 1.0, 1.0, 1.0, 1.0), trace)


def _compile_elsewhere(entry: str) -> subprocess.Popen[bytes]:
    """`compile_alone` in a process of its own."""
    code = f"from {__name__} import compile_alone; compile_alone({entry!r})"
    path = os.pathsep.join([str(_PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.Popen(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _compile_rest() -> None:
    """Compile the other functions that a jaw's first solve calls from Python, with no cases."""
    profiles(np.ones(1), 2, shear=False)
    none, index = np.zeros(0), np.zeros(0, np.int64)
    jaw, target = np.zeros((0, c.JAW_COLUMNS)), np.zeros((0, c.TARGET_COLUMNS))
    first_touches(c.CIRCLE, jaw, target, none, none)
    table, summary = np.zeros((0, 1, rows.COLUMNS)), np.zeros((0, reduce.COLUMNS))
    reduce.summarise(table, 1, index, none, summary)
