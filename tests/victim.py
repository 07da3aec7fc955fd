"""Sweeps to be killed: a process that has loaded everything forks one for every line on stdin.

A line is JSON: {"out": folder, "doom": operations on the file system after which it kills itself,
or null}. The answer is the child's process id and, after another line, how it ended.
"""

import json
import os
import signal
import sys

import numpy as np

import fastncm
from fastncm.sweeping import Study, plan, store, sweep
from fastncm.sweeping.storage import Storage

CASES = 96
WRITES = ("create_dir", "open_output_stream", "move", "delete_file")


def study() -> Study:
    """Cases with curves, half of them alike."""
    scene = fastncm.load_scene("snapfit-circle").replace({"path.steps": 12})
    heights = np.linspace(0.0069, 0.0109, CASES // 2)
    return Study(scene, {"jaw.height": heights, "finger.thickness": [0.0022, 0.0042]}, curves=True)


def cut_small(rows: int, renewal: float) -> None:
    """Many small tasks, and a part for each."""
    take = plan.Plan.take
    plan.Plan.take = lambda self, _: take(self, rows)
    store.PART_BYTES = 1
    store.RENEWAL_SECONDS = renewal


class Doomed:
    """A file system that ends the process after some operations."""

    def __init__(self, filesystem, life: int) -> None:
        self.filesystem, self.life = filesystem, life

    def __getattr__(self, name: str):
        method = getattr(self.filesystem, name)
        if name not in WRITES:
            return method

        def counted(*arguments, **options):
            result = method(*arguments, **options)
            self.life -= 1
            if self.life == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            return result

        return counted


def doom(life: int) -> None:
    """Let this process live for some operations."""
    initialise = Storage.__init__

    def doomed(self, out):
        initialise(self, out)
        self.filesystem = Doomed(self.filesystem, life)

    Storage.__init__ = doomed


def run(out: str, life: int | None) -> None:
    """One sweep."""
    cut_small(rows=48 if life else 8, renewal=1000.0 if life else 0.005)
    if life:
        doom(life)
    sweep(study(), out, jobs=1)


def serve() -> None:
    """Fork a sweep for every line."""
    sys.stderr = open(os.devnull, "w")
    fastncm.solve(study().scene)
    one = Study(study().scene, {"jaw.height": [0.0089]}, curves=True)
    fastncm.cases.solve_chunk(one.scene, one.cases.columns(np.array([0])), curves=True)
    print("ready", flush=True)
    for line in sys.stdin:
        order = json.loads(line)
        child = os.fork()
        if child == 0:
            try:
                run(order["out"], order["doom"])
                os._exit(0)
            except BaseException as error:
                print(repr(error), file=sys.__stderr__, flush=True)
                os._exit(1)
        print(child, flush=True)
        sys.stdin.readline()  # until it is waited for, its process id is its own
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    serve()
