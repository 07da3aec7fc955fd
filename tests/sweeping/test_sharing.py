"""Cases that share one dimensionless problem are solved once, and get the same answer."""

import dataclasses

import numpy as np
import pandas as pd

from fastncm.cases import solve_chunk
from fastncm.columns import CASE_UNITS, WITHDRAWAL
from fastncm.sweeping import load, load_study, sweep


def test_2079_designs_of_11_shapes_need_11_shape_paths(tmp_path, pytestconfig):
    """thickness(21) x friction(9) x jaw height(11), against each case solved alone. By the
    recovered rule, where friction only turns the force."""
    study = load_study(pytestconfig.rootpath / "sweeps" / "snapfit-circle.toml")
    study = dataclasses.replace(study, scene=study.scene.replace({"friction.model": "recovered"}))
    run = sweep(study, tmp_path / "out", jobs=1)
    assert (run.rows, run.failed, run.shape_paths) == (2079, 0, 11)

    alone = [
        solve_chunk(study.scene, study.cases.columns(np.array([case]))) for case in range(2079)
    ]
    assert sum(result.shape_paths for result in alone) == 2079
    shown = [name for name in CASE_UNITS if name not in WITHDRAWAL]
    expected = pd.DataFrame(
        {name: np.concatenate([result.cases[name] for result in alone]) for name in shown}
    )
    table = load(run.out)[shown]
    exact = ["status", "advice", "positions"]
    pd.testing.assert_frame_equal(table[exact], expected[exact].astype(table[exact].dtypes))
    numbers = ["peak_force_N", "peak_position", "max_strain", "insertion_work_J"]
    np.testing.assert_allclose(table[numbers], expected[numbers], rtol=1e-12, atol=0)
