"""One run at a time in a folder, and what `status` says of the one that is or was there."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest

from fastncm.errors import SweepError
from fastncm.scene import load_scene
from fastncm.sweeping import Study, folder, load, lock, store, sweep
from fastncm.sweeping.file_locks import try_lock
from fastncm.sweeping.lock import is_running, sole_run
from fastncm.sweeping.manifest import read_manifest, write_manifest
from fastncm.sweeping.status import describe
from fastncm.sweeping.storage import Storage

CIRCLE = load_scene("snapfit-circle").replace({"path.steps": 10})
STUDY = Study(CIRCLE, {"jaw.height": {"linspace": [0.0069, 0.0109, 40]}})
HOLDER = """
import sys, time
from fastncm.sweeping.lock import sole_run
from fastncm.sweeping.storage import Storage
with sole_run(Storage(sys.argv[1])):
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def finished(tmp_path):
    return sweep(STUDY, tmp_path / "out", jobs=1).out


@pytest.fixture
def holder(finished):
    """Another process that holds the folder of a sweep which is not complete."""
    state(finished, "running")
    command = [sys.executable, "-c", HOLDER, str(finished)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def state(out, word, age=0.0, host=None):
    """Pretend that the folder's last run was left in this state."""
    storage = Storage(out)
    manifest = read_manifest(storage)
    manifest.state = word
    manifest.run.host = host or manifest.run.host
    now = time.time
    try:
        time.time = lambda: now() - age
        write_manifest(storage, manifest)
    finally:
        time.time = now


def test_a_second_run_is_refused_while_the_first_one_lives(finished, holder, monkeypatch):
    monkeypatch.setattr(lock, "PATIENCE_SECONDS", 0.1)
    before = {path: path.stat().st_mtime_ns for path in finished.rglob("*")}
    with pytest.raises(SweepError, match=rf"process {os.getpid()} on .* since 20"):
        sweep(STUDY, finished, jobs=1)
    assert {path: path.stat().st_mtime_ns for path in finished.rglob("*")} == before
    assert "running" in describe(Storage(finished))[0]


def test_the_lock_of_a_dead_run_is_not_in_the_way(finished, holder):
    assert is_running(Storage(finished), read_manifest(Storage(finished)))
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert not is_running(Storage(finished), read_manifest(Storage(finished)))
    assert "died" in describe(Storage(finished))[0]
    assert sweep(STUDY, finished, jobs=1).rows == 40


def test_two_runs_at_once_give_one_table(tmp_path, monkeypatch):
    """Whichever comes second is refused or finds the work done."""
    add = store.Store.add

    def slowly(self, finished):
        add(self, finished)
        time.sleep(0.05)

    monkeypatch.setattr(store.Store, "add", slowly)
    monkeypatch.setattr(lock, "PATIENCE_SECONDS", 0.02)
    outcomes = []

    def run():
        try:
            outcomes.append(sweep(STUDY, tmp_path / "out", jobs=1).rows)
        except SweepError as error:
            outcomes.append(str(error))

    threads = [threading.Thread(target=run) for _ in range(3)]
    for thread in threads:
        thread.start()
        time.sleep(0.02)
    for thread in threads:
        thread.join()
    assert 40 in outcomes
    assert all(outcome == 40 or "another run" in outcome for outcome in outcomes)
    assert any(outcome != 40 for outcome in outcomes)
    assert load(tmp_path / "out")["case_id"].tolist() == list(range(40))


def test_looking_at_a_folder_does_not_refuse_a_run(finished, monkeypatch):
    """`status` takes the lock for a moment."""
    state(finished, "interrupted")
    descriptor = os.open(finished / lock.LOCK, os.O_RDONLY)
    assert try_lock(descriptor, shared=True)
    threading.Timer(0.1, os.close, [descriptor]).start()
    assert sweep(STUDY, finished, jobs=1).rows == 40


def test_without_locks_the_manifest_is_the_lock(finished, tmp_path):
    """As on an object store: nobody but the manifest says that a run is alive."""
    pytest.importorskip("fsspec")
    out = f"memory://{tmp_path.name}/out"
    sweep(STUDY, out, jobs=1)
    storage = Storage(out)
    state(out, "running")
    assert is_running(storage, read_manifest(storage))
    with pytest.raises(SweepError, match="another run is writing.*try again in 60 seconds"):
        sweep(STUDY, out, jobs=1)
    state(out, "running", age=100.0)
    assert not is_running(storage, read_manifest(storage))
    assert sweep(STUDY, out, jobs=1).rows == 40


def test_of_two_runs_that_begin_at_once_without_locks_one_gives_way(tmp_path, monkeypatch):
    pytest.importorskip("fsspec")
    written = folder.write_manifest

    def overtaken(storage, manifest):
        written(storage, manifest)
        manifest = read_manifest(storage)
        manifest.run.token = "another"
        written(storage, manifest)

    monkeypatch.setattr(folder, "write_manifest", overtaken)
    with pytest.raises(SweepError, match="another run has just begun"):
        sweep(STUDY, f"memory://{tmp_path.name}/out", jobs=1)


def test_status_from_another_machine_that_sees_no_locks(finished):
    """The host is another one and the manifest is fresh: alive; long not renewed: dead."""
    storage = Storage(finished)
    state(finished, "running", host="elsewhere")
    assert is_running(storage, read_manifest(storage))
    state(finished, "running", age=100.0, host="elsewhere")
    assert not is_running(storage, read_manifest(storage))


def test_status_tells_of_a_run_at_work(tmp_path, monkeypatch):
    """Asked in the middle, from the outside: rows in the table, rows on their way."""
    told = []
    add = store.Store.add

    def asked(self, finished):
        add(self, finished)
        self.renew()
        told.append("\n".join(describe(self.storage)))

    monkeypatch.setattr(store.Store, "add", asked)
    monkeypatch.setattr(store, "PART_BYTES", 1)
    sweep(STUDY, tmp_path / "out", jobs=1)
    assert "study: running, 1 of 40 cases in the table" in told[0]
    assert f"process {os.getpid()} on {os.uname().nodename}" in told[0]
    assert "0 cases solved and not yet written, 39 to be solved" in told[0]
    assert "complete, 40 of 40" in describe(Storage(tmp_path / "out"))[0]


def test_a_folder_without_its_lock_file_is_a_sweep_all_the_same(finished, tmp_path):
    """Copied from elsewhere, for example."""
    shutil.copytree(finished, tmp_path / "copy")
    (tmp_path / "copy" / lock.LOCK).unlink()
    assert "complete" in describe(Storage(tmp_path / "copy"))[0]
    assert not sweep(STUDY, tmp_path / "copy", jobs=1).fresh


def test_the_lock_is_let_go(finished):
    with sole_run(Storage(finished)):
        pass
    with sole_run(Storage(finished)):
        pass
