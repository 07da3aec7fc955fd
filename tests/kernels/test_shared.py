"""Named tuples in memory: what is read of them is what was put there."""

from typing import NamedTuple

import numba
import numpy as np
import pytest

from fastncm.kernels.cache import JIT_OFF
from fastncm.kernels.shared import share

pytestmark = pytest.mark.skipif(JIT_OFF, reason="without compiler a tuple is shared as it is")


class Inner(NamedTuple):
    numbers: np.ndarray
    others: np.ndarray


class Outer(NamedTuple):
    table: np.ndarray
    inner: Inner
    count: int
    factor: float
    flag: bool
    places: np.ndarray


def made() -> Outer:
    """Fields of all kinds, among them a tuple of which all fields are alike."""
    random = np.random.default_rng(3)
    return Outer(
        random.normal(size=(3, 4, 5)),
        Inner(random.normal(size=6), random.normal(size=7)),
        11,
        0.25,
        True,
        np.arange(4),
    )


@numba.njit(_nrt=False)
def fill(kept, out):
    """Read every field in a function of its own, and write into an array of the tuple."""
    out[0] = kept.table[1, 2, 3]
    out[1] = kept.inner.numbers[4] * kept.inner.others[-1]
    out[2] = kept.count * kept.factor if kept.flag else -1.0
    out[3] = kept.places[2] + kept.table.shape[1] + kept.places.size
    kept.inner.others[0] = 42.0
    out[4] = kept.inner.others[0]


@numba.njit(_nrt=False)
def enter(record, out):
    fill(share(record), out)


def test_fields_are_those_of_the_tuple() -> None:
    record, out = made(), np.zeros(5)
    enter(record, out)
    inner = record.inner
    expected = [
        record.table[1, 2, 3],
        inner.numbers[4] * inner.others[-1],
        11 * 0.25,
        2 + 4 + 4,
        42.0,
    ]
    np.testing.assert_array_equal(out, expected)
    assert inner.others[0] == 42.0  # the arrays are not copies


@numba.njit
def read_what_is_not_there(record):
    return share(record).nothing


def test_a_field_that_is_not_there_is_an_error() -> None:
    with pytest.raises(numba.TypingError, match="nothing"):
        read_what_is_not_there(made())
