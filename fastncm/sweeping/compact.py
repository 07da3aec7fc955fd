"""Joining the parts of a sweep that are smaller than they should be.

New files of curves first, then the part that names them and the parts it replaces: with its rename
the old ones no longer count, and what is left of them is removed. A run that ends in between leaves
nothing that `take_stock` does not clear away.
"""

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TypeVar

import pyarrow as pa
import pyarrow.parquet as pq

from fastncm.errors import SweepError
from fastncm.sweeping.lock import sole_run
from fastncm.sweeping.manifest import read_manifest
from fastncm.sweeping.parts import (
    FACTS,
    TABLES,
    CurvesFile,
    Part,
    added_up,
    next_number,
    open_part,
    packing,
    part_name,
    part_sizes,
    survey,
)
from fastncm.sweeping.storage import Storage, reason

SMALL_BYTES = 4 * 2**20
"""Files smaller than this are joined ..."""
FILE_BYTES = 64 * 2**20
"""... to files of about this size."""

Item = TypeVar("Item", Part, CurvesFile)


def compact(storage: Storage) -> list[str]:
    """Join the small files of a sweep that nobody works on; the new parts of the cases table.
    Raises OSError."""
    parts, _ = survey(storage)
    new = []
    for group in _small(parts):
        files = added_up([part.facts for part in group]).curves
        curves = [some for some in _small(files) if len(some) > 1]
        if len(group) > 1 or curves:
            new.append(_join(storage, group, curves))
    return new


def compact_folder(out: str | os.PathLike[str]) -> tuple[int, int]:
    """`compact` for the folder of a run that has ended; the numbers of files before and after.

    SweepError where there is no sweep, where a run is at work, and where a part is damaged.
    """
    storage = Storage(out)
    read_manifest(storage)
    with sole_run(storage):
        _, damage = survey(storage)
        if damage:
            raise SweepError(f"{out}: {damage[0]}; the same sweep, run again, puts it right")
        before = _number_of_files(storage)
        try:
            compact(storage)
        except OSError as error:
            raise SweepError(f"cannot write to {out}: {reason(error)}") from error
        except pa.ArrowException as error:
            raise SweepError(f"{out}: {error}; the same sweep, run again, puts it right") from error
        return before, _number_of_files(storage)


def _number_of_files(storage: Storage) -> int:
    return sum(len(part_sizes(storage, table)) for table in TABLES)


def _join(storage: Storage, parts: list[Part], curves: list[list[CurvesFile]]) -> str:
    """Replace parts by one part, whose name is returned, and each list of their files of curves by
    one file."""
    facts = added_up([part.facts for part in parts])
    gone = {file.name for files in curves for file in files}
    kept = tuple(file for file in facts.curves if file.name not in gone)
    joined = kept + tuple(_join_curves(storage, files) for files in curves)
    named = tuple(part.name for part in parts)
    new = replace(facts, curves=joined, replaces=named)
    name = part_name(next_number(storage, "cases"))
    _concatenate(storage, "cases", list(named), name, {FACTS: new.to_json().encode()})
    for part in parts:
        storage.delete(f"cases/{part.name}")
    for curve in sorted(gone):
        storage.delete(f"curves/{curve}")
    return name


def _join_curves(storage: Storage, files: list[CurvesFile]) -> CurvesFile:
    name = part_name(next_number(storage, "curves"))
    _concatenate(storage, "curves", [file.name for file in files], name, {})
    size = storage.sizes("curves")[name]
    rows = sum(file.rows for file in files)
    return CurvesFile(name, rows, size, storage.checksum(f"curves/{name}"))


def _concatenate(
    storage: Storage, table: str, names: list[str], new: str, metadata: dict[bytes, bytes]
) -> None:
    """Write the rows of some files of a table as one file, a row group at a time."""
    schemas = []
    for name in names:
        with open_part(storage, table, name) as file:
            schemas.append(file.schema_arrow)
    schema = pa.unify_schemas(schemas, promote_options="permissive")
    schema = schema.with_metadata((schemas[0].metadata or {}) | metadata)

    def write(stream: pa.NativeFile) -> None:
        with pq.ParquetWriter(stream, schema, **packing(schema)) as writer:
            for rows in _row_groups(storage, table, names):
                writer.write_table(_with_columns(rows, schema))

    storage.write(f"{table}/{new}", write)


def _row_groups(storage: Storage, table: str, names: list[str]) -> Iterator[pa.Table]:
    """The rows of the files; small ones together, so that row groups are of a sensible size."""
    held: list[pa.Table] = []
    held_bytes = 0
    for name in names:
        with open_part(storage, table, name) as file:
            for group in range(file.num_row_groups):
                held.append(file.read_row_group(group))
                held_bytes += held[-1].nbytes
                if held_bytes >= FILE_BYTES:
                    yield pa.concat_tables(held, promote_options="permissive")
                    held, held_bytes = [], 0
    if held:
        yield pa.concat_tables(held, promote_options="permissive")


def _with_columns(rows: pa.Table, schema: pa.Schema) -> pa.Table:
    """The same rows with all columns of the schema, empty where they have none."""
    columns = [
        rows[field.name].cast(field.type)
        if field.name in rows.column_names
        else pa.nulls(len(rows), field.type)
        for field in schema
    ]
    return pa.table(columns, schema=schema)


def _small(items: Iterable[Item]) -> Iterator[list[Item]]:
    """The small ones, in groups that make a file of about FILE_BYTES together."""
    group: list[Item] = []
    total = 0
    for item in items:
        if item.size >= SMALL_BYTES:
            continue
        if total + item.size > FILE_BYTES:
            yield group
            group, total = [], 0
        group.append(item)
        total += item.size
    if group:
        yield group
