"""The work of a sweep as a stream of finished tasks.

A long sweep goes to its workers at once, first in small tasks that show how long a case takes, then
in tasks of TASK_SECONDS. Of any other the first blocks run in this process: they compile what is
not compiled yet (or load it from the cache), and show whether the rest pays for starting workers.
"""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass

import numpy as np
from joblib import delayed

from fastncm.cases import scale_only_names
from fastncm.sweeping.plan import MAX_ROWS, Plan
from fastncm.sweeping.pools import Workers, WorkersLost, pool, received
from fastncm.sweeping.processes import collect, exchange, run_in_process
from fastncm.sweeping.schema import metadata
from fastncm.sweeping.study import Study
from fastncm.sweeping.tasks import Finished, Task, make_task, run_in_worker, run_task

TASK_SECONDS = 0.5
"""Length of a task. One takes the parent 2 ms with loky and 8 ms with Dask."""
FED_WORKERS = 16
"""More workers than this get longer tasks in proportion, or the parent could not feed them."""
FIRST_TASK_ROWS = 64
"""Cases in a worker's first tasks, of which nobody knows how long they take."""
FIRST_ROWS = 4
MEASURED_SECONDS = 0.05
"""The first blocks grow until one takes this long: shorter ones cannot be measured."""
WORKER_START_SECONDS = 1.5
"""Time in which a worker process starts, imports its packages and loads the compiled code."""
LEAST_SECONDS = 0.2e-6
"""No contact solve is quicker than this: where even so a sweep is long, nothing is measured."""
CURVE_ROWS = 250_000
"""Rows of curves in a task at most: 45 MB, and 30 MB packed."""
HELD_BYTES = 256 * 2**20
"""Results that workers may have ready before the parent has written them."""
LAST_TASKS = 4
"""Towards the end tasks shrink to this fraction of a worker's share, so that all end together."""
PATIENT_LOSSES = 3
"""Workers may be lost so often, one time after the other, without a task coming back."""


@dataclass
class Pace:
    """How long cases take: sums over the tasks so far, each counting half of the one after it."""

    seconds: float = 0.0
    rows: float = 0.0
    nbytes: float = 0.0

    def note(self, finished: Finished) -> None:
        """Take another task into account."""
        self.seconds = self.seconds / 2 + finished.seconds
        self.rows = self.rows / 2 + finished.rows
        self.nbytes = self.nbytes / 2 + finished.nbytes

    @property
    def seconds_per_row(self) -> float:
        return self.seconds / self.rows

    @property
    def rows_in_task(self) -> int:
        """Cases that take about TASK_SECONDS; few where no task has come back yet."""
        if not self.rows:
            return FIRST_TASK_ROWS
        return max(1, round(TASK_SECONDS / self.seconds_per_row))

    @property
    def bytes_in_task(self) -> float:
        """Size of the results of a task, an upper estimate; 0 where none has come back yet."""
        return self.nbytes / self.rows * self.rows_in_task if self.rows else 0.0


def finished_tasks(
    study: Study, workers: Workers, done: np.ndarray, notice: Callable[[str], object]
) -> Generator[Finished, None, None]:
    """All cases that are not `done`, shape (size,), each exactly once, in any order.

    The caller marks in `done` what it gets. Where workers die, `notice` is told, and what they had
    in hand is solved by others; WorkersLost where that happens again and again.
    """

    def missing() -> Plan:
        return Plan(study.cases, scale_only_names(study.scene), _max_rows(study), done)

    plan, pace, losses = missing(), Pace(), 0
    if _alone(workers) or not _is_long(study, plan):
        yield from _first_blocks(study, plan, pace)
    while plan.rows_left:
        try:
            for finished in _at_pace(study, workers, plan, pace):
                losses = 0
                pace.note(finished)
                yield finished
        except WorkersLost as loss:
            losses += 1
            if losses > PATIENT_LOSSES:
                raise
            notice(f"{loss}; the cases it had in hand were solved again")
            plan = missing()


def _at_pace(study: Study, workers: Workers, plan: Plan, pace: Pace) -> Iterator[Finished]:
    """What is left of the plan, in tasks of TASK_SECONDS, by workers where that pays."""
    about = metadata(study)
    starting = WORKER_START_SECONDS if workers.backend == "loky" else 0.0
    if _alone(workers) or (pace.rows and plan.rows_left * pace.seconds_per_row <= starting):
        while (block := plan.take(pace.rows_in_task)) is not None:
            yield run_task(make_task(study, block, about))
        return
    with pool(workers) as (parallel, count), exchange() as folder:
        tasks = (make_task(study, block, about) for block in _shrinking(plan, pace, count))
        while plan.rows_left:
            some = _wave(tasks, pace, 4 * count)
            if workers.backend == "loky":
                calls = (delayed(run_in_process)(task, folder) for task in some)
                yield from map(collect, received(parallel, calls))
            else:
                yield from received(parallel, (delayed(run_in_worker)(task) for task in some))


def _wave(tasks: Iterator[Task], pace: Pace, least: int) -> Iterator[Task]:
    """Tasks for some time: joblib, given all, lets results pile up where the parent is slower."""
    for sent, task in enumerate(tasks, start=1):
        yield task
        if sent >= least and sent * pace.bytes_in_task >= HELD_BYTES:
            return


def _alone(workers: Workers) -> bool:
    """Whether this process does all the work."""
    return workers.backend != "dask" and workers.jobs == 1


def _is_long(study: Study, plan: Plan) -> bool:
    """Whether workers pay for their start however quick the cases are."""
    return plan.problems_left * _positions(study) * LEAST_SECONDS > WORKER_START_SECONDS


def _first_blocks(study: Study, plan: Plan, pace: Pace) -> Iterator[Finished]:
    """Growing blocks in this process until two can be measured.

    Two, because a block may meet a kind of problem for which the code is not compiled yet.
    """
    about = metadata(study)
    block = plan.take(1)
    if block is None:
        return
    yield run_task(make_task(study, block, about))  # not measured: it loads the compiled code
    rows, measured = FIRST_ROWS, 0
    while measured < 2 and (block := plan.take(rows)) is not None:
        finished = run_task(make_task(study, block, about))
        pace.note(finished)
        yield finished
        if finished.seconds >= MEASURED_SECONDS or rows >= plan.max_rows:
            measured += 1
        else:
            rows *= 4


def _shrinking(plan: Plan, pace: Pace, count: int) -> Iterator[np.ndarray]:
    """What is left of the plan, in tasks for `count` workers, smaller ones at the end."""
    while True:
        rows = round(pace.rows_in_task * max(1.0, count / FED_WORKERS))
        fair = plan.rows_left // (LAST_TASKS * count)
        block = plan.take(min(rows, max(fair, rows // 8, 1)))
        if block is None:
            return
        yield block


def _max_rows(study: Study) -> int:
    """Cases in one task at most."""
    if not study.curves:
        return MAX_ROWS
    return max(1, CURVE_ROWS // _positions(study))


def _positions(study: Study) -> int:
    """Positions on the longest of the study's paths in."""
    return int(max(study.cases.axes.get("path.steps", [study.scene.path.steps])))
