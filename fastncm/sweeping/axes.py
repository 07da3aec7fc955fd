"""The values of one axis: a list, or ends and a number of values."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fastncm.errors import SceneError
from fastncm.scene import check_name
from fastncm.scene.kinds import is_number
from fastncm.scene.names import QUANTITY
from fastncm.scene.refusal import refusal

SPACES: dict[str, Callable[..., np.ndarray]] = {"linspace": np.linspace, "geomspace": np.geomspace}
EXPECTED = "a list, {linspace = [low, high, number]} or {geomspace = [low, high, number]}"

Axis = Sequence[object] | np.ndarray | Mapping[str, Sequence[float]]


def axis_values(name: str, axis: Axis) -> np.ndarray:
    """The values of the axis over a dotted name, shape (n,).

    float64 for quantities; objects for words, switches and pairs. SceneError (naming
    `axes.<name>`) for an unknown name and an empty or malformed axis.
    """
    try:
        check_name(name)
        values = _spaced(name, axis) if isinstance(axis, Mapping) else _listed(name, axis)
    except SceneError as error:
        raise SceneError(str(error), name=f"axes.{name}") from None
    if len(values) == 0:
        raise SceneError(f"{name}: the axis is empty, it needs a value", name=f"axes.{name}")
    return values


def plain_axis(axis: Axis) -> object:
    """The axis as JSON can hold it, as short as it was given."""
    if isinstance(axis, Mapping):
        return {kind: list(numbers) for kind, numbers in axis.items()}
    return axis.tolist() if isinstance(axis, np.ndarray) else list(axis)


def _spaced(name: str, axis: Mapping[str, Sequence[float]]) -> np.ndarray:
    """Written out from {linspace = [low, high, number]} or {geomspace = ...}."""
    if len(axis) != 1 or not axis.keys() <= SPACES.keys():
        raise refusal(name, dict(axis), EXPECTED)
    ((kind, numbers),) = axis.items()
    if (
        not isinstance(numbers, Sequence)
        or len(numbers) != 3
        or not all(is_number(number) and np.isfinite(number) for number in numbers)
        or int(numbers[2]) != numbers[2]
        or numbers[2] < 0
    ):
        raise refusal(name, dict(axis), f"{{{kind} = [low, high, number of values]}}")
    low, high, count = numbers
    if kind == "geomspace" and not low * high > 0:
        raise refusal(name, dict(axis), "between ends of one sign, none of them 0")
    return SPACES[kind](low, high, int(count))


def _listed(name: str, axis: object) -> np.ndarray:
    """The values of a list; what is no number at all is left to the check of the cases."""
    entries = axis.tolist() if isinstance(axis, np.ndarray) else axis
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        raise refusal(name, axis, EXPECTED)
    if all(is_number(entry) for entry in entries):
        try:
            return np.array(entries, dtype=np.float64 if name in QUANTITY else None)
        except OverflowError:  # an integer too large for a float
            pass
    values = np.empty(len(entries), dtype=object)
    values[:] = [tuple(entry) if isinstance(entry, list) else entry for entry in entries]
    return values
