"""What an earlier run left in a folder: which cases are done, and what has to be cleared away.

A part counts if it is whole (its footer, its pages' checksums, its files of curves), if each of its
rows is the case that the study and this solver mean by the row's `case_id`, and if no other part
has the row already. Anything else is removed and its cases are solved again.
"""

from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa

from fastncm.sweeping.parts import (
    TABLES,
    DamagedPart,
    Part,
    check_curves,
    inspect_part,
    open_part,
    part_sizes,
)
from fastncm.sweeping.storage import TEMPORARY, Storage
from fastncm.sweeping.study import Study


@dataclass
class Stock:
    """The finished part of a sweep, and what is not in order.

    done: shape (size,), whether a case is in a part; found: sentences on what is not in order;
    useless: files to be removed.
    """

    done: np.ndarray
    parts: list[Part] = field(default_factory=list)
    found: list[str] = field(default_factory=list)
    useless: list[str] = field(default_factory=list)


def take_stock(storage: Storage, study: Study) -> Stock:
    """Find what is done and what is not in order; touches nothing. Raises OSError."""
    stock = Stock(done=np.zeros(study.cases.size, dtype=bool))
    half_written = [
        f"{table}/{name}"
        for table in TABLES
        for name in storage.sizes(table)
        if name.startswith(".") and name.endswith(TEMPORARY)
    ]
    if half_written:
        stock.found.append(f"removed {len(half_written)} half-written files")
    _count_parts(storage, study, stock)
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


def _count_parts(storage: Storage, study: Study, stock: Stock) -> None:
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
            ids = _own_cases(storage, study, part)
            if stock.done[ids].any():
                raise DamagedPart(f"cases/{part.name} repeats cases of another part")
        except DamagedPart as damage:
            _discard(part.name, damage, stock)
        else:
            stock.done[ids] = True
            stock.parts.append(part)


def _own_cases(storage: Storage, study: Study, part: Part) -> np.ndarray:
    """The case ids of a part. DamagedPart where its rows are not those of the study."""
    try:
        with open_part(storage, "cases", part.name) as file:
            table = file.read()  # all columns, for the checksums of their pages
    except (OSError, pa.ArrowException):
        raise DamagedPart(f"cases/{part.name} is damaged inside") from None
    foreign = DamagedPart(f"cases/{part.name} holds rows of another study or solver")
    if not {"case_id", "case_key"} <= set(table.column_names):
        raise foreign
    ids, keys = (table[name].to_numpy() for name in ("case_id", "case_key"))
    if len(ids) and (ids.min() < 0 or ids.max() >= study.cases.size):
        raise foreign
    if (np.diff(np.sort(ids)) == 0).any():
        raise DamagedPart(f"cases/{part.name} repeats its own cases")
    if not np.array_equal(study.keys(ids), keys):
        raise foreign
    return np.asarray(ids)


def _discard(name: str, damage: DamagedPart, stock: Stock) -> None:
    stock.useless.append(f"cases/{name}")
    stock.found.append(f"{damage}: removed, its cases are solved again")
