"""Parquet parts: buffered, written under a temporary name, renamed when complete.

A part is therefore either whole or absent, whatever happens to the process: one truncated file
would make the folder unreadable.
"""

import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

PART_NAME = re.compile(r"part-\d{5,}\.parquet")


def part_files(folder: Path) -> list[Path]:
    """The finished parts of a table, by number; temporary files are left out."""
    if not folder.is_dir():
        return []
    names = [path for path in folder.iterdir() if PART_NAME.fullmatch(path.name)]
    return sorted(names, key=lambda path: (len(path.name), path.name))


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Call `write(temporary path)`, then give the file its name. OSErrors leave nothing behind."""
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        write(temporary)
        os.replace(temporary, path)
    finally:
        with suppress(OSError):  # a folder that refuses writing refuses this too
            temporary.unlink(missing_ok=True)


def reason(error: OSError) -> str:
    """The system's own words; Arrow wraps them in many of its own."""
    return os.strerror(error.errno) if error.errno else str(error)


class PartWriter:
    """Collects tables of one schema and writes them as `part-00000.parquet`, `part-00001...`.

    metadata: what every part says about itself, beside the units of its columns.
    """

    def __init__(self, folder: Path, metadata: Mapping[str, str]) -> None:
        self.folder = folder
        self.metadata = metadata
        self.buffered_bytes = 0
        self._buffer: list[pa.Table] = []
        self._count = 0

    def add(self, table: pa.Table) -> None:
        """Buffer the rows of `table`."""
        self._buffer.append(table)
        self.buffered_bytes += table.nbytes

    def flush(self) -> int:
        """Write what is buffered, if anything, as one part. Returns the number of rows written.

        Where writing fails (OSError), the buffered rows are dropped.
        """
        if not self._buffer:
            return 0
        table = pa.concat_tables(self._buffer).replace_schema_metadata(self.metadata)
        self._buffer, self.buffered_bytes = [], 0
        path = self.folder / f"part-{self._count:05d}.parquet"
        write_atomically(path, lambda name: pq.write_table(table, name, compression="zstd"))
        self._count += 1
        return int(table.num_rows)
