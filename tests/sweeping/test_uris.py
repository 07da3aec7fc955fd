"""Results on file systems named by a URI, and in the hands of other tools."""

import numpy as np
import pandas as pd
import pyarrow.fs as pafs
import pytest

from fastncm.cli import main
from fastncm.errors import SweepError
from fastncm.scene import load_scene
from fastncm.sweeping import BrokenOff, Report, Study, load, store, sweep
from fastncm.sweeping.storage import Storage

CIRCLE = load_scene("snapfit-circle").replace({"path.steps": 10})
AXES = {
    "jaw.height": np.linspace(0.0069, 0.0109, 30),
    "model.section": ["psi", "psi+gamma"],
    "model.shear": [False, True],
    "path.start": ["touch", 0.0760],
}
STUDY = Study(CIRCLE, AXES, curves=True, report=Report("max_strain", "max"))


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """Several parts, so that the tools have something to put together."""
    out = tmp_path_factory.mktemp("local") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store, "PART_BYTES", 1)
        patch.setattr(store, "compact", lambda _: [])
        return sweep(STUDY, out, jobs=1).out


@pytest.mark.parametrize("kind", ["file", "memory"])
def test_a_uri_holds_the_same_tables(tmp_path, local, kind, capsys):
    if kind == "memory":
        pytest.importorskip("fsspec")
    out = f"{kind}://{tmp_path}/out"
    run = sweep(STUDY, out, jobs=1)
    for table in ("cases", "curves"):
        pd.testing.assert_frame_equal(load(out, table), load(local, table), check_exact=True)
    assert not sweep(STUDY, out, jobs=1).fresh
    assert run.best(1)["max_strain"][0] == load(local)["max_strain"].max()
    assert str(run.out) == (out if kind == "memory" else f"{tmp_path}/out")
    assert main(["status", out]) == 0
    assert "complete, 240 of 240" in capsys.readouterr().out
    assert (tmp_path / "out").exists() == (kind == "file")


def test_a_run_on_a_uri_that_broke_off_goes_on(tmp_path, local, monkeypatch):
    pytest.importorskip("fsspec")
    out = f"memory://{tmp_path}/broken"
    monkeypatch.setattr(store, "PART_BYTES", 1)
    write = store.write_cases

    def full(storage, name, *rest):
        if name == "part-00002.parquet":
            raise OSError(28, "No space left on device")
        return write(storage, name, *rest)

    monkeypatch.setattr(store, "write_cases", full)
    with pytest.raises(BrokenOff, match="No space left on device; .* the same command goes on"):
        sweep(STUDY, out, jobs=1)
    monkeypatch.undo()
    kept = len(load(out))
    run = sweep(STUDY, out, jobs=1)
    assert run.resumed == kept > 0
    pd.testing.assert_frame_equal(load(out), load(local), check_exact=True)


def test_a_sweep_on_a_uri_from_the_command_line(tmp_path, capsys):
    pytest.importorskip("fsspec")
    study = tmp_path / "study.toml"
    study.write_text("scene = 'snapfit-circle'\n[axes]\njaw.height = [0.0079, 0.0089]\n")
    assert main(["sweep", str(study), "--out", f"memory://{tmp_path}/cli", "--jobs", "1"]) == 0
    printed = capsys.readouterr().out
    assert f"table: memory://{tmp_path}/cli/cases" in printed
    assert "picture" not in printed
    assert main(["compact", f"memory://{tmp_path}/cli"]) == 0
    assert main(["plot", f"memory://{tmp_path}/cli"]) == 2
    assert "local folders only" in capsys.readouterr().err


def test_a_uri_that_nobody_knows_is_refused():
    with pytest.raises(SweepError, match="cannot reach nosuch://x/y"):
        sweep(STUDY, "nosuch://x/y", jobs=1)


def test_what_pyarrow_knows_needs_no_fsspec(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "fsspec.core", None)
    assert isinstance(Storage("mock:///results").filesystem, pafs.FileSystem)
    with pytest.raises(SweepError, match=r"pip install 'fastncm\[remote\]'"):
        Storage("memory://results")


@pytest.mark.parametrize("table", ["cases", "curves"])
def test_polars_and_duckdb_read_the_same_values(local, table):
    polars = pytest.importorskip("polars")
    duckdb = pytest.importorskip("duckdb")
    order = ["case_id"] if table == "cases" else ["case_id", "position"]
    expected = load(local, table).sort_values(order).reset_index(drop=True)
    files = f"{local}/{table}/*.parquet"
    frames = {
        "pandas": pd.read_parquet(local / table),
        "polars": polars.read_parquet(files).to_pandas(),
        "duckdb": duckdb.sql(f"select * from '{files}'").df(),
    }
    assert len(list((local / table).iterdir())) > 1
    for frame in frames.values():
        frame = frame.sort_values(order).reset_index(drop=True)
        assert list(frame) == list(expected)
        for name in expected:
            np.testing.assert_array_equal(frame[name].to_numpy(), expected[name].to_numpy())
