"""Summaries of paths in direct contact, from rows made up so that the answers are known."""

import numpy as np
import pytest

from fastncm.path import surface_rows as rows
from fastncm.path.surface_reduce import parabola_vertex, summarise_surfaces
from fastncm.sqp import status


def summarise(table):
    return summarise_surfaces(table, np.array([-1.0]), table.shape[1] - 1)


def path(position, force, state=None):
    """Rows (1, P, COLUMNS) with forces that are rates of work, too."""
    table = np.zeros((1, len(position), rows.COLUMNS))
    table[0, :, rows.POSITION] = position
    table[0, :, rows.INSERTION] = force
    table[0, :, rows.WORK_RATE] = force
    table[0, :, rows.STATUS] = status.CONVERGED if state is None else state
    table[0, :, rows.STRAIN] = np.arange(len(position))
    table[0, :, rows.ITERATIONS] = 2
    return table


def test_the_parabola_finds_the_peak_of_a_parabola():
    position = np.array([2.0, 1.7, 1.1, 0.9, 0.2])
    summary = summarise(path(position, 3.0 - (position - 1.2) ** 2))
    assert summary.peak_force[0] == pytest.approx(3.0, rel=1e-14)
    assert summary.peak_position[0] == pytest.approx(1.2, rel=1e-14)
    assert (summary.strain[0], summary.iterations[0]) == (4.0, 10)
    assert summary.status[0] == status.CONVERGED


def test_work_is_the_integral_along_the_path():
    position = np.linspace(2.0, 0.0, 201)
    summary = summarise(path(position, position))
    assert summary.work[0] == pytest.approx(2.0, rel=1e-12)
    there_and_back = np.concatenate([position, position[::-1]])
    assert summarise(path(there_and_back, there_and_back)).work[0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("force", [[3.0, 2.0, 1.0], [1.0, 2.0, 3.0], [1.0, 2.0]])
def test_a_peak_at_an_end_is_the_row(force):
    position = np.linspace(1.0, 0.0, len(force))
    summary = summarise(path(position, force))
    assert summary.peak_force[0] == 3.0 if len(force) == 3 else 2.0
    assert summary.peak_position[0] == position[np.argmax(force)]


def test_no_parabola_through_rows_without_contact():
    state = [status.NO_CONTACT, status.CONVERGED, status.CONVERGED]
    summary = summarise(path([1.0, 0.5, 0.0], [0.0, 3.0, 2.0], state))
    assert (summary.peak_force[0], summary.peak_position[0]) == (3.0, 0.5)


def test_the_first_failure_is_the_status():
    state = [status.CONVERGED, status.INFEASIBLE, status.MAX_ITERATIONS]
    assert summarise(path([1, 0.5, 0], [0, 1, 0], state)).status[0] == status.INFEASIBLE
    nothing = summarise(path([1, 0.5, 0], [0, 0, 0], [status.NO_CONTACT] * 3))
    assert (nothing.status[0], nothing.peak_force[0]) == (status.NO_CONTACT, 0.0)


def test_vertices_of_many_parabolas():
    top, place = np.array([1.0, 2.0]), np.array([0.1, -0.2])
    x = np.array([[-1.0, -1.5], [0.0, 0.0], [2.0, 1.0]])
    vertex = parabola_vertex(x, top - 0.5 * (x - place) ** 2)
    np.testing.assert_allclose(vertex, (top, place), rtol=1e-13)
