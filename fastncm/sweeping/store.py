"""Writing finished tasks: curves at once, cases buffered, both made good by one rename."""

import threading
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

import pyarrow as pa

from fastncm.sweeping.compact import compact
from fastncm.sweeping.manifest import Manifest, write_manifest
from fastncm.sweeping.parts import (
    FACTS,
    CurvesFile,
    Facts,
    added_up,
    next_number,
    packed,
    part_name,
    part_sizes,
)
from fastncm.sweeping.schema import cases_table, metadata
from fastncm.sweeping.stock import Stock
from fastncm.sweeping.storage import Storage
from fastncm.sweeping.study import Study
from fastncm.sweeping.tasks import Finished

PART_BYTES = 64 * 2**20
"""Size of the buffer in memory at which a part is written."""
PART_SECONDS = 30.0
"""Finished rows wait no longer than this for being written."""
RENEWAL_SECONDS = 2.0
"""How often the manifest is renewed."""


class Store:
    """Writes finished tasks to both tables and keeps count in the manifest.

    A part of the cases table is written when the buffer is full or old. The files of curves that
    belong to its rows are written before; until the part is there they do not count.
    """

    def __init__(self, storage: Storage, study: Study, manifest: Manifest, stock: Stock) -> None:
        self.storage = storage
        self.study = study
        self.manifest = manifest
        self.done = stock.done
        self._metadata = metadata(study)
        self._held: list[tuple[pa.Table, Facts]] = []
        self._bytes = 0
        self._next = next_number(storage, "cases")
        self._next_curves = next_number(storage, "curves")
        self._lock = threading.Lock()
        manifest.checksums = stock.checksums
        facts = added_up([part.facts for part in stock.parts])
        manifest.rows = manifest.received = int(stock.done.sum())
        manifest.failed, manifest.shape_paths = facts.failed, facts.shape_paths
        manifest.solves = facts.solves
        self._before, self._started = manifest.seconds, time.monotonic()
        self._written = self._started

    def add(self, finished: Finished) -> None:
        """Take a task's rows; write a part when the buffer is full or old. Raises OSError."""
        facts = Facts(finished.failed, finished.shape_paths, finished.solves, finished.seconds)
        if finished.curves is not None:
            facts = replace(
                facts, curves=(self._write_curves(finished.curves, finished.curves_rows),)
            )
        table = cases_table(self.study, finished.case_ids, finished.results)
        self._held.append((table, facts))  # both or, where Ctrl-C comes in between, neither
        self._bytes += table.nbytes
        self.done[finished.case_ids] = True
        self.manifest.received += finished.rows
        if self._bytes >= PART_BYTES or time.monotonic() - self._written >= PART_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Write what is buffered, if anything, as one part.

        Where writing fails (OSError), the buffered rows are dropped.
        """
        self._written = time.monotonic()
        held, self._held, self._bytes = self._held, [], 0
        if not held:
            return
        table = pa.concat_tables([rows for rows, _ in held], promote_options="permissive")
        facts = added_up([facts for _, facts in held])
        name = part_name(self._next)
        self._next += 1  # first: no name is used twice
        checksum = write_cases(self.storage, name, table, self._metadata, facts)
        # a new dictionary, since the thread that renews the manifest may be reading the old one
        self.manifest.checksums = self.manifest.checksums | {name: checksum}
        self.manifest.rows += table.num_rows
        self.manifest.failed += facts.failed
        self.manifest.shape_paths += facts.shape_paths
        self.manifest.solves += facts.solves

    def compact(self) -> None:
        """Join the small parts. Raises OSError."""
        new = {name: self.storage.checksum(f"cases/{name}") for name in compact(self.storage)}
        known = self.manifest.checksums | new
        self.manifest.checksums = {name: known[name] for name in part_sizes(self.storage, "cases")}

    def close(self, state: str) -> None:
        """Write the rest and the manifest. Raises OSError."""
        try:
            self.flush()
        finally:
            self.manifest.state = state
            self.renew()

    def renew(self) -> None:
        """Write the manifest. Raises OSError."""
        with self._lock:
            self.manifest.seconds = self._before + time.monotonic() - self._started
            write_manifest(self.storage, self.manifest)

    @contextmanager
    def renewed(self) -> Iterator[None]:
        """Renew the manifest from time to time, also while nothing comes back."""
        stop = threading.Event()

        def renew() -> None:
            while not stop.wait(RENEWAL_SECONDS):
                with suppress(OSError):  # a part that cannot be written will say so
                    self.renew()

        thread = threading.Thread(target=renew, daemon=True, name="manifest")
        thread.start()
        try:
            yield
        finally:
            stop.set()
            thread.join()

    def _write_curves(self, packed: pa.Buffer, rows: int) -> CurvesFile:
        name = part_name(self._next_curves)
        self._next_curves += 1
        self.storage.write(f"curves/{name}", lambda stream: stream.write(packed))
        return CurvesFile(name, rows, packed.size, zlib.crc32(packed))


def write_cases(
    storage: Storage, name: str, table: pa.Table, metadata: dict[str, str], facts: Facts
) -> int:
    """Write a part of the cases table; its CRC-32. Raises OSError."""
    file = packed(table.replace_schema_metadata(metadata | {FACTS.decode(): facts.to_json()}))
    storage.write(f"cases/{name}", lambda stream: stream.write(file))
    return zlib.crc32(file)
