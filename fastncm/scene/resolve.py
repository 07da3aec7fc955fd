"""The one way from values under dotted names to complete, validated cases.

A single scene is a table of one case, so every rule is written once, over arrays.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fastncm.errors import SceneError
from fastncm.scene.columns import (
    Column,
    FloatArray,
    IntArray,
    as_column,
    option_values,
    quantity_arrays,
)
from fastncm.scene.geometry import (
    Values,
    check_friction,
    check_jaw,
    check_path,
    check_profile,
    check_return,
    move_jaw,
)
from fastncm.scene.kinds import Word
from fastncm.scene.names import (
    DIRECT,
    OPTION,
    OPTIONS,
    QUANTITIES,
    QUANTITY,
    Option,
    Quantity,
    belongs,
    check_name,
    foreign_to,
)
from fastncm.scene.refusal import refusal


@dataclass(frozen=True)
class Group:
    """Cases that share all options."""

    options: dict[str, object]  # by dotted name
    rows: IntArray  # (n,) indices of the cases
    values: Values  # by key, each (n,) or (1,); NaN where left blank


def resolve(base: Mapping[str, object], columns: Mapping[str, object]) -> list[Group]:
    """Apply columns of C cases to the base's values; without columns there is one case.

    Names that the base has but a case's shape does not use are left out; given ones are refused.
    """
    given = {}
    for name, column in columns.items():
        check_name(name)
        given[name] = as_column(name, column)
    count = _count(given)
    if count == 0:
        return []
    arrays = {
        name: quantity_arrays(QUANTITY[name], column)
        for name, column in given.items()
        if name in QUANTITY
    }
    base = _without_replaced(base, given)
    groups = []
    for options, rows in _by_options(base, given, arrays, count):
        for name in given:
            _require_owned(name, options)
        values = _values(base, arrays, options, rows, count)
        if options["jaw.shape"] != "none":
            move_jaw(values, rows)
            check_jaw(values, rows)
            check_return(values, options, rows)
        check_profile(values, options, rows)
        check_path(values, rows)
        check_friction(options, values, rows)
        groups.append(Group(options, rows, values))
    return groups


def first_case(group: Group) -> dict[str, object]:
    """The first case of a group as plain values under the dotted names that a scene stores."""
    case = dict(group.options)
    for quantity in QUANTITIES:
        if quantity.keys[0] not in group.values:
            continue
        numbers = [float(group.values[key][0]) for key in quantity.keys]
        if np.isnan(numbers[0]):
            case[quantity.name] = quantity.blank
        elif quantity.scalar and len(set(numbers)) == 1:
            case[quantity.name] = numbers[0]
        else:
            case[quantity.name] = tuple(numbers)
    return case


def _count(given: Mapping[str, Column]) -> int:
    """The number of cases C."""
    counts = {name: len(column) for name, column in given.items()}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{name} has {count}" for name, count in counts.items())
        raise SceneError(f"columns of one table must be equally long: {listed}")
    return next(iter(counts.values()), 1)


def _without_replaced(
    base: Mapping[str, object], given: Mapping[str, Column]
) -> Mapping[str, object]:
    """The base without what the given columns say in another way.

    Of a quantity and the option that may stand in its place, a new one drops the old one; both at
    once are refused. Another kind of path drops the old positions: angles are no lengths.
    """
    dropped = set()
    turned = base.get("path.kind") == "rotation"
    other = any(kind != base.get("path.kind") for kind in given.get("path.kind", ()))
    if other or (turned and any(shape != "none" for shape in given.get("jaw.shape", ()))):
        dropped |= {"path.start", "path.stop"}
    for quantity in QUANTITIES:
        if quantity.instead is None:
            continue
        if quantity.name in given and quantity.instead in given:
            raise SceneError(
                f"{quantity.name} and {quantity.instead} cannot be given together: "
                "each says what the other says",
                name=quantity.instead,
            )
        if quantity.name in given:
            dropped.add(quantity.instead)
    return {name: value for name, value in base.items() if name not in dropped}


def _by_options(
    base: Mapping[str, object],
    given: Mapping[str, Column],
    arrays: Mapping[str, list[FloatArray]],
    count: int,
) -> list[tuple[dict[str, object], IntArray]]:
    """The options (by name) of each group and the rows of its cases, in ascending order."""
    shared: dict[str, object] = {}
    choices: dict[str, list[object]] = {}
    codes: dict[str, IntArray] = {}
    for option in OPTIONS:
        if option.name in given:
            choices[option.name], codes[option.name] = option_values(option, given[option.name])
        elif base.get(option.name) is not None:
            shared[option.name] = option_values(option, [base[option.name]])[0][0]
    if "path.start" in arrays:  # to start at the first touch is a choice, too
        codes["path.start"] = np.isnan(arrays["path.start"][0]).astype(np.int64)

    group = np.zeros(count, dtype=np.int64)
    for code in codes.values():
        group = np.unique(group * (code.max() + 1) + code, return_inverse=True)[1]
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order]))
    all_rows = sorted(np.split(order, starts + 1), key=lambda rows: int(rows[0]))

    groups = []
    for rows in all_rows:
        own = {name: values[codes[name][rows[0]]] for name, values in choices.items()}
        groups.append((_complete_options(shared | own), rows))
    return groups


def _complete_options(options: dict[str, object]) -> dict[str, object]:
    """The options that the shapes use, in the order of names.py; none may be missing."""
    complete: dict[str, object] = {}
    for option in OPTIONS:
        if belongs(option, options):
            if option.name in options:
                _require_allowed(option, options)
                complete[option.name] = options[option.name]
            elif not option.optional:
                raise _missing(option)
    return complete


def _require_allowed(option: Option, options: Mapping[str, object]) -> None:
    """Refuse a word that only other scenes may choose."""

    def allowed(word: str) -> bool:
        owner = option.limited.get(word)
        return owner is None or options.get(owner[0]) in owner[1:]

    value = options[option.name]
    if isinstance(option.kind, Word) and not allowed(str(value)):
        words = " or ".join(f"'{word}'" for word in option.kind.words if allowed(word))
        reason = option.limited[str(value)][0]
        raise refusal(option.name, value, f"{words} where {reason} = '{options.get(reason)}'")


def _values(
    base: Mapping[str, object],
    arrays: Mapping[str, list[FloatArray]],
    options: Mapping[str, object],
    rows: IntArray,
    count: int,
) -> Values:
    """The quantities of a group's cases by key, moves of the jaw included, each (n,) or (1,)."""
    values: Values = {}
    for name, columns in arrays.items():
        item = QUANTITY[name]
        picked = columns if len(rows) == count else [column[rows] for column in columns]
        values.update(zip(item.keys, picked, strict=True))
    for quantity in QUANTITIES:
        if quantity.name in arrays or not belongs(quantity, options):
            continue
        value = base.get(quantity.name)
        if value is None and quantity.blank is not None:
            raise _missing(quantity)
        values.update(zip(quantity.keys, quantity_arrays(quantity, [value]), strict=True))
    return values


def _require_owned(name: str, options: Mapping[str, object]) -> None:
    """Refuse a given name that these shapes do not have."""
    unmet = foreign_to(QUANTITY.get(name) or OPTION[name], options)
    if unmet is not None:
        shape, *words = unmet
        listed = " or ".join(f"'{word}'" for word in words)
        if unmet == DIRECT:
            listed += " (the finger's own side touches)"
        raise SceneError(
            f"{name} does not belong to this scene: it is for {shape} = {listed}, "
            f"not '{options.get(shape)}'",
            name=name,
        )


def _missing(item: Quantity | Option) -> SceneError:
    """The error for a name that must be given and is not."""
    expected = item.kind.words if isinstance(item, Option) and isinstance(item.kind, Word) else ()
    choice = f" ({' or '.join(expected)})" if expected else ""
    return SceneError(f"{item.name} is missing: {item.meaning}{choice}", name=item.name)
