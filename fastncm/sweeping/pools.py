"""Workers for the tasks of a sweep: processes, threads, or a Dask cluster, all through joblib."""

import functools
import multiprocessing
import warnings
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from joblib import Parallel, cpu_count, parallel_config

from fastncm.errors import SweepError

BACKENDS = ("loky", "threading", "dask")
SILENT_SECONDS = 900.0
"""A cluster from which nothing has come back for so long is given up."""
PATIENCE = 30.0
"""Seconds in which a cluster must answer and have a worker."""


@dataclass(frozen=True)
class Workers:
    """Where tasks are solved.

    jobs: processes or threads; with "dask" the cluster's own number counts.
    scheduler: address of a Dask scheduler; None starts a cluster on this machine.
    """

    backend: str = "loky"
    jobs: int = 1
    scheduler: str | None = None


class WorkersLost(Exception):
    """Workers died, and with them the tasks that they had in hand."""


def choose_workers(backend: str, jobs: int | None, scheduler: str | None) -> Workers:
    """Check what the user asked for. SweepError for what does not exist or does not fit."""
    if backend not in BACKENDS:
        raise SweepError(f"backend = {backend!r}: must be one of {', '.join(BACKENDS)}")
    if jobs is not None and jobs < 1:
        raise SweepError(f"jobs = {jobs}: must be at least 1")
    if scheduler is not None and backend != "dask":
        raise SweepError(f"scheduler = {scheduler!r}: only with backend 'dask'")
    if backend == "dask":
        try:
            import distributed  # noqa: F401
        except ImportError:
            raise SweepError(
                "backend 'dask' needs dask[distributed]: pip install 'fastncm[dask]'"
            ) from None
    return Workers(backend, jobs or cpu_count(), scheduler)


@contextmanager
def pool(workers: Workers) -> Iterator[tuple[Parallel, int]]:
    """joblib's pool, and how many workers it has."""
    options: dict[str, Any] = {"return_as": "generator_unordered", "batch_size": 1}
    with ExitStack() as stack:
        if workers.backend == "dask":
            client = stack.enter_context(_client(workers))
            stack.enter_context(parallel_config("dask", client=client))
            options |= {"n_jobs": -1, "timeout": SILENT_SECONDS}
            count = sum(client.ncores().values())
        else:
            options |= {"n_jobs": workers.jobs, "backend": workers.backend}
            if workers.backend == "loky":
                options["inner_max_num_threads"] = 1  # the workers fill the cores already
            count = workers.jobs
        yield stack.enter_context(Parallel(**options)), count


@contextmanager
def _client(workers: Workers) -> Iterator[Any]:
    """A client of the Dask cluster that was asked for, with a worker at least."""
    import distributed

    with ExitStack() as stack:
        address: object = workers.scheduler
        if address is None:
            own = distributed.LocalCluster(
                n_workers=workers.jobs, threads_per_worker=1, dashboard_address="127.0.0.1:0"
            )
            address = stack.enter_context(own)
        try:
            client = stack.enter_context(
                distributed.Client(address, set_as_default=False, timeout=PATIENCE)
            )
            client.wait_for_workers(1, timeout=PATIENCE)
        except (OSError, ValueError) as error:  # TimeoutError is an OSError
            raise SweepError(f"no Dask cluster with workers answers at {address}") from error
        # joblib asks for the workers before each wave, and by itself waits for ever
        client.ncores = functools.partial(
            client.sync, client.scheduler.ncores, callback_timeout=SILENT_SECONDS
        )
        yield client


def received(parallel: Parallel, calls: Iterable[object]) -> Generator[Any, None, None]:
    """The results of the calls as they come in."""
    results: Any = (nothing for nothing in range(0))
    try:
        results = parallel(calls)
        yield from results
    except BrokenProcessPool as error:
        raise WorkersLost("a worker process died (out of memory?)") from error
    except (multiprocessing.TimeoutError, TimeoutError) as error:  # joblib's, and the client's
        # to connect once more would wait for ever where the scheduler's machine is frozen
        silent = f"nothing came back from the cluster for {SILENT_SECONDS:.0f} s"
        raise SweepError(silent) from error
    finally:
        with warnings.catch_warnings():  # that tasks were cancelled is said once, by the error
            warnings.filterwarnings("ignore", r"\d+ tasks", UserWarning)
            results.close()
