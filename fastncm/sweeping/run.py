"""Running a study: finished tasks in, Parquet parts out, progress in between.

Whatever ends a run, the next one finds out what is in the table and solves the rest.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from tqdm import tqdm

from fastncm.errors import SweepError
from fastncm.first_use import prepare
from fastncm.sweeping.backends import finished_tasks
from fastncm.sweeping.folder import begin, claim, is_complete, make_folders
from fastncm.sweeping.identity import solver_version
from fastncm.sweeping.lock import sole_run
from fastncm.sweeping.manifest import Manifest, Run, read_manifest
from fastncm.sweeping.pools import Workers, WorkersLost, choose_workers
from fastncm.sweeping.read import best_designs
from fastncm.sweeping.schema import versions
from fastncm.sweeping.stock import Stock
from fastncm.sweeping.storage import Storage, reason
from fastncm.sweeping.store import Store
from fastncm.sweeping.study import Report, Study
from fastncm.sweeping.study_file import load_study


class BrokenOff(SweepError):
    """A sweep that had begun could not go on. What was finished stays readable."""


@dataclass(frozen=True)
class SweepRun:
    """What a sweep did."""

    out: Path | str  # a path; the URI where one was given
    rows: int
    failed: int  # rows that are neither converged nor without contact
    shape_paths: int  # dimensionless problems solved along the path
    solves: int  # contact solves
    seconds: float  # of all runs together
    fresh: bool  # False: the folder held the complete table already
    resumed: int  # rows that an earlier run had left
    found: tuple[str, ...]  # sentences on what an earlier run left and was not in order
    report: Report

    def best(self, n: int = 5) -> pd.DataFrame:
        """The n best designs by the study's report, best first."""
        return best_designs(Storage(self.out), self.report, n)


def sweep(
    study: str | os.PathLike[str] | Study,
    out: str | os.PathLike[str],
    jobs: int | None = None,
    *,
    backend: str = "loky",
    scheduler: str | None = None,
) -> SweepRun:
    """Solve every case of a study and write the table to `out`, a folder or a URI.

    jobs: number of processes, all cores by default. backend: "loky" (processes), "threading", or
    "dask" with the address of a scheduler (without one, a cluster of `jobs` workers is started
    here).

    A folder that holds another study, or that another run is writing to, is refused (SweepError);
    one that holds the same study complete is left as it is; where the same study broke off, what is
    missing is solved. Bad input (SceneError) is found before anything is written. Where the run
    cannot go on (BrokenOff) or is interrupted (KeyboardInterrupt), the finished parts stay
    readable.
    """
    if not isinstance(study, Study):
        study = load_study(study)
    else:
        study.check()
    workers = choose_workers(backend, jobs, scheduler)
    storage = Storage(out)
    earlier = claim(storage, study)
    if earlier is not None and is_complete(storage, study, earlier):
        return _summary(storage, study.report)
    make_folders(storage, study)
    with sole_run(storage):
        earlier = claim(storage, study)  # another run may just have ended
        if earlier is not None and is_complete(storage, study, earlier):
            return _summary(storage, study.report)
        run = Run(workers.backend, workers.jobs)
        manifest = Manifest(study.to_dict(), solver_version(), versions(), run)
        manifest.cases = study.cases.size
        if earlier is not None:
            manifest.seconds, manifest.checksums = earlier.seconds, earlier.checksums
        stock = begin(storage, study, manifest)
        prepare(study.scene)
        resumed = int(stock.done.sum())
        _run(storage, study, manifest, stock, workers)
    return _summary(storage, study.report, resumed, stock)


def _summary(
    storage: Storage, report: Report, resumed: int = 0, stock: Stock | None = None
) -> SweepRun:
    done = read_manifest(storage)
    return SweepRun(
        out=storage.given if storage.local is None else storage.local,
        rows=done.rows,
        failed=done.failed,
        shape_paths=done.shape_paths,
        solves=done.solves,
        seconds=done.seconds,
        fresh=stock is not None,
        resumed=resumed,
        found=() if stock is None else tuple(stock.found),
        report=report,
    )


def _run(
    storage: Storage, study: Study, manifest: Manifest, stock: Stock, workers: Workers
) -> None:
    store = Store(storage, study, manifest, stock)
    with (
        _progress(study, manifest) as bar,  # outermost: that it cannot be drawn spoils no table
        _kept_readable(store),
        store.renewed(),
    ):
        blocks = finished_tasks(study, workers, stock.done, manifest.run.found.append)
        with closing(blocks):  # what is still in work where the run ends is given up
            for block in blocks:
                store.add(block)
                bar.set_postfix(failed=manifest.failed, refresh=False)
                bar.update(block.rows)
        store.flush()
        store.compact()


def _progress(study: Study, manifest: Manifest) -> tqdm:
    """Cases done, failed, rate and time left, on stderr."""
    return tqdm(
        total=study.cases.size,
        initial=manifest.received,
        desc=study.name,
        unit=" cases",
        unit_scale=True,
        mininterval=0.1 if sys.stderr.isatty() else 5.0,
    )


@contextmanager
def _kept_readable(store: Store) -> Iterator[None]:
    """However the run ends, what was finished is in the table and the manifest says so."""
    where = store.storage
    try:
        yield
        store.close("complete")
    except KeyboardInterrupt:
        store.close("interrupted")
        done = store.manifest
        raise KeyboardInterrupt(f"{done.rows} of {done.cases} cases are in {where}") from None
    except BaseException as error:
        with suppress(OSError):  # the disk may be what failed
            store.close("broken off")
        kept = (
            f"{store.manifest.rows} finished cases stay readable, and the same command goes on "
            "from there"
        )
        if isinstance(error, OSError):
            raise BrokenOff(f"cannot write to {where}: {reason(error)}; {kept}") from error
        if isinstance(error, WorkersLost | SweepError):
            raise BrokenOff(f"{where}: {error}; {kept}") from error
        raise
