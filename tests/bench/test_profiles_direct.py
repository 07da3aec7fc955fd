"""A slice of the performance profiles in direct contact: errors, never times."""

import numpy as np
import pandas as pd
import profiles_direct as study
import pytest


@pytest.mark.compiled
def test_the_solvers_agree_and_the_continuum_is_near(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "LADDERS", {"fastncm": (1e-6,), "SLSQP": (1e-13,)})
    monkeypatch.setattr(study, "ROUNDS", 1)
    tasks, _ = study.draw_tasks(2)
    for number, task in enumerate(tasks):
        rows = pd.DataFrame(study.runs(number, task))
        assert rows["converged"].all()
        assert rows["error"].max() < 1e-6


def test_an_answer_far_from_the_continuum_solves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """No solver is right where none comes near shooting."""
    forces = pd.DataFrame({"success": [True], "force_x_N": [2.0], "force_y_N": [0.0]})
    monkeypatch.setattr(study, "solved", lambda *_: (forces, 1.0))
    task = study.Task(None, np.array([[1.0, 0.0]]))  # type: ignore[arg-type]
    assert all(row["error"] == np.inf for row in study.runs(0, task))
    near = study.Task(None, np.array([[2.01, 0.0]]))  # type: ignore[arg-type]
    assert all(row["error"] == 0.0 for row in study.runs(0, near))
