"""Running a study: blocks in, Parquet parts out, progress in between."""

import os
import sys
import time
import warnings
from collections.abc import Generator, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from joblib import cpu_count
from tqdm import tqdm

from fastncm.errors import SweepError
from fastncm.kernels.cache import is_cold
from fastncm.sweeping.folder import Manifest, begin, claim, read_manifest, write_manifest
from fastncm.sweeping.parts import PartWriter, reason
from fastncm.sweeping.read import best_designs
from fastncm.sweeping.schema import metadata, versions
from fastncm.sweeping.study import Report, Study
from fastncm.sweeping.study_file import load_study
from fastncm.sweeping.tasks import Finished, finished_blocks

PART_BYTES = 64 * 2**20
"""Size of the buffers in memory at which parts are written."""
PART_SECONDS = 30.0
"""Finished rows wait no longer than this for being written."""


class BrokenOff(SweepError):
    """A sweep that had begun could not go on. What was finished stays readable."""


@dataclass(frozen=True)
class SweepRun:
    """What a sweep did."""

    out: Path
    rows: int
    failed: int  # rows that are neither converged nor without contact
    shape_paths: int  # dimensionless problems solved along the path
    solves: int  # contact solves
    seconds: float
    fresh: bool  # False: the folder held the complete table already
    report: Report

    def best(self, n: int = 5) -> pd.DataFrame:
        """The n best designs by the study's report, best first."""
        return best_designs(self.out, self.report, n)


def sweep(
    study: str | os.PathLike[str] | Study, out: str | os.PathLike[str], jobs: int | None = None
) -> SweepRun:
    """Solve every case of a study and write the table to the folder `out`.

    jobs: number of processes, all cores by default. A folder that holds another study is refused
    (SweepError); one that holds the same study complete is left as it is; one where the same study
    broke off is started over. Bad input (SceneError) is found before anything is written. Where the
    run cannot go on (BrokenOff) or is interrupted (KeyboardInterrupt), the finished parts stay
    readable.
    """
    if not isinstance(study, Study):
        study = load_study(study)
    else:
        study.check()
    if jobs is not None and jobs < 1:
        raise SweepError(f"jobs = {jobs}: must be at least 1")
    out = Path(out)
    earlier = claim(out, study)
    if earlier is None or earlier.state != "complete":
        _run(study, out, jobs or cpu_count())
    return _summary(out, study.report, fresh=earlier is None or earlier.state != "complete")


def _summary(out: Path, report: Report, fresh: bool) -> SweepRun:
    done = read_manifest(out)
    return SweepRun(
        out=out,
        rows=done.rows,
        failed=done.failed,
        shape_paths=done.shape_paths,
        solves=done.solves,
        seconds=done.seconds,
        fresh=fresh,
        report=report,
    )


def _run(study: Study, out: Path, jobs: int) -> None:
    manifest = Manifest(study.to_dict(), versions(), cases=study.grid.size)
    begin(out, manifest)
    store = _Store(study, out, manifest)
    with (
        _progress(study) as bar,  # outermost: that its line cannot be drawn spoils no table
        _kept_readable(store),
        _ended(finished_blocks(study, jobs)) as blocks,
    ):
        for block in blocks:
            store.add(block)
            bar.set_description(study.name, refresh=False)
            bar.set_postfix(failed=manifest.failed, refresh=False)
            bar.update(block.rows)


@contextmanager
def _ended(blocks: Generator[Finished, None, None]) -> Iterator[Iterator[Finished]]:
    """The blocks; what is still in work when they are left is given up."""
    try:
        yield blocks
    finally:
        with warnings.catch_warnings():  # that tasks were cancelled is said once, by the error
            warnings.filterwarnings("ignore", r"\d+ tasks which were still", UserWarning)
            blocks.close()


def _progress(study: Study) -> tqdm:
    """Cases done, failed, rate and time left, on stderr."""
    return tqdm(
        total=study.grid.size,
        desc="compiling (first use only)" if is_cold() else study.name,
        unit=" cases",
        unit_scale=True,
        mininterval=0.1 if sys.stderr.isatty() else 5.0,
    )


class _Store:
    """Writes finished blocks to both tables and keeps count in the manifest."""

    def __init__(self, study: Study, out: Path, manifest: Manifest) -> None:
        self.out = out
        self.manifest = manifest
        self._cases = PartWriter(out / "cases", metadata(study))
        self._curves = PartWriter(out / "curves", metadata(study))
        self._started = self._last = time.monotonic()

    def add(self, block: Finished) -> None:
        """Buffer a block; write a part of each table when the buffers are full or old."""
        if block.curves is not None:
            self._curves.add(block.curves)
        self._cases.add(block.cases)
        self.manifest.failed += block.failed
        self.manifest.shape_paths += block.shape_paths
        self.manifest.solves += block.solves
        full = self._cases.buffered_bytes + self._curves.buffered_bytes >= PART_BYTES
        if full or time.monotonic() - self._last >= PART_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Write what is buffered: curves first, so that a case in the table has its curve."""
        self._curves.flush()
        self.manifest.rows += self._cases.flush()
        self._last = time.monotonic()

    def close(self, state: str) -> None:
        """Write the rest and the manifest."""
        self.flush()
        self.manifest.state = state
        self.manifest.seconds = time.monotonic() - self._started
        write_manifest(self.out, self.manifest)


@contextmanager
def _kept_readable(store: _Store) -> Iterator[None]:
    """However the run ends, what was finished is in the table and the manifest says so."""
    try:
        yield
        store.close("complete")
    except KeyboardInterrupt:
        store.close("interrupted")
        done = store.manifest
        raise KeyboardInterrupt(f"{done.rows} of {done.cases} cases are in {store.out}") from None
    except BaseException as error:
        with suppress(OSError):  # the disk may be what failed
            store.close("broken off")
        kept = f"{store.manifest.rows} finished cases stay readable"
        if isinstance(error, OSError):
            raise BrokenOff(f"cannot write to {store.out}: {reason(error)}; {kept}") from error
        if isinstance(error, BrokenProcessPool):
            raise BrokenOff(
                f"{store.out}: a worker process died (out of memory?); {kept}"
            ) from error
        raise
