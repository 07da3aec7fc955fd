"""The command line: exit codes, one line for bad input, and nothing written then."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from fastncm.cli import main
from fastncm.scene import load_scene
from fastncm.sweeping import load

STUDY = """
scene = "snapfit-circle"
[axes]
"finger.thickness" = [0.0022, 0.0032]
"jaw.height" = [0.0079, 0.0089, 0.0099]
[report]
best = "min"
limits = { max_strain = 0.1 }
"""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def run(*arguments):
    return main([str(argument) for argument in arguments])


def test_help_does_not_load_the_solver():
    code = (
        "import sys\nfrom fastncm.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as stop:\n    assert stop.code == 0\n"
        "heavy = {'numpy', 'numba', 'pandas', 'pyarrow', 'matplotlib', 'joblib'}\n"
        "assert not heavy & sys.modules.keys(), heavy & sys.modules.keys()\n"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
    for command in ("scenes", "solve", "sweep", "status", "compact", "plot", "warmup"):
        assert f"\n    {command} " in result.stdout


def test_the_module_is_the_command():
    result = subprocess.run(
        [sys.executable, "-m", "fastncm", "solve", "no-such-scene"], capture_output=True, text=True
    )
    assert result.returncode == 2
    assert result.stdout == ""


def test_where_there_are_no_posix_locks_a_sweep_says_so(study, tmp_path):
    code = (
        "import sys\nsys.modules['fcntl'] = None\nfrom fastncm.cli import main\n"
        "sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", code, "sweep", str(study), "--out", str(tmp_path / "out")]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 2
    assert result.stderr.startswith("fastncm: sweeps need Linux, macOS or another POSIX system")
    assert not (tmp_path / "out").exists()


def test_scenes_are_listed(capsys):
    assert run("scenes") == 0
    lines = capsys.readouterr().out.splitlines()
    names = {line.split()[0] for line in lines if not line.startswith(" ")}
    assert names == {"rubber-ellipse", "snapfit-circle", "snapfit-corner"}
    assert "semi-axes" in lines[1]


def test_solve_prints_the_curve_and_its_peak(capsys):
    assert run("solve", "snapfit-circle") == 0
    out = capsys.readouterr().out
    assert "insertion_force_N" in out
    _, force, _, _, _, position, _ = out.splitlines()[-1].split()
    assert float(force) == pytest.approx(5.8170, rel=1e-4)
    assert float(position) == pytest.approx(0.0634628, rel=1e-6)


def test_solve_says_why_rows_failed(capsys):
    assert run("solve", "snapfit-circle", "--set", "friction.mu=3") == 1
    out = capsys.readouterr().out
    assert "failed: " in out
    assert "with friction.mu up to" in out


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_solve_writes_all_rows(tmp_path, suffix, capsys):
    file = tmp_path / f"curve.{suffix}"
    settings = ["--set", "friction.mu=0.2", "--set", "solver.contact=closest"]
    assert run("solve", "snapfit-circle", *settings, "--out", file) == 0
    assert str(file) in capsys.readouterr().out
    frame = pd.read_csv(file) if suffix == "csv" else pd.read_parquet(file)
    assert len(frame) == load_scene("snapfit-circle").path.steps
    assert np.isfinite(frame["insertion_force_N"]).all()
    assert (frame["friction_force_N"] != 0).any()
    assert list(tmp_path.iterdir()) == [file]


def test_solve_draws(tmp_path, capsys):
    assert run("solve", "snapfit-corner", "--plot", tmp_path / "curve.png") == 0
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")


def test_sweep_status_and_plot(study, tmp_path, capsys):
    out = tmp_path / "out"
    assert run("sweep", study, "--out", out, "--jobs", 1) == 0
    printed = capsys.readouterr().out
    assert "6 cases" in printed
    assert "3 shape paths" in printed
    assert f"table: {out / 'cases'}" in printed
    assert f"picture: {out / 'design_chart.png'}" in printed
    best = printed[printed.index("best designs (min peak_force_N, max_strain <= 0.1):") :]
    frame = load(out).sort_values("peak_force_N")
    shown = [line.split()[0] for line in best.splitlines()[2:7]]
    assert shown == [str(case) for case in frame["case_id"].head(5)]

    assert run("status", out) == 0
    assert "complete, 6 of 6 cases" in capsys.readouterr().out
    (out / "design_chart.png").unlink()
    assert run("plot", out) == 0
    assert (out / "design_chart.png").exists()
    capsys.readouterr()

    assert run("sweep", study, "--out", out) == 0
    assert "complete already" in capsys.readouterr().out


def test_failed_rows_are_counted_and_the_code_is_1(study, tmp_path, capsys, monkeypatch):
    from fastncm.sweeping import tasks

    solve_chunk = tasks.solve_chunk

    def one_fails(scene, columns, curves=False):
        result = solve_chunk(scene, columns, curves=curves)
        failing = columns["jaw.height"] == 0.0089
        result.columns["status"][failing] = result.words["status"].index("max_iterations")
        result.columns["advice"][failing] = len(result.words["advice"])
        result.words["advice"].append("Try this.")
        return result

    monkeypatch.setattr(tasks, "solve_chunk", one_fails)
    assert run("sweep", study, "--out", tmp_path / "out", "--jobs", 1) == 1
    printed = capsys.readouterr().out
    assert "2 failed" in printed
    assert "failed: 2 cases max_iterations. Try this." in printed
    assert run("status", tmp_path / "out") == 1
    assert "max_iterations: 2" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "required"),
        (["solv"], "invalid choice"),
        (["solve"], "SCENE"),
        (["solve", "snapfit-circel"], "snapfit-circle"),
        (["solve", "rubber-ellipsis"], "did you mean 'rubber-ellipse'"),
        (["solve", "snapfit-circle", "--set", "finger.thicknes=0.003"], "'finger.thickness'"),
        (["solve", "snapfit-circle", "--set", "finger.thickness=abc"], "'abc'"),
        (["solve", "snapfit-circle", "--set", "finger.thickness=-1"], "greater than 0"),
        (["solve", "snapfit-circle", "--set", "finger.thickness"], "NAME=VALUE"),
        (["solve", "snapfit-circle", "--set", "friction.mu=nan"], "finite"),
        (["solve", "snapfit-circle", "--set", "model.shear=1"], "true or false"),
        (["solve", "snapfit-circle", "--out", "curve.xls"], ".csv or .parquet"),
        (["solve", "snapfit-circle", "--out", "no/such/folder.csv"], "no folder"),
        (["solve", "snapfit-circle", "--plot", "picture"], ".png"),
        (["sweep", "study.toml"], "--out"),
        (["sweep", "none.toml", "--out", "out"], "none.toml"),
        (["sweep", "study.toml", "--out", "out", "--jobs", "0"], "at least 1"),
        (["sweep", "study.toml", "--out", "out", "--jobs", "two"], "--jobs"),
        (["sweep", "broken.toml", "--out", "out"], "broken.toml:3"),
        (["sweep", "study.toml", "--out", "study.toml"], "is a file"),
        (["sweep", "study.toml", "--out", "out", "--backend", "mpi"], "loky, threading, dask"),
        (["sweep", "study.toml", "--out", "out", "--scheduler", "tcp://a:1"], "only with backend"),
        (["sweep", "study.toml", "--out", "s4://bucket/x"], "cannot reach s4://bucket/x"),
        (["status", "out"], "no sweep"),
        (["compact", "out"], "no sweep"),
        (["plot", "out"], "no sweep"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(
    arguments, words, study, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.toml").write_text("scene = 'snapfit-circle'\n[axes]\n'friction.nu' = [0]\n")
    before = sorted(tmp_path.rglob("*"))
    try:
        code = run(*arguments)
    except SystemExit as stop:
        code = stop.code
    printed = capsys.readouterr()
    assert code == 2
    assert printed.out == ""
    assert printed.err.startswith("fastncm: ")
    assert printed.err.count("\n") == 1
    assert words in printed.err
    assert sorted(tmp_path.rglob("*")) == before


def test_another_studys_folder_is_bad_input(study, tmp_path, capsys):
    out = tmp_path / "out"
    assert run("sweep", study, "--out", out, "--jobs", 1) == 0
    study.write_text(STUDY.replace("0.0022", "0.0021"))
    capsys.readouterr()
    assert run("sweep", study, "--out", out, "--jobs", 1) == 2
    assert "another study" in capsys.readouterr().err


def test_a_sweep_that_breaks_off_has_a_code_of_its_own(study, tmp_path, capsys, monkeypatch):
    from fastncm.sweeping import store

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(store, "packed", full)
    assert run("sweep", study, "--out", tmp_path / "out", "--jobs", 1) == 3
    assert "No space left on device" in capsys.readouterr().err.splitlines()[-1]


def test_a_sweep_that_broke_off_goes_on_and_says_so(study, tmp_path, capsys, monkeypatch):
    from fastncm.sweeping import backends, store

    out = tmp_path / "out"
    run_task = backends.run_task

    def stops(task):
        if 4 in task.case_ids:
            raise KeyboardInterrupt
        return run_task(task)

    with monkeypatch.context() as patch:
        patch.setattr(backends, "run_task", stops)
        patch.setattr(store, "PART_BYTES", 1)
        assert run("sweep", study, "--out", out, "--jobs", 1) == 130
    kept = len(load(out))
    assert 0 < kept < 6
    assert f"interrupted; {kept} of 6 cases are in {out}" in capsys.readouterr().err
    assert run("status", out) == 0
    printed = capsys.readouterr().out
    assert f"study: interrupted, {kept} of 6 cases in the table" in printed
    assert "the same sweep command solves the cases that are missing" in printed
    assert run("sweep", study, "--out", out, "--jobs", 1) == 0
    assert f"{kept} cases were in the table already" in capsys.readouterr().out
    assert len(load(out)) == 6


def test_parts_of_an_interrupted_sweep_can_be_joined(study, tmp_path, capsys, monkeypatch):
    from fastncm.sweeping import store

    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(store, "PART_BYTES", 1)
        patch.setattr(store, "compact", lambda _: [])
        assert run("sweep", study, "--out", out, "--jobs", 1) == 0
    before = load(out)
    capsys.readouterr()
    assert run("compact", out) == 0
    assert capsys.readouterr().out == "2 files before, 1 now\n"
    pd.testing.assert_frame_equal(load(out), before)
    (part,) = (out / "cases").glob("part-*")
    part.write_bytes(part.read_bytes()[:-1])
    assert run("compact", out) == 2
    assert "not a whole Parquet file" in capsys.readouterr().err
