"""The Parquet parts of a sweep, and what each says about itself.

A part of the cases table carries in its metadata the study, what solving its rows took, and which
files of the curves table belong to it. A file of curves counts only through the part that names
it: cases and their curves appear together, with one rename. A part made by joining others names
those too, and from then on they do not count.
"""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from fastncm.sweeping.storage import Storage

TABLES = ("cases", "curves")
PART_NAME = re.compile(r"part-(\d{5,})\.parquet")
FACTS = b"part"
"""Key of the facts in a part's metadata."""
UNIQUE = ("case_id", "case_key")
"""Columns without repeated values, the second one without any order."""


@dataclass(frozen=True)
class CurvesFile:
    """A file of the curves table as the part that names it expects it."""

    name: str
    rows: int
    size: int  # bytes
    checksum: int  # CRC-32 of these bytes


@dataclass(frozen=True)
class Facts:
    """What a part of the cases table says about itself."""

    failed: int = 0  # rows that are neither converged nor without contact
    shape_paths: int = 0  # dimensionless problems solved along the path
    solves: int = 0  # contact solves
    seconds: float = 0.0  # of all workers together
    curves: tuple[CurvesFile, ...] = ()
    replaces: tuple[str, ...] = ()  # names of the parts that it holds the rows of

    def to_json(self) -> str:
        """For the metadata of a part."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: bytes) -> "Facts":
        """The facts of `to_json`. Raises ValueError, TypeError or KeyError for anything else."""
        plain = json.loads(text)
        curves = tuple(CurvesFile(**file) for file in plain.pop("curves"))
        return cls(**plain | {"curves": curves, "replaces": tuple(plain["replaces"])})


@dataclass(frozen=True)
class Part:
    """A part of the cases table."""

    name: str
    rows: int
    size: int  # bytes
    facts: Facts


def added_up(facts: Sequence[Facts]) -> Facts:
    """The facts of several parts as one."""
    return Facts(
        failed=sum(fact.failed for fact in facts),
        shape_paths=sum(fact.shape_paths for fact in facts),
        solves=sum(fact.solves for fact in facts),
        seconds=sum(fact.seconds for fact in facts),
        curves=tuple(file for fact in facts for file in fact.curves),
    )


class DamagedPart(Exception):
    """A part that is not what it should be; the message says how."""


def part_name(number: int) -> str:
    """The file name of a part."""
    return f"part-{number:05d}.parquet"


def part_sizes(storage: Storage, table: str) -> dict[str, int]:
    """The finished files of a table with their sizes, by number; temporary files are left out."""
    found = storage.sizes(table)
    names = [name for name in found if PART_NAME.fullmatch(name)]
    return {name: found[name] for name in sorted(names, key=_number)}


def next_number(storage: Storage, table: str) -> int:
    """A number that no part of the table has."""
    return max(map(_number, part_sizes(storage, table)), default=-1) + 1


def open_part(storage: Storage, table: str, name: str) -> pq.ParquetFile:
    """A part for reading. Raises OSError or pa.ArrowException where it is damaged."""
    source = storage.filesystem.open_input_file(storage.path(f"{table}/{name}"))
    try:
        return pq.ParquetFile(source, page_checksum_verification=True)
    except BaseException:
        source.close()
        raise


def packing(schema: pa.Schema) -> dict[str, Any]:
    """How a table of this schema is written (options of `pq.write_table`).

    Looking for repeated values is left to the columns that have them: among computed numbers it
    takes a third of the time. Smallest and largest value of a row group are of use only for what
    rows are chosen by: case and axes. Case numbers follow each other, so their differences are
    kept; identities cannot be made smaller.
    """
    names = [field.name for field in schema]
    repeated = [
        field.name
        for field in schema
        if field.name not in UNIQUE and ("." in field.name or not pa.types.is_floating(field.type))
    ]
    return {
        "compression": {name: "none" if name == "case_key" else "zstd" for name in names},
        "write_statistics": [name for name in names if name == "case_id" or "." in name],
        "write_page_checksum": True,
        "use_dictionary": repeated,
        "column_encoding": {"case_id": "DELTA_BINARY_PACKED"},
    }


def packed(table: pa.Table) -> pa.Buffer:
    """A table as the bytes of a Parquet file."""
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, **packing(table.schema))
    return sink.getvalue()


def inspect_part(storage: Storage, name: str, size: int) -> Part:
    """The part of the cases table with this name. DamagedPart where it, or a file of curves that it
    names, is not whole."""
    try:
        with open_part(storage, "cases", name) as file:
            rows, metadata = file.metadata.num_rows, file.schema_arrow.metadata or {}
        facts = Facts.from_json(metadata[FACTS])
    except (OSError, pa.ArrowException) as error:
        raise DamagedPart(
            f"cases/{name} is not a whole Parquet file ({_first_line(error)})"
        ) from None
    except (KeyError, TypeError, ValueError):
        raise DamagedPart(f"cases/{name} was not written by a sweep") from None
    return Part(name, int(rows), size, facts)


def check_curves(storage: Storage, part: Part, sizes: dict[str, int]) -> None:
    """DamagedPart where a file of curves that the part names is missing or not whole.

    sizes: the files of the curves table. Raises OSError.
    """
    for file in part.facts.curves:
        if file.name not in sizes:
            raise DamagedPart(f"curves/{file.name} is missing")
        if sizes[file.name] != file.size:
            raise DamagedPart(f"curves/{file.name} has {sizes[file.name]} of its {file.size} bytes")
        if storage.checksum(f"curves/{file.name}") != file.checksum:
            raise DamagedPart(f"curves/{file.name} is damaged inside")


def survey(storage: Storage) -> tuple[list[Part], list[str]]:
    """The parts of the cases table that count, by number, and sentences on those that do not."""
    parts, damage = [], []
    for name, size in part_sizes(storage, "cases").items():
        try:
            parts.append(inspect_part(storage, name, size))
        except DamagedPart as error:
            damage.append(str(error))
    replaced = {name for part in parts for name in part.facts.replaces}
    return [part for part in parts if part.name not in replaced], damage


def files_of(storage: Storage, table: str) -> Iterator[str]:
    """The names of a table's files that count. DamagedPart at the first damaged part."""
    parts, damage = survey(storage)
    if damage:
        raise DamagedPart(damage[0])
    for part in parts:
        if table == "cases":
            yield part.name
        else:
            yield from (file.name for file in part.facts.curves)


def _number(name: str) -> int:
    match = PART_NAME.fullmatch(name)
    return int(match[1]) if match else -1


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0][:120]
