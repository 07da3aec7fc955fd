"""Cases that are no grid: lists, tables and samples."""

import importlib.util

import numpy as np
import pandas as pd
import pytest
from scipy.stats import qmc

from fastncm.cases import solve_cases
from fastncm.errors import SceneError
from fastncm.plot import plot_run
from fastncm.scene import load_scene
from fastncm.sweeping import Design, Study, load, load_study, sweep
from fastncm.sweeping.read import read_study
from fastncm.sweeping.storage import Storage

CIRCLE = load_scene("snapfit-circle").replace({"path.steps": 10})
RANGES = {
    "jaw.height": {"uniform": [0.0079, 0.0099]},
    "finger.young": {"loguniform": [1e9, 4e9]},
    "friction.mu": [0.0, 0.2],
}
SAMPLED = "[design]\nkind='sobol'\nsamples=4\n[axes]\nfriction.mu = {uniform=[1, 0]}"
NUMBERS = ["peak_force_N", "peak_position", "max_strain", "insertion_work_J"]


def test_a_sample_is_scipys_stretched_to_the_ranges():
    """Against scipy.stats.qmc called by hand."""
    engines = {"latin-hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol, "halton": qmc.Halton}
    for kind, engine in engines.items():
        cases = Study(CIRCLE, RANGES, design=Design(kind, 64, seed=7)).cases
        points = engine(d=3, rng=np.random.default_rng(7)).random(64)
        height = qmc.scale(points[:, :1], 0.0079, 0.0099).ravel()
        np.testing.assert_allclose(cases.axes["jaw.height"], height, rtol=1e-14)
        young = np.exp(qmc.scale(points[:, 1:2], np.log(1e9), np.log(4e9))).ravel()
        np.testing.assert_allclose(cases.axes["finger.young"], young, rtol=1e-12)
        assert cases.axes["friction.mu"].tolist() == np.where(points[:, 2] < 0.5, 0.0, 0.2).tolist()


def test_a_sample_fills_the_ranges_evenly_and_keeps_its_seed():
    study = Study(CIRCLE, RANGES, design=Design("latin-hypercube", 50, seed=3))
    cells = (study.cases.axes["jaw.height"] - 0.0079) / 0.0020 * 50
    assert sorted(cells.astype(int)) == list(range(50))
    again, other = (
        Study(CIRCLE, RANGES, design=Design("latin-hypercube", 50, seed)).cases.axes["jaw.height"]
        for seed in (3, 4)
    )
    assert again.tolist() == study.cases.axes["jaw.height"].tolist()
    assert other.tolist() != again.tolist()


@pytest.mark.parametrize("kind", ["latin-hypercube", "sobol", "halton"])
def test_a_sampled_study_from_its_file(tmp_path, kind):
    path = tmp_path / "study.toml"
    path.write_text(
        "scene = 'snapfit-circle'\nset = { path.steps = 10 }\n"
        f"[design]\nkind = '{kind}'\nsamples = 32\nseed = 5\n"
        "[axes]\njaw.height = { uniform = [0.0079, 0.0099] }\n"
        "finger.young = { loguniform = [1e9, 4e9] }\nfriction.mu = [0.0, 0.2]\n"
    )
    study = load_study(path)
    assert study.design == Design(kind, 32, 5)
    run = sweep(study, tmp_path / "out", jobs=1)
    frame = load(run.out)
    expected = solve_cases(CIRCLE, frame[list(RANGES)])
    np.testing.assert_allclose(frame[NUMBERS], expected[NUMBERS], rtol=1e-11)
    assert not sweep(load_study(path), tmp_path / "out", jobs=1).fresh
    assert frame.attrs["study"]["design"] == {"kind": kind, "samples": 32, "seed": 5}
    names = {picture.name for picture in plot_run(run.out)}
    assert names == {"design_scatter.png", "shapes.png"}


TABLE = pd.DataFrame(
    {
        "jaw.height": [0.0099, 0.0079, 0.0089, 0.0079],
        "model.section": ["psi", "psi+gamma", "psi", "psi"],
        "model.shear": [True, True, False, False],
        "solver.order": [4, 5, 4, 6],
    }
)


def check_table(run):
    frame = load(run.out)
    assert frame["case_id"].tolist() == [0, 1, 2, 3]
    pd.testing.assert_frame_equal(frame[list(TABLE)], TABLE, check_dtype=False)
    expected = solve_cases(CIRCLE, TABLE)
    np.testing.assert_allclose(frame[NUMBERS], expected[NUMBERS], rtol=1e-11)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_table_from_a_file(tmp_path, suffix):
    file = tmp_path / f"cases.{suffix}"
    TABLE.to_csv(file, index=False) if suffix == "csv" else TABLE.to_parquet(file, index=False)
    path = tmp_path / "study.toml"
    path.write_text(
        "scene = 'snapfit-circle'\nset = { path.steps = 10 }\n"
        f"[design]\ntable = 'cases.{suffix}'\n"
    )
    check_table(sweep(load_study(path), tmp_path / "out", jobs=1))


def test_a_data_frame_and_a_list_are_the_same_study(tmp_path):
    check_table(sweep(Study(CIRCLE, TABLE), tmp_path / "out", jobs=1))
    listed = Study(CIRCLE, TABLE.to_dict("list"), design=Design("list"))
    assert not sweep(listed, tmp_path / "out", jobs=1).fresh
    again = read_study(Storage(tmp_path / "out"))
    assert again.to_dict() == listed.to_dict()
    for name, values in again.cases.axes.items():
        assert values.tolist() == listed.cases.axes[name].tolist()


def test_pairs_and_mixed_values_survive_the_folder(tmp_path):
    cases = {
        "finger.thickness": [[0.0036, 0.0028], 0.0032],
        "path.start": ["touch", 0.0760],
    }
    study = Study(CIRCLE, cases, design=Design("list"))
    out = sweep(study, tmp_path / "out", jobs=1).out
    assert load(out)["status"].tolist() == ["converged"] * 2
    again = read_study(Storage(out))
    assert again.cases.axes["finger.thickness"].tolist() == [(0.0036, 0.0028), 0.0032]
    assert again.keys(np.arange(2)).tolist() == study.keys(np.arange(2)).tolist()


def test_another_table_is_another_study(tmp_path):
    sweep(Study(CIRCLE, TABLE), tmp_path / "out", jobs=1)
    changed = TABLE.assign(**{"jaw.height": TABLE["jaw.height"] + 1e-5})
    with pytest.raises(Exception, match=r"axes.'jaw.height' is \{'values': 4, 'digest'"):
        sweep(Study(CIRCLE, changed), tmp_path / "out", jobs=1)


@pytest.mark.parametrize(
    ("line", "text", "words"),
    [
        (3, "[design]\nkind = 'sobl'\n[axes]\nfriction.mu = [0]", "'sobol'"),
        (2, "[design]\nkind = 'sobol'\n[axes]\nfriction.mu = {uniform=[0, 1]}", "samples = 0"),
        (4, "[design]\nkind = 'halton'\nsamples = -1\n[axes]\nfriction.mu = {uniform=[0,1]}", "-1"),
        (5, SAMPLED.replace("samples=4", "samples=4\nseed=0.5"), "seed = 0.5"),
        (3, "[axes]\nfriction.mu = {uniform=[0, 1]}", "linspace"),
        (6, SAMPLED, "low"),
        (6, SAMPLED.replace("uniform=[1, 0]", "loguniform=[0, 1]"), "0 < low"),
        (6, SAMPLED.replace("uniform=[1, 0]", "uniform=[0]"), "uniform"),
        (
            6,
            SAMPLED.replace("friction.mu = {uniform=[1, 0]}", "'friction.mu' = {normal=[0, 1]}"),
            "uniform",
        ),
        (6, SAMPLED.replace("[1, 0]", "[-1, 1]"), "must be"),
        (3, "[design]\ntable = 'none.csv'", "none.csv"),
        (3, "[design]\ntable = 'study.toml'", ".csv or .parquet"),
        (3, "[design]\ntable = 3", "name of a file"),
        (3, "[design]\ntable = 'bad.csv'", "'friction.mu'"),
        (3, "[design]\ntable = 'bad.csv'\nseed = 1", "left out"),
        (3, "[design]\ntable = 'empty.csv'", "no cases"),
        (3, "[design]\nsample = 4\n[axes]\nfriction.mu = [0]", "'samples'"),
        (4, "[design]\nkind = 'list'\n[axes]\nfriction.mu = [0]\njaw.height = [1, 2]", "equally"),
    ],
)
def test_what_is_wrong_with_a_design_is_named_with_its_line(tmp_path, line, text, words):
    (tmp_path / "bad.csv").write_text("friction.nu\n0.1\n")
    (tmp_path / "empty.csv").write_text("friction.mu\n")
    path = tmp_path / "study.toml"
    path.write_text("scene = 'snapfit-circle'\n" + text)
    with pytest.raises(SceneError) as error:
        load_study(path)
    assert words in str(error.value)
    assert str(error.value).startswith(f"{path}:{line}: ")


def test_sobol_indices_of_the_peak_force(tmp_path, pytestconfig):
    """The recipe, against theory: the frictionless force is E b w^3 times a constant, a product
    of independent inputs, whose indices follow from the moments of the factors (Sobol' 1993)."""
    pytest.importorskip("SALib")
    file = pytestconfig.rootpath / "recipes" / "sobol_indices.py"
    spec = importlib.util.spec_from_file_location("sobol_indices", file)
    recipe = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(recipe)
    powers = {"finger.thickness": 3, "finger.width": 1, "finger.young": 1}
    bounds = [[0.0030, 0.0034], [0.0085, 0.0105], [2.0e9, 3.2e9]]
    problem = {"num_vars": 3, "names": list(powers), "bounds": bounds}
    found = recipe.indices(problem, tmp_path / "out", 2048)

    def moment(low, high, power):
        return (high ** (power + 1) - low ** (power + 1)) / ((power + 1) * (high - low))

    spread = np.array(
        [
            moment(*b, 2 * p) / moment(*b, p) ** 2
            for b, p in zip(bounds, powers.values(), strict=True)
        ]
    )
    variance = spread.prod() - 1
    np.testing.assert_allclose(found["S1"], (spread - 1) / variance, atol=0.01)
    total = (spread - 1) * spread.prod() / spread / variance
    np.testing.assert_allclose(found["ST"], total, atol=0.01)
