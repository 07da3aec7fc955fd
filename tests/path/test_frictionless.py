"""Without friction: the answer of the path with friction, without its work."""

from typing import Any

import numpy as np
import pytest
from tracing import CIRCLE, CORNER, LANE_TOLERANCE, lowered_scene, solved_path

from fastncm.kernels.cache import JIT_OFF
from fastncm.path import frictionless, rows, rubbing, tip
from fastncm.path.run import trace_lanes
from fastncm.path.trace import LONGEST_MOVE, make_trace

#: So little friction that no force changes by it, but the path with friction is taken.
HARDLY_ANY = {"friction.mu": 1e-300}
SHEAR = {"model.shear": True, "finger.thickness": [0.0040, 0.0030]}
STEPS = {"path.steps": 13}
#: What the last step's factor decides, which is as exact as that step is short.
RATES = [
    rows.FORCE_RATE,
    rows.NORMAL_X_RATE,
    rows.NORMAL_Y_RATE,
    rows.CONTACT_X_RATE,
    rows.CONTACT_Y_RATE,
]
#: What is the same to rounding.
SHAPE = [
    rows.STATUS,
    rows.FORCE,
    rows.NORMAL_X,
    rows.NORMAL_Y,
    rows.CONTACT_X,
    rows.CONTACT_Y,
    rows.TIP_X,
    rows.TIP_Y,
    rows.TIP_ANGLE,
    rows.ENERGY,
    rows.STRAIN,
    rows.FEATURE,
    rows.CONTACTS,
]


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
@pytest.mark.parametrize(("order", "changes"), [(4, {}), (5, {}), (7, {}), (4, SHEAR)])
def test_answer_is_that_of_the_path_with_friction(
    scene: str, order: int, changes: dict[str, Any]
) -> None:
    """All sizes: unrolled by the compiler (4 and 5 modes), and any other."""
    smooth = solved_path(scene, order, {**STEPS, **changes})
    rubbed = solved_path(scene, order, {**STEPS, **changes, **HARDLY_ANY})
    assert smooth.converged[1:].all()
    one, other = smooth.trace.rows[0], rubbed.trace.rows[0]
    scale = np.maximum(np.abs(one).max(axis=0), 1e-9)
    np.testing.assert_array_equal(one[:, rows.KIND], other[:, rows.KIND])
    assert np.abs((one - other) / scale)[:, SHAPE].max() < 1e-12
    assert np.abs((one - other) / scale)[:, RATES].max() < 1e-5
    np.testing.assert_allclose(truncation(one), truncation(other), rtol=1e-3, atol=1e-14)


def truncation(table: np.ndarray) -> np.ndarray:
    """The estimates without the part that the residual's rounding decides."""
    return table[:, rows.ESTIMATE] - rows.ALGEBRAIC * table[:, rows.RESIDUAL]


@pytest.mark.parametrize("scene", [CIRCLE, CORNER])
def test_a_neighbour_with_friction_changes_nothing(scene: str) -> None:
    """Designs with and without friction side by side in one block of lanes."""
    lowered = lowered_scene(scene, STEPS)
    problem = lowered.problem(5, np.zeros(2, np.int64))
    traces = []
    for mu in (0.0, 0.3):
        trace = make_trace(2, problem.positions.shape[1], 5, 1)
        mixed = problem._replace(mu=np.array([0.0, mu]))
        trace_lanes(mixed, LANE_TOLERANCE, LONGEST_MOVE, trace)
        traces.append(trace)
    alone, beside = traces
    np.testing.assert_allclose(beside.shapes[0], alone.shapes[0], atol=1e-12)
    np.testing.assert_allclose(
        beside.rows[0, :, rows.FORCE], alone.rows[0, :, rows.FORCE], rtol=1e-12
    )
    assert (beside.rows[1, 1:, rows.FORCE] != alone.rows[1, 1:, rows.FORCE]).any()


@pytest.mark.skipif(
    not JIT_OFF, reason="calls between compiled functions cannot be counted from Python"
)
@pytest.mark.parametrize(("mu", "rubs"), [(0.0, False), (0.2, True)])
def test_only_the_work_that_is_needed(
    mu: float, rubs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: dict[str, int] = {}
    for module, name in (
        (frictionless, "linearise"),
        (frictionless, "step"),
        (frictionless, "rates"),
        (frictionless, "adjoint"),
        (rubbing, "linearise"),
        (rubbing, "step"),
        (rubbing, "rates"),
        (rubbing, "adjoint"),
        (tip, "prepare"),
        (tip, "respond"),
    ):
        label = f"{module.__name__.rpartition('.')[2]}.{name}"
        calls[label] = 0
        count(monkeypatch, module, name, label, calls)
    assert solved_path(CIRCLE, 4, {"friction.mu": mu}, [0.0738, 0.0720]).converged.all()
    with_friction = {name for name in calls if not name.startswith("frictionless")}
    done = {name for name, times in calls.items() if times > 0}
    assert done == (with_friction if rubs else set(calls) - with_friction)


def count(
    monkeypatch: pytest.MonkeyPatch, module: Any, name: str, label: str, calls: dict[str, int]
) -> None:
    """Count the calls of a function of `module` under its `label`."""
    function = getattr(module, name)

    def counted(*arguments: Any) -> Any:
        calls[label] += 1
        return function(*arguments)

    monkeypatch.setattr(module, name, counted)
