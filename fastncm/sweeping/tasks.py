"""One task of a sweep: parameters in, columns out.

A task carries the scene, the parameters of its cases and nothing of the rest of the study, so that
it can be sent to any machine; what comes back are the results' columns, curves already as the
bytes of a Parquet file, because packing them takes longer than solving.
"""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from fastncm.cases import solve_chunk
from fastncm.errors import SweepError
from fastncm.kernels.cache import JIT_OFF, cache_directory
from fastncm.scene import Scene
from fastncm.scene.names import OPTION
from fastncm.sqp import status
from fastncm.sweeping.file_locks import locked, unlock
from fastncm.sweeping.identity import case_keys, solver_version
from fastncm.sweeping.parts import packed
from fastncm.sweeping.schema import curves_table, results_table

if TYPE_CHECKING:
    from fastncm.sweeping.study import Study


@dataclass(frozen=True)
class Task:
    """Some cases of a study.

    case_ids: shape (C,); columns: dotted name to the cases' values, each (C,).
    metadata: of the curves' file, None where no curves are asked for.
    """

    scene: Scene
    case_ids: np.ndarray
    columns: dict[str, np.ndarray]
    metadata: dict[str, str] | None
    solver: str


@dataclass(frozen=True)
class Finished:
    """The results of a task and what they took. curves: a Parquet file of `curves_rows` rows."""

    case_ids: np.ndarray
    results: pa.Table
    curves: pa.Buffer | None
    curves_rows: int
    failed: int
    shape_paths: int
    solves: int
    seconds: float

    @property
    def rows(self) -> int:
        return len(self.case_ids)

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return int(self.results.nbytes + (0 if self.curves is None else self.curves.size))


def make_task(study: "Study", case_ids: np.ndarray, metadata: dict[str, str]) -> Task:
    """The task for the cases `case_ids`, shape (C,)."""
    return Task(
        scene=study.scene,
        case_ids=case_ids,
        columns=study.cases.columns(case_ids),
        metadata=metadata if study.curves else None,
        solver=solver_version(),
    )


def run_task(task: Task) -> Finished:
    """Solve the cases by one call of compiled code per kind of problem."""
    started = perf_counter()
    curves = task.metadata is not None
    result = solve_chunk(task.scene, task.columns, curves=curves)
    file, curves_rows = None, 0
    if result.curves is not None:
        table = curves_table(task.scene, task.case_ids, result.curves)
        file, curves_rows = packed(table.replace_schema_metadata(task.metadata)), table.num_rows
    results = results_table(task.scene, case_keys(result.groups), result)
    return Finished(
        case_ids=task.case_ids,
        results=results,
        curves=file,
        curves_rows=curves_rows,
        failed=int((result.columns["status"] > status.NO_CONTACT).sum()),
        shape_paths=result.shape_paths,
        solves=result.solves,
        seconds=perf_counter() - started,
    )


def run_in_worker(task: Task) -> Finished:
    """`run_task` in a process, perhaps on a machine, other than the study's.

    Raises SweepError where the worker has another solver than the study.
    """
    if task.solver != solver_version():
        raise SweepError(
            f"the worker on {os.uname().nodename} has another version of fastncm: its solver is "
            f"{solver_version()}, the study's is {task.solver}"
        )
    with _one_compiles(task):
        return run_task(task)


@contextmanager
def _one_compiles(task: Task) -> Iterator[None]:
    """On each host one worker compiles while the others wait, then they load.

    A marker beside the machine code says that a task of these options was solved on this kind of
    CPU.
    """
    if JIT_OFF:
        yield
        return
    from llvmlite.binding import get_host_cpu_name

    options = repr(sorted((k, v) for k, v in task.scene.flat().items() if k in OPTION))
    kind = hashlib.sha256(f"{get_host_cpu_name()} {options}".encode()).hexdigest()[:16]
    marker = cache_directory() / f"{kind}.ready"
    if marker.exists():
        yield
        return
    with locked(cache_directory() / "compiling.lock") as lock:
        if marker.exists():
            unlock(lock)
        yield
        marker.touch()
