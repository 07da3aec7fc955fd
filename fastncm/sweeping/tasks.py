"""The work of a sweep as a stream of finished blocks, in this process or on all cores.

The first blocks run in this process: they compile what is not compiled yet (or load it from the
cache) and show how long a case takes. The rest is cut into tasks of TASK_SECONDS, and goes to
worker processes only where that pays for starting them.
"""

from collections.abc import Generator
from dataclasses import dataclass
from itertools import islice
from signal import SIG_IGN, SIGINT, signal
from time import perf_counter

import numpy as np
import pyarrow as pa
from joblib import Parallel, delayed

from fastncm.cases import scale_only_names, solve_chunk
from fastncm.sweeping.plan import MAX_ROWS, Plan
from fastncm.sweeping.read import failed_rows
from fastncm.sweeping.schema import cases_table, curves_table
from fastncm.sweeping.study import Study

TASK_SECONDS = 0.5
"""Length of a task. Dispatching one costs about a millisecond."""
FIRST_ROWS = 64
MEASURED_SECONDS = 0.05
"""The first blocks grow until one takes this long: shorter ones cannot be measured."""
WORKER_START_SECONDS = 2.0
"""Time in which a worker starts and imports its packages (measured: 1.5 to 2 s)."""
CURVE_ROWS = 250_000
"""Rows of curves in a task at most: 45 MB."""
HELD_BYTES = 512 * 2**20
"""Results that workers may have ready before the parent has written them."""


@dataclass(frozen=True)
class Finished:
    """The rows of one block and what they took."""

    cases: pa.Table
    curves: pa.Table | None
    failed: int
    shape_paths: int
    solves: int
    seconds: float

    @property
    def rows(self) -> int:
        return int(self.cases.num_rows)

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return int(self.cases.nbytes + (0 if self.curves is None else self.curves.nbytes))


def run_block(study: Study, case_ids: np.ndarray) -> Finished:
    """Solve the cases `case_ids`, shape (C,), by one call of compiled code per kind of problem."""
    started = perf_counter()
    result = solve_chunk(study.scene, study.grid.columns(case_ids), curves=study.curves)
    return Finished(
        cases=cases_table(study, case_ids, result.cases),
        curves=None if result.curves is None else curves_table(study, case_ids, result.curves),
        failed=failed_rows(result.cases["status"]),
        shape_paths=result.shape_paths,
        solves=result.solves,
        seconds=perf_counter() - started,
    )


def finished_blocks(study: Study, jobs: int) -> Generator[Finished, None, None]:
    """All blocks of the study, each exactly once, in any order."""
    plan = Plan(study.grid, scale_only_names(study.scene), _max_rows(study))
    measured = yield from _first_blocks(study, plan)
    seconds_per_row = measured.seconds / measured.rows
    rows = max(1, round(TASK_SECONDS / seconds_per_row))
    if jobs > 1 and plan.rows_left * seconds_per_row > WORKER_START_SECONDS:
        bytes_in_task = measured.nbytes / measured.rows * min(rows, plan.max_rows)
        yield from _in_workers(study, plan, rows, jobs, wave=int(HELD_BYTES / bytes_in_task))
    else:
        for block in plan.blocks(rows):
            yield run_block(study, plan.case_ids(block))


def _first_blocks(study: Study, plan: Plan) -> Generator[Finished, None, Finished]:
    """Growing blocks in this process until two can be measured. Returns the last one, too.

    Two, because a block may meet a kind of problem for which the code is not compiled yet.
    """
    done = run_block(study, plan.case_ids(next(plan.blocks(1))))
    yield done  # not to be measured: it has loaded the compiled code
    rows, measured = FIRST_ROWS, 0
    while measured < 2 and (block := plan.take(rows)) is not None:
        done = run_block(study, plan.case_ids(block))
        yield done
        if done.seconds >= MEASURED_SECONDS or rows >= plan.max_rows:
            measured += 1
        else:
            rows *= 4
    return done


def _in_workers(
    study: Study, plan: Plan, rows: int, jobs: int, wave: int
) -> Generator[Finished, None, None]:
    """The rest of the plan on `jobs` processes, in blocks of about `rows` cases.

    joblib lets results pile up without bound where the parent is the slower one (it may be, with
    curves to write), so it is given a wave of `wave` tasks at a time.
    """
    with Parallel(
        n_jobs=jobs,
        backend="loky",
        return_as="generator_unordered",
        batch_size=1,
        inner_max_num_threads=1,  # the workers fill the cores already
    ) as parallel:
        while blocks := list(islice(plan.blocks(rows), max(2 * jobs, wave))):
            yield from parallel(
                delayed(_run_in_worker)(study, plan.case_ids(block)) for block in blocks
            )


def _run_in_worker(study: Study, case_ids: np.ndarray) -> Finished:
    """Ctrl-C reaches the workers as well: only the parent answers it, by ending them."""
    signal(SIGINT, SIG_IGN)
    return run_block(study, case_ids)


def _max_rows(study: Study) -> int:
    """Cases in one task at most."""
    if not study.curves:
        return MAX_ROWS
    steps = max(study.grid.axes.get("path.steps", [study.scene.path.steps]))
    return max(1, CURVE_ROWS // int(steps))
