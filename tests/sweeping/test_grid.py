"""The grid numbers cases as itertools.product does, and a plan cuts it without loss."""

import itertools

import numpy as np
import pytest

from fastncm.sweeping import backends
from fastncm.sweeping.grid import Grid
from fastncm.sweeping.plan import Plan
from fastncm.sweeping.samples import Samples

AXES = {
    "jaw.height": np.array([0.007, 0.008, 0.009, 0.010]),
    "finger.thickness": np.array([0.0022, 0.0032, 0.0042]),
    "model.section": np.array(["psi", "psi+gamma"], dtype=object),
    "friction.mu": np.array([0.0, 0.1, 0.2, 0.3, 0.4]),
}
SCALE_ONLY = {"finger.thickness", "friction.mu"}


def test_the_grid_equals_the_product_of_the_axes():
    grid = Grid(AXES)
    columns = grid.columns(np.arange(grid.size))
    assert list(columns) == list(AXES)
    assert list(zip(*columns.values(), strict=True)) == list(itertools.product(*AXES.values()))


def test_any_cases_in_any_order_are_found_without_the_others():
    grid = Grid({name: np.arange(1000.0) for name in ("a", "b", "c", "d")})  # 1e12 cases
    columns = grid.columns(np.array([10**12 - 1, 0, 123_456_789_012]))
    assert [list(column) for column in columns.values()] == [
        [999, 0, 123],
        [999, 0, 456],
        [999, 0, 789],
        [999, 0, 12],
    ]


def taken(plan, rows):
    """What is left of the plan."""
    while (block := plan.take(rows)) is not None:
        yield block


def nothing_done(size):
    return np.zeros(size, dtype=bool)


@pytest.mark.parametrize("rows", [1, 7, 15, 16, 30, 10_000])
@pytest.mark.parametrize("max_rows", [4, 15, 100, 10_000])
@pytest.mark.parametrize("done", [0, 1, 60, 119, 120])
def test_a_plan_hands_out_every_missing_case_once(rows, max_rows, done):
    grid = Grid(AXES)
    finished = nothing_done(grid.size)
    finished[np.random.default_rng(done).permutation(grid.size)[:done]] = True
    plan = Plan(grid, SCALE_ONLY, max_rows, finished)
    assert plan.rows_left == grid.size - done
    blocks = list(taken(plan, rows))
    assert plan.rows_left == 0
    handed_out = np.concatenate([np.array([], dtype=int), *blocks])
    assert sorted(handed_out) == list(np.flatnonzero(~finished))
    assert all(0 < len(block) <= max_rows for block in blocks)


def test_a_nearly_finished_plan_is_walked_through_in_large_steps():
    grid = Grid({"a": np.arange(2000.0), "b": np.arange(1000.0)})
    done = ~nothing_done(grid.size)
    done[[5, 1_234_567]] = False
    plan = Plan(grid, {"b"}, 200_000, done)
    orders = []
    walk = plan._order.case_ids
    plan._order.case_ids = lambda *ends: orders.append(ends) or walk(*ends)
    assert [list(block) for block in taken(plan, 1)] == [[5], [1_234_567]]
    assert len(orders) < 100


def test_cases_that_share_a_problem_share_a_block():
    grid = Grid(AXES)
    plan = Plan(grid, SCALE_ONLY, 10_000, nothing_done(grid.size))
    problems = []
    for block in taken(plan, 40):
        columns = grid.columns(block)
        problems += set(zip(columns["jaw.height"], columns["model.section"], strict=True))
    assert len(problems) == len(set(problems)) == 8


def test_a_plan_may_change_its_mind_about_the_size():
    grid = Grid(AXES)
    plan = Plan(grid, SCALE_ONLY, 10_000, nothing_done(grid.size))
    taken = [plan.take(rows) for rows in (1, 60, 10_000)]
    assert [len(ids) for ids in taken] == [15, 60, 45]
    assert plan.take(1) is None
    assert len(set(np.concatenate(taken))) == grid.size


def test_samples_are_solved_with_shared_problems_side_by_side():
    heights = np.array([3.0, 1.0, 2.0, 1.0, 3.0])
    samples = Samples({"jaw.height": heights, "friction.mu": np.arange(5.0)})
    plan = Plan(samples, SCALE_ONLY, 10_000, nothing_done(5))
    order = np.concatenate(list(taken(plan, 2)))
    assert sorted(order) == list(range(5))
    assert list(heights[order]) == [1, 1, 2, 3, 3]


def test_picking_cases_holds_the_other_axes_at_their_middle():
    grid = Grid(AXES)
    columns = grid.columns(grid.case_ids({"friction.mu": [0, 4]}))
    assert list(columns["friction.mu"]) == [0.0, 0.4]
    assert set(columns["jaw.height"]) == {0.009}
    assert set(columns["finger.thickness"]) == {0.0032}


def test_many_workers_get_longer_tasks_and_all_end_together():
    """The parent has to feed them all; towards the end tasks shrink."""
    sizes = {}
    for count in (2, 160):
        grid = Grid({"a": np.arange(1000.0), "b": np.arange(1000.0)})
        plan = Plan(grid, {}, 10**9, nothing_done(grid.size))
        pace = backends.Pace(seconds=backends.TASK_SECONDS, rows=100.0)
        sizes[count] = [len(block) for block in backends._shrinking(plan, pace, count)]
        assert sum(sizes[count]) == grid.size
    assert sizes[2][0] == 100
    assert sizes[160][0] == 1000
    for count, blocks in sizes.items():  # the last one of every worker is an eighth
        assert max(blocks[-count:]) <= blocks[0] / 8
