"""From a column of a table, one entry per case, to arrays of checked type and range."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fastncm.errors import SceneError
from fastncm.scene.kinds import NUMBER_TYPES, as_float, is_number
from fastncm.scene.names import NO_BLANK, Option, Quantity
from fastncm.scene.refusal import refusal

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Column = np.ndarray | list[object]


def as_column(name: str, column: object) -> Column:
    """A numeric array as it is, anything else as a list with one entry per case."""
    if hasattr(column, "__array__"):
        array = np.asarray(column)
        if array.ndim > 0:
            return array if array.dtype.kind in "iuf" else list(array.tolist())
    elif isinstance(column, Sequence) and not isinstance(column, str | bytes):
        return list(column)
    raise SceneError(f"{name}: a column needs one entry per case", name=name)


def quantity_arrays(quantity: Quantity, column: Column) -> list[FloatArray]:
    """One array (C,) for each key of the quantity, NaN where it is left blank.

    Nothing runs in Python per case where the column holds plain numbers.
    """
    blank: NDArray[np.bool_] | bool = False
    if isinstance(column, np.ndarray):
        block = column.astype(np.float64, copy=False)
    elif quantity.scalar and _all_plain_numbers(column):
        block = np.array(column, dtype=np.float64)
    else:
        block, blank = _entry_by_entry(quantity, column)

    if block.ndim == 1 and quantity.scalar:
        arrays = [block] * len(quantity.keys)
    elif block.ndim == 2 and block.shape[1] == len(quantity.keys):
        arrays = list(block.T)
    else:
        raise _refuse(quantity, column, 0)

    for array in arrays:
        allowed = quantity.allowed.contains(array) | blank
        if not allowed.all():
            raise _refuse(quantity, column, int(np.argmin(allowed)))
    return arrays


def option_values(option: Option, column: Column) -> tuple[list[object], IntArray]:
    """The distinct values of an option and, for each case, the index (C,) of its value."""
    entries = column.tolist() if isinstance(column, np.ndarray) else column
    values: list[object] = []
    known: dict[tuple[type, object], int] = {}  # by type too: True is not 1
    codes = np.empty(len(entries), dtype=np.int64)
    for case, raw in enumerate(entries):
        entry = _frozen(raw)
        key = (type(entry), entry)
        try:
            codes[case] = known[key]
        except (KeyError, TypeError):  # new, or unhashable and refused below
            try:
                value = option.kind.parse(entry)
            except ValueError as error:
                raise refusal(option.name, raw, str(error), _case(column, case)) from None
            if value not in values:
                values.append(value)
            codes[case] = known[key] = values.index(value)
    return values, codes


def _frozen(entry: object) -> object:
    """Lists and arrays as nested tuples, which can be looked up."""
    if isinstance(entry, np.ndarray):
        entry = entry.tolist()
    return tuple(map(_frozen, entry)) if isinstance(entry, list | tuple) else entry


def _all_plain_numbers(entries: list[object]) -> bool:
    """Whether all entries are numbers that fit a float64."""
    types = set(map(type, entries))
    if not all(issubclass(t, NUMBER_TYPES) and not issubclass(t, bool) for t in types):
        return False
    try:
        np.array(entries, dtype=np.float64)
    except OverflowError:
        return False
    return True


def _entry_by_entry(
    quantity: Quantity, entries: list[object]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Pairs, blanks and mixtures: the numbers (C, keys) and which entries (C,) are blank."""
    width = len(quantity.keys)
    block = np.empty((len(entries), width))
    blank = np.zeros(len(entries), dtype=np.bool_)
    for case, raw in enumerate(entries):
        entry = raw.tolist() if isinstance(raw, np.ndarray) else raw
        if _is_blank(quantity, entry):
            block[case], blank[case] = math.nan, True
        elif quantity.scalar and is_number(entry):
            block[case] = as_float(entry)
        elif (
            width > 1
            and isinstance(entry, Sequence)
            and len(entry) == width
            and all(map(is_number, entry))
        ):
            block[case] = [as_float(number) for number in entry]
        else:
            raise _refuse(quantity, entries, case)
    return block, blank


def _is_blank(quantity: Quantity, entry: object) -> bool:
    if quantity.blank is NO_BLANK:
        return False
    return isinstance(entry, type(quantity.blank)) and entry == quantity.blank


def _refuse(quantity: Quantity, column: Column, case: int) -> SceneError:
    expected = quantity.allowed.words
    if not quantity.scalar:
        limits = quantity.allowed.words.removeprefix("a finite number")
        expected = f"a pair [x, y] of finite numbers{limits}"
    elif len(quantity.keys) > 1:
        expected += ", or a pair [clamp, tip] of them"
    if isinstance(quantity.blank, str):
        expected += f", or '{quantity.blank}'"
    return refusal(quantity.name, column[case], expected, _case(column, case))


def _case(column: Column, case: int) -> int | None:
    """The number of the case for a message; None where there is only one."""
    return case if len(column) > 1 else None
