"""The values of one axis: a list, ends and a number of values, or the range that is sampled."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fastncm.errors import SceneError
from fastncm.scene import check_name
from fastncm.scene.kinds import is_number
from fastncm.scene.names import QUANTITY
from fastncm.scene.refusal import refusal

SPACES: dict[str, Callable[..., np.ndarray]] = {"linspace": np.linspace, "geomspace": np.geomspace}
RANGES = ("uniform", "loguniform")
EXPECTED = "a list, {linspace = [low, high, number]} or {geomspace = [low, high, number]}"
EXPECTED_SAMPLED = "a list, {uniform = [low, high]} or {loguniform = [low, high]}"

MOST_VALUES = 10**8
"""Values of one axis: 0.8 GB."""

Axis = Sequence[object] | np.ndarray | Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class Range:
    """The values between two ends, all equally likely (or all orders of magnitude)."""

    low: float
    high: float
    logarithmic: bool

    def at(self, fractions: np.ndarray) -> np.ndarray:
        """The values below which these fractions (0 to 1) of the range lie, same shape."""
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** fractions)
        return np.asarray(self.low + (self.high - self.low) * fractions)


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


def sampled_axis(name: str, axis: Axis) -> Range | np.ndarray:
    """The range of a sampled axis, or the values, shape (n,), that are equally likely.

    SceneError as for `axis_values`.
    """
    if not isinstance(axis, Mapping) or axis.keys() & SPACES.keys():
        return axis_values(name, axis)
    try:
        check_name(name)
        kind, (low, high) = _numbers(name, axis, RANGES, 2, EXPECTED_SAMPLED)
        if not high > low or (kind == "loguniform" and not low > 0):
            ends = "0 < low < high" if kind == "loguniform" else "low < high"
            raise refusal(name, dict(axis), f"{{{kind} = [low, high]}} with {ends}")
    except SceneError as error:
        raise SceneError(str(error), name=f"axes.{name}") from None
    return Range(float(low), float(high), kind == "loguniform")


def plain_axis(axis: Axis) -> object:
    """The axis as JSON can hold it, as short as it was given."""
    if isinstance(axis, Mapping):
        return {kind: list(numbers) for kind, numbers in axis.items()}
    return axis.tolist() if isinstance(axis, np.ndarray) else list(axis)


def _spaced(name: str, axis: Mapping[str, Sequence[float]]) -> np.ndarray:
    """Written out from {linspace = [low, high, number]} or {geomspace = ...}."""
    if axis.keys() & set(RANGES):
        raise refusal(name, dict(axis), f"{EXPECTED}; a range is for a [design] that is drawn")
    kind, (low, high, count) = _numbers(name, axis, SPACES, 3, EXPECTED)
    if int(count) != count or not 0 <= count <= MOST_VALUES:
        expected = f"{{{kind} = [low, high, number]}} with a whole number from 1 to {MOST_VALUES}"
        raise refusal(name, dict(axis), expected)
    if kind == "geomspace" and not low * high > 0:
        raise refusal(name, dict(axis), "between ends of one sign, none of them 0")
    return SPACES[kind](low, high, int(count))


def _numbers(
    name: str, axis: Mapping[str, Sequence[float]], kinds: Iterable[str], count: int, expected: str
) -> tuple[str, Sequence[float]]:
    """Kind and numbers of an axis that is a table of one entry with `count` finite numbers."""
    if len(axis) != 1 or not axis.keys() <= set(kinds):
        raise refusal(name, dict(axis), expected)
    ((kind, numbers),) = axis.items()
    if (
        not isinstance(numbers, Sequence)
        or len(numbers) != count
        or not all(is_number(number) and np.isfinite(number) for number in numbers)
    ):
        raise refusal(name, dict(axis), expected)
    return kind, numbers


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
