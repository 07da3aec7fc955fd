"""What a value may be: intervals of numbers, words, switches, whole numbers.

Each kind knows its own sentence for an error message. `parse` returns the value in its plain
Python type, or raises ValueError carrying that sentence.
"""

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

NUMBER_TYPES = (int, float, np.integer, np.floating)


def is_number(value: object) -> TypeGuard[float]:
    """Whether `value` is a real number; True and False are none."""
    return isinstance(value, NUMBER_TYPES) and not isinstance(value, bool)


def as_float(number: float) -> float:
    """The number as a float; infinite where it is an integer too large for one."""
    try:
        return float(number)
    except OverflowError:
        return math.inf


@dataclass(frozen=True)
class Interval:
    """Finite numbers from `low` to `high`; `open_low`, `open_high` exclude an end."""

    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    open_high: bool = False

    def contains(self, x: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which entries of `x` are allowed, same shape as `x`."""
        above = x > self.low if self.open_low else x >= self.low
        below = x < self.high if self.open_high else x <= self.high
        return above & below & np.isfinite(x)

    @property
    def words(self) -> str:
        """For "must be ..."."""
        ends = []
        if math.isfinite(self.low):
            ends.append(f"{'greater than' if self.open_low else 'at least'} {self.low:g}")
        if math.isfinite(self.high):
            ends.append(f"{'less than' if self.open_high else 'at most'} {self.high:g}")
        return "a finite number" + (" " + " and ".join(ends) if ends else "")


FINITE = Interval()
POSITIVE = Interval(low=0.0, open_low=True)
NOT_NEGATIVE = Interval(low=0.0)


@dataclass(frozen=True)
class Word:
    """One of a few words; `later` holds words that are known but not available yet, and why."""

    words: tuple[str, ...]
    later: Mapping[str, str] = field(default_factory=dict)

    def parse(self, value: object) -> str:
        """The word, or ValueError."""
        if isinstance(value, str) and value in self.words:
            return str(value)
        expected = " or ".join(f"'{word}'" for word in self.words)
        if isinstance(value, str) and value in self.later:
            expected += f"; {self.later[value]}"
        raise ValueError(expected)


@dataclass(frozen=True)
class Switch:
    """true or false."""

    def parse(self, value: object) -> bool:
        """The switch, or ValueError."""
        if isinstance(value, bool | np.bool_):
            return bool(value)
        raise ValueError("true or false")


@dataclass(frozen=True)
class Whole:
    """A whole number from `low` to `high`, or one of `words`; 60.0 counts as 60."""

    low: int
    high: int = sys.maxsize  # not shown in messages
    words: tuple[str, ...] = ()

    def parse(self, value: object) -> int | str:
        """The number or word, or ValueError."""
        if isinstance(value, str) and value in self.words:
            return str(value)
        if is_number(value) and self.low <= value <= self.high and value == int(value):
            return int(value)
        limits = f"from {self.low} to {self.high}" if self.high < sys.maxsize else f">= {self.low}"
        raise ValueError(" or ".join([f"a whole number {limits}", *map(repr, self.words)]))


@dataclass(frozen=True)
class Real:
    """A single number of an interval, for options that are numbers."""

    interval: Interval

    def parse(self, value: object) -> float:
        """The number, or ValueError."""
        if is_number(value) and self.interval.contains(np.array([as_float(value)]))[0]:
            return as_float(value)
        raise ValueError(self.interval.words)
