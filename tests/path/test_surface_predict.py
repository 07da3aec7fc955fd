"""Extrapolation along the path: exact for what it is made for."""

import numpy as np
import pytest
from surfaces import interpreted, lowered_surface

from fastncm.kernels.nodal import make_nodal
from fastncm.path.surface_predict import forget, make_strides, predict, remember

pytestmark = interpreted
PATH = np.array([0.3, -0.2, 0.1])


def states(places: list[float]):
    """States whose angles are parabolas of the place along the path, the forces lines."""
    problem = lowered_surface({"solver.intervals": 6}).problem
    rng = np.random.default_rng(1)
    a, b, c = rng.normal(size=(3, 2, 7))
    f, g = rng.uniform(1.0, 2.0, size=(2, 8))
    for t in places:
        state = make_nodal(problem)
        state.psi[:], state.gamma[:] = a + b * t + c * t * t
        state.force[:] = f + g * t
        yield state


def predicted(places: list[float], strides, path: np.ndarray = PATH):
    """The state predicted for the last of four places, and what it should be."""
    first, second, third, fourth = states(places)
    remember(strides, first, PATH, places[1] - places[0])
    remember(strides, second, PATH, places[2] - places[1])
    guess = next(states([places[2]]))
    predict(strides, third, path, places[3] - places[2], guess)
    return guess, third, fourth


@pytest.mark.parametrize("places", [[0.0, 1.0, 2.0, 3.0], [0.0, 0.7, 2.0, 2.4]])
def test_parabolas_and_lines_are_continued(places: list[float]) -> None:
    guess, _, expected = predicted(places, make_strides(7, 8))
    np.testing.assert_allclose(guess.psi, expected.psi, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(guess.gamma, expected.gamma, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(guess.force, expected.force, rtol=1e-12)


@pytest.mark.parametrize(
    "path", [-PATH, np.array([0.2, 0.3, 0.0]), 3.0 * PATH], ids=["back", "across", "far"]
)
def test_nothing_is_predicted_where_the_target_turns_or_leaps(path: np.ndarray) -> None:
    guess, last, _ = predicted([0.0, 1.0, 2.0, 3.0], make_strides(7, 8), path)
    np.testing.assert_array_equal(guess.psi, last.psi)
    np.testing.assert_array_equal(guess.force, last.force)


def test_one_state_before_gives_a_line_and_none_nothing() -> None:
    strides = make_strides(7, 8)
    first, second, third = states([0.0, 1.0, 1.5])
    guess = next(states([1.0]))
    forget(strides)
    predict(strides, second, PATH, 0.5, guess)
    np.testing.assert_array_equal(guess.psi, second.psi)
    remember(strides, first, PATH, 1.0)
    predict(strides, second, PATH, 0.5, guess)
    np.testing.assert_allclose(guess.psi, second.psi + 0.5 * (second.psi - first.psi), rtol=1e-12)
    np.testing.assert_allclose(guess.force, third.force, rtol=1e-12)
