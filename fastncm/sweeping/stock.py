"""What an earlier run left in a folder: which cases are done, and what has to be cleared away.

A part counts if it is byte for byte what this study's runs have written, as the manifest's checksum
of it says; or, where the manifest does not know it, if its footer and its pages are whole and each
row is the case that the study and this solver mean by the row's `case_id`. Its files of curves must
be whole, and no other part may have a row of it already. Anything else is removed and its cases are
solved again.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from fastncm.sweeping.parts import (
    TABLES,
    UNIQUE,
    DamagedPart,
    Part,
    check_curves,
    inspect_part,
    part_sizes,
)
from fastncm.sweeping.storage import TEMPORARY, Storage
from fastncm.sweeping.study import Study

SPREAD = 16
"""Numbers of cases are marked, not sorted, where they lie in so many times their count."""


@dataclass
class Stock:
    """The finished part of a sweep, and what is not in order.

    done: shape (size,), whether a case is in a part; found: sentences on what is not in order;
    useless: files to be removed; checksums: CRC-32 of the parts, as far as they are known.
    """

    done: np.ndarray
    parts: list[Part] = field(default_factory=list)
    found: list[str] = field(default_factory=list)
    useless: list[str] = field(default_factory=list)
    checksums: dict[str, int] = field(default_factory=dict)


def take_stock(storage: Storage, study: Study, checksums: Mapping[str, int]) -> Stock:
    """Find what is done and what is not in order; touches nothing. Raises OSError.

    checksums: CRC-32 of parts as they were written.
    """
    stock = Stock(done=np.zeros(study.cases.size, dtype=bool))
    half_written = [
        f"{table}/{name}"
        for table in TABLES
        for name in storage.sizes(table)
        if name.startswith(".") and name.endswith(TEMPORARY)
    ]
    if half_written:
        stock.found.append(f"removed {len(half_written)} half-written files")
    _count_parts(storage, study, stock, checksums)
    named = {file.name for part in stock.parts for file in part.facts.curves}
    orphans = [f"curves/{name}" for name in part_sizes(storage, "curves") if name not in named]
    if orphans:
        stock.found.append(f"removed {len(orphans)} files of curves whose cases are not in a part")
    stock.useless += half_written + orphans
    return stock


def clear_away(storage: Storage, stock: Stock) -> None:
    """Remove what is useless. Raises OSError."""
    for name in stock.useless:
        storage.delete(name)


def _count_parts(
    storage: Storage, study: Study, stock: Stock, checksums: Mapping[str, int]
) -> None:
    """Fill `stock` with the parts of the cases table that are in order, and with the others."""
    whole: list[Part] = []
    for name, size in part_sizes(storage, "cases").items():
        try:
            whole.append(inspect_part(storage, name, size))
        except DamagedPart as damage:
            _discard(name, damage, stock)
    replaced = {name for part in whole for name in part.facts.replaces}
    if any(part.name in replaced for part in whole):
        stock.found.append("finished joining parts")
    curves = part_sizes(storage, "curves")
    for part in whole:
        if part.name in replaced:
            stock.useless.append(f"cases/{part.name}")
            continue
        try:
            check_curves(storage, part, curves)
            file = storage.read(f"cases/{part.name}")
            checksum = zlib.crc32(file)
            ids = _own_cases(file, study, part, checksum == checksums.get(part.name))
            if stock.done[ids].any():
                raise DamagedPart(f"cases/{part.name} repeats cases of another part")
        except DamagedPart as damage:
            _discard(part.name, damage, stock)
        else:
            stock.done[ids] = True
            stock.parts.append(part)
            stock.checksums[part.name] = checksum


def _own_cases(file: bytes, study: Study, part: Part, as_written: bool) -> np.ndarray:
    """The case ids of a part. DamagedPart where its rows are not those of the study.

    as_written: the file is, byte for byte, what a run of this study and solver wrote: its pages are
    in order, and its rows the study's.
    """
    try:
        with pq.ParquetFile(pa.BufferReader(file), page_checksum_verification=True) as part_file:
            table = part_file.read(UNIQUE if as_written else None)
    except (OSError, pa.ArrowException):
        raise DamagedPart(f"cases/{part.name} is damaged inside") from None
    foreign = DamagedPart(f"cases/{part.name} holds rows of another study or solver")
    if not set(UNIQUE) <= set(table.column_names):
        raise foreign
    ids, keys = (table[name].to_numpy() for name in UNIQUE)
    if len(ids) and (ids.min() < 0 or ids.max() >= study.cases.size):
        raise foreign
    if _repeats(ids):
        raise DamagedPart(f"cases/{part.name} repeats its own cases")
    if not as_written and not np.array_equal(study.keys(ids), keys):
        raise foreign
    return np.asarray(ids)


def _repeats(ids: np.ndarray) -> bool:
    """Whether a number is there twice."""
    if len(ids) < 2 or (np.diff(ids) > 0).all():
        return False
    first, last = int(ids.min()), int(ids.max())
    if last - first > SPREAD * len(ids):
        return bool((np.diff(np.sort(ids)) == 0).any())
    seen = np.zeros(last - first + 1, dtype=bool)  # where it is not too large, quicker than sorting
    seen[ids - first] = True
    return int(seen.sum()) < len(ids)


def _discard(name: str, damage: DamagedPart, stock: Stock) -> None:
    stock.useless.append(f"cases/{name}")
    stock.found.append(f"{damage}: removed, its cases are solved again")
