"""A sweep on disk: the table, its metadata, whose folder it is, and what is left when it breaks."""

import json
import os
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from fastncm.errors import SceneError, SweepError
from fastncm.scene import load_scene
from fastncm.sweeping import BrokenOff, Report, Study, backends, folder, load, store, sweep
from fastncm.sweeping.manifest import read_manifest
from fastncm.sweeping.read import GOOD_STATUS, best_designs
from fastncm.sweeping.storage import Storage

CIRCLE = load_scene("snapfit-circle")


def part_files(folder):
    return sorted(folder.glob("part-*.parquet"))


def small_study(**options):
    axes = {
        "jaw.height": np.linspace(0.0069, 0.0109, 5),
        "finger.thickness": [0.0022, 0.0032, 0.0042],
        "friction.mu": [0.0, 0.2],
    }
    return Study(CIRCLE, axes, name="small", **options)


def wide_study(jaws=3000, **options):
    return Study(CIRCLE, {"jaw.height": {"linspace": [0.0069, 0.0109, jaws]}}, "wide", **options)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A small sweep with curves, in one process."""
    out = tmp_path_factory.mktemp("finished") / "out"
    return sweep(small_study(curves=True), out, jobs=1)


def test_the_table_has_one_row_per_case_in_order(finished):
    frame = load(finished.out)
    assert finished.rows == len(frame) == 30
    assert frame["case_id"].tolist() == list(range(30))
    columns = small_study().cases.columns(np.arange(30))
    for name, values in columns.items():
        assert frame[name].tolist() == values.tolist()
    assert set(frame["status"]) <= set(GOOD_STATUS)
    assert finished.failed == 0
    assert finished.shape_paths == 10  # jaws x friction
    names = "case_id status peak_force_N peak_position max_strain insertion_work_J error_estimate"
    assert set(f"{names} positions iterations".split()) <= set(frame)


def test_curves_are_sorted_by_case_and_run_along_the_path(finished):
    curves = load(finished.out, "curves")
    assert len(curves) == 30 * CIRCLE.path.steps
    assert curves["case_id"].is_monotonic_increasing
    for _, curve in curves.groupby("case_id"):
        assert (np.diff(curve["position"]) < 0).all()
    peaks = curves.groupby("case_id")["insertion_force_N"].max()
    located = load(finished.out)["peak_force_N"]
    assert (peaks <= located * (1 + 1e-12)).all()
    assert (peaks > 0.9 * located).all()


def test_units_and_the_full_study_are_in_the_files(finished):
    schema = pq.read_schema(part_files(finished.out / "cases")[0])
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert units["peak_force_N"] == "N"
    assert units["finger.thickness"] == units["peak_position"] == "m"
    assert units["friction.mu"] == units["case_id"] == "1"
    assert units == load(finished.out).attrs["units"]
    written = json.loads(schema.metadata[b"study"])
    assert written == json.loads(json.dumps(small_study(curves=True).to_dict()))
    assert Study.from_dict(written).to_dict() == small_study(curves=True).to_dict()
    assert {"fastncm", "numba", "python"} <= set(json.loads(schema.metadata[b"versions"]))
    curves = pq.read_schema(part_files(finished.out / "curves")[0])
    assert curves.field("tip_angle_rad").metadata[b"unit"] == b"rad"
    assert curves.metadata[b"study"] == schema.metadata[b"study"]


def test_single_cases_can_be_loaded(finished):
    assert load(finished.out, case_ids=[7, 3])["case_id"].tolist() == [3, 7]
    assert set(load(finished.out, "curves", case_ids=[7])["case_id"]) == {7}


def test_what_is_not_there_cannot_be_loaded(finished, tmp_path):
    with pytest.raises(SweepError, match="no table 'curve'"):
        load(finished.out, "curve")
    with pytest.raises(SweepError, match="holds no sweep"):
        load(tmp_path)
    sweep(wide_study(2), tmp_path / "out", jobs=1)
    with pytest.raises(SweepError, match="curves = true"):
        load(tmp_path / "out", "curves")


def test_temporary_files_are_no_part_of_the_table(finished):
    stray = finished.out / "cases" / ".part-00007.parquet.tmp"
    stray.write_bytes(b"half a file")
    try:
        assert len(load(finished.out)) == 30
    finally:
        stray.unlink()


def test_best_designs_keep_the_limits(finished):
    frame = load(finished.out)
    limit = frame["max_strain"].median()
    report = Report("peak_force_N", "max", {"max_strain": limit})
    best = best_designs(Storage(finished.out), report, 4)
    allowed = frame[frame["max_strain"] <= limit].sort_values("peak_force_N", ascending=False)
    assert best["case_id"].tolist() == allowed["case_id"].head(4).tolist()
    assert finished.best(3)["peak_force_N"].tolist() == sorted(frame["peak_force_N"])[:3]


def test_the_table_does_not_depend_on_parts_tasks_and_workers(tmp_path, monkeypatch):
    study = wide_study()
    one = sweep(study, tmp_path / "one", jobs=1)
    monkeypatch.setattr(backends, "WORKER_START_SECONDS", 0.0)
    monkeypatch.setattr(backends, "FIRST_ROWS", 16)
    monkeypatch.setattr(backends, "MEASURED_SECONDS", 1e-4)
    monkeypatch.setattr(backends.Pace, "rows_in_task", 100)
    monkeypatch.setattr(store, "PART_BYTES", 10_000)
    monkeypatch.setattr(store, "compact", lambda _: [])
    many = sweep(study, tmp_path / "many", jobs=2)
    assert len(part_files(many.out / "cases")) > 3
    assert (many.rows, many.failed, many.shape_paths) == (one.rows, one.failed, one.shape_paths)
    assert not list((many.out / "cases").glob(".*"))
    rounded = ["error_estimate", "iterations"]  # they see the rounding of the last step
    # The workers' code comes from the cache, this process may have just compiled its own: the two
    # differ in the last bit, and in the work of three jaws by 2.4e-12.
    pd.testing.assert_frame_equal(
        load(many.out).drop(columns=rounded),
        load(one.out).drop(columns=rounded),
        rtol=1e-11,
        atol=0,
    )


def test_words_switches_and_pairs_may_be_axes(tmp_path):
    axes = {
        "model.shear": [False, True],
        "finger.thickness": [[0.0036, 0.0028], 0.0032],
        "path.start": ["touch", 0.0760],
        "solver.order": [4, 6],
    }
    frame = load(sweep(Study(CIRCLE, axes), tmp_path / "out", jobs=1).out)
    assert len(frame) == 16
    assert set(frame["status"]) == {"converged"}
    assert frame["model.shear"].tolist() == [False] * 8 + [True] * 8
    assert set(frame["path.start"]) == {"touch", "0.076"}
    assert frame["solver.order"].dtype == np.int64


def test_a_path_that_never_touches_is_a_result(tmp_path):
    study = Study(CIRCLE, {"path.y": [0.0105, 0.030]})
    run = sweep(study, tmp_path / "out", jobs=1)
    assert load(run.out)["status"].tolist() == ["converged", "no_contact"]
    assert run.failed == 0


def files_of(folder):
    return {path: (path.stat().st_mtime_ns, path.stat().st_size) for path in folder.rglob("*")}


def test_another_study_is_refused_and_nothing_is_touched(finished):
    before = files_of(finished.out)
    for other in (wide_study(), small_study(curves=False)):
        with pytest.raises(SweepError, match="another study .'small'.*nothing was touched"):
            sweep(other, finished.out, jobs=1)
    assert files_of(finished.out) == before


def test_the_refusal_shows_the_difference(finished):
    axes = dict(small_study().axes) | {"friction.mu": [0.0, 0.3]}
    other = Study(CIRCLE.replace({"finger.width": 0.01}), axes, name="small", curves=True)
    with pytest.raises(SweepError) as error:
        sweep(other, finished.out, jobs=1)
    assert "scene.finger.width is 0.0095 there, 0.01 here" in str(error.value)
    assert "axes.'friction.mu' is [0.0, 0.2] there, [0.0, 0.3] here" in str(error.value)
    assert "jaw.height" not in str(error.value)


def test_another_solver_is_another_table(finished, monkeypatch):
    monkeypatch.setattr(folder, "solver_version", lambda: "0" * 16)
    with pytest.raises(SweepError, match="solver's version is .* there, 0000"):
        sweep(small_study(curves=True), finished.out, jobs=1)


def test_a_foreign_folder_is_refused_and_nothing_is_touched(tmp_path):
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "part-00000.parquet").write_bytes(b"mine")
    before = files_of(tmp_path)
    with pytest.raises(SweepError, match="nothing was touched"):
        sweep(wide_study(2), tmp_path, jobs=1)
    assert files_of(tmp_path) == before


def test_a_complete_study_is_left_alone_and_reported_anew(finished):
    before = files_of(finished.out)
    again = sweep(small_study(curves=True, report=Report("max_strain", "max")), finished.out)
    assert not again.fresh
    assert (again.rows, again.shape_paths) == (finished.rows, finished.shape_paths)
    assert again.best(1)["max_strain"][0] == load(finished.out)["max_strain"].max()
    assert files_of(finished.out) == before


def test_bad_input_writes_nothing(tmp_path):
    out = tmp_path / "out"
    for axes in ({"friction.mu": [0.1, -0.1]}, {"friction.nu": [0.1]}, {"friction.mu": []}, {}):
        with pytest.raises(SceneError):
            sweep(Study(CIRCLE, axes), out)
    with pytest.raises(SweepError, match="jobs"):
        sweep(wide_study(2), out, jobs=0)
    assert not out.exists()


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(SweepError, match="is a file"):
        sweep(wide_study(2), tmp_path / "file", jobs=1)
    with pytest.raises(SweepError, match="cannot write to .*[Nn]ot a directory"):
        sweep(wide_study(2), tmp_path / "file" / "out", jobs=1)


def test_a_disk_that_fills_up_leaves_the_finished_parts(tmp_path, monkeypatch):
    """The limit on the size of a file stands for the full disk: a real refusal of the system."""
    out = tmp_path / "out"
    monkeypatch.setattr(store, "PART_BYTES", 1)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(
            BrokenOff, match="cannot write to .*: File too large; .*finished cases stay"
        ) as error:
            sweep(wide_study(), out, jobs=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    frame = load(out)
    assert 0 < len(frame) < 3000
    assert f"{len(frame)} finished cases" in str(error.value)
    assert not list((out / "cases").glob(".*"))

    monkeypatch.undo()
    assert sweep(wide_study(), out, jobs=1).rows == len(load(out)) == 3000


def test_a_write_that_fails_leaves_no_half_part(tmp_path, monkeypatch):
    write = Storage.write

    def breaks_off(stream):
        stream.write(b"PAR1 and no more")
        raise OSError(28, "No space left on device")

    def half(self, name, whole):
        write(self, name, breaks_off if name.startswith("cases/") else whole)

    monkeypatch.setattr(Storage, "write", half)
    with pytest.raises(BrokenOff, match="No space left on device"):
        sweep(wide_study(2), tmp_path / "out", jobs=1)
    assert list((tmp_path / "out" / "cases").iterdir()) == []


@pytest.mark.compiled
def test_ctrl_c_leaves_a_readable_table(tmp_path, finished):
    """As in a terminal: the signal reaches the workers, too. `finished` has compiled the code."""
    study = tmp_path / "study.toml"
    study.write_text(
        "scene = 'snapfit-circle'\n[axes]\n'jaw.height' = { linspace = [0.0069, 0.0109, 1000000] }"
    )
    out = tmp_path / "out"
    command = [sys.executable, "-m", "fastncm", "sweep", str(study), "--out", str(out)]
    with subprocess.Popen(
        [*command, "--jobs", "2"],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
        text=True,
        # a shell's background job ignores the signal, and so would its children
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        while not ((out / "study.json").exists() and read_manifest(Storage(out)).received):
            assert process.poll() is None
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        stdout, stderr = process.communicate(timeout=20)
    frame = load(out)
    assert process.returncode == 130
    assert 0 < len(frame) < 1_000_000
    assert frame["case_id"].is_unique
    assert stderr.splitlines()[-1] == (
        f"fastncm: interrupted; {len(frame)} of 1000000 cases are in {out}"
    )
    assert "Traceback" not in stderr
    assert stdout == ""
