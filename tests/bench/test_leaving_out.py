"""What is left out changes no answer: a slice of `bench/leaving_out.py`."""

import re
from collections.abc import Callable
from pathlib import Path

import leaving_out
import pytest

import fastncm

pytestmark = pytest.mark.compiled


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leaving_out, "JAWS", 64)
    monkeypatch.setattr(leaving_out, "ROUNDS", 1)
    monkeypatch.setattr(leaving_out.heights, "__defaults__", (64,))


@pytest.mark.parametrize(
    "compared",
    [
        leaving_out.shear_of_a_jaw,
        leaving_out.shear_in_direct_contact,
        leaving_out.friction,
        leaving_out.discretised_contact,
        leaving_out.positions_before_touch,
        leaving_out.curves,
    ],
)
def test_the_answer_stays(compared: Callable[[], dict[str, object]]) -> None:
    row = compared()
    assert row["difference"] <= 1e-12
    assert row["unknowns_left_out"] <= row["unknowns_forced_in"]


def test_cases_share_their_problems() -> None:
    row = leaving_out.shared_problems()
    assert "2,079 paths solved, not 11" in str(row["how"])
    assert row["difference"] <= 1e-11  # apart, the jaws differ by up to 5e-13 themselves


def test_variants_find_what_they_change() -> None:
    """The lines that a build of the package is changed in are there."""
    package = Path(fastncm.__file__).parent
    for name, (_, files, pattern, _, _) in leaving_out.VARIANTS.items():
        assert any(re.search(pattern, file.read_text()) for file in package.glob(files)), name
