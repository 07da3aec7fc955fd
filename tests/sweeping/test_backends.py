"""Where tasks are solved makes no difference to the table, and a worker that dies none either."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager

import numpy as np
import pandas as pd
import pytest
from joblib.externals.loky import reusable_executor

from fastncm.errors import SweepError
from fastncm.scene import load_scene
from fastncm.sweeping import BrokenOff, Study, backends, load, pools, processes, store, sweep, tasks
from fastncm.sweeping.manifest import read_manifest
from fastncm.sweeping.storage import Storage

pytestmark = pytest.mark.compiled
CIRCLE = load_scene("snapfit-circle").replace({"path.steps": 12})
STUDY = Study(CIRCLE, {"jaw.height": {"linspace": [0.0069, 0.0109, 2400]}}, curves=True)
ROUNDED = ["error_estimate", "iterations", "kkt_residual"]


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Both tables, solved in this process."""
    out = sweep(STUDY, tmp_path_factory.mktemp("alone") / "out", jobs=1).out
    return load(out), load(out, "curves")


@pytest.fixture(autouse=True)
def small_tasks(monkeypatch):
    """Dozens of tasks, nearly all of them for the workers."""
    monkeypatch.setattr(backends, "WORKER_START_SECONDS", 0.0)
    monkeypatch.setattr(backends, "MEASURED_SECONDS", 0.0)
    monkeypatch.setattr(backends.Pace, "rows_in_task", 60)


def check(out, alone):
    """The same rows. Processes that compile and those that load differ in the last bits."""
    for frame, expected in zip((load(out), load(out, "curves")), alone, strict=True):
        pd.testing.assert_frame_equal(
            frame.drop(columns=ROUNDED, errors="ignore"),
            expected.drop(columns=ROUNDED, errors="ignore"),
            rtol=1e-11,
            atol=1e-14,
        )


def test_threads_give_the_same_table(tmp_path, alone):
    check(sweep(STUDY, tmp_path / "out", jobs=2, backend="threading").out, alone)


def test_a_long_sweep_goes_to_its_workers_at_once(tmp_path, alone, monkeypatch):
    def solved_here(_):
        raise AssertionError("the parent need not even load the compiled code")

    monkeypatch.setattr(backends, "run_task", solved_here)
    check(sweep(STUDY, tmp_path / "out", jobs=2).out, alone)


def kill_when(started, processes):
    """Kill -9 one of the processes when there is something to lose."""

    def wait_and_kill():
        while not started():
            time.sleep(0.002)
        os.kill(next(iter(processes())), signal.SIGKILL)

    thread = threading.Thread(target=wait_and_kill)
    thread.start()
    return thread


def loky_processes():
    executor = reusable_executor._executor
    return [] if executor is None else list(executor._processes or ())


def test_a_worker_process_that_is_killed_costs_nothing(tmp_path, alone):
    out = tmp_path / "out"
    add = tmp_path / "out" / "curves"
    thread = kill_when(
        lambda: loky_processes() and len(list(add.glob("part-*"))) > 8, loky_processes
    )
    run = sweep(STUDY, out, jobs=2)
    thread.join()
    check(run.out, alone)
    found = read_manifest(Storage(out)).run.found
    assert found == [
        "a worker process died (out of memory?); the cases it had in hand were solved again"
    ]


def test_workers_that_die_every_time_end_the_run(tmp_path, monkeypatch):
    def fatal(*_):
        raise pools.WorkersLost("a worker process died (out of memory?)")
        yield

    monkeypatch.setattr(backends, "received", fatal)
    monkeypatch.setattr(backends, "_is_long", lambda *_: False)  # the first blocks are solved here
    with pytest.raises(BrokenOff, match="worker process died.*finished cases stay readable"):
        sweep(STUDY, tmp_path / "out", jobs=2)
    monkeypatch.undo()
    kept = len(load(tmp_path / "out"))
    assert 0 < kept < 2400
    run = sweep(STUDY, tmp_path / "out", jobs=1)
    assert (run.resumed, run.rows) == (kept, 2400)


@contextmanager
def started_cluster(folder):
    """A scheduler and two workers on this machine: its address and the processes, the scheduler
    first."""
    pytest.importorskip("distributed")
    file = folder / "scheduler.json"
    environment = os.environ | {"DASK_DISTRIBUTED__ADMIN__LOG_FORMAT": "%(message)s"}

    def start(*arguments):
        command = [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]]
        return subprocess.Popen(
            command,
            cwd=folder,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    with ExitStack() as stack:
        local = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
        processes = [start("dask_scheduler", *local, "--scheduler-file", str(file))]
        while not file.exists():
            time.sleep(0.02)
            assert processes[0].poll() is None
        address = json.loads(file.read_text())["address"]
        for _ in range(2):
            processes.append(
                start("dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
            )
        for process in processes:
            stack.enter_context(process)
            stack.callback(process.kill)
        yield address, processes


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A cluster for all tests that leave its scheduler alive: its address and the workers."""
    with started_cluster(tmp_path_factory.mktemp("cluster")) as (address, processes):
        yield address, processes[1:]


def test_a_cluster_gives_the_same_table_though_a_worker_is_killed(tmp_path, alone, cluster):
    address, workers = cluster
    out = tmp_path / "out"
    thread = kill_when(
        lambda: len(list((out / "curves").glob("part-*"))) > 8, lambda: [workers[0].pid]
    )
    run = sweep(STUDY, out, backend="dask", scheduler=address)
    thread.join()
    check(run.out, alone)
    assert workers[0].wait() == -signal.SIGKILL
    assert workers[1].poll() is None


def test_a_scheduler_that_falls_silent_is_given_up(tmp_path, alone, monkeypatch):
    """As one behind a network that was cut: no connection ends, and nothing comes any more."""
    monkeypatch.setattr(pools, "SILENT_SECONDS", 20.0)  # a worker's first task takes some
    monkeypatch.setattr(backends, "HELD_BYTES", 0)  # eight tasks, then those that never come back
    out = tmp_path / "out"
    add = store.Store.add
    with started_cluster(tmp_path) as (address, processes):

        def add_and_cut(self, finished):
            add(self, finished)
            processes[0].send_signal(signal.SIGSTOP)

        monkeypatch.setattr(store.Store, "add", add_and_cut)
        with pytest.raises(BrokenOff, match="nothing came back from the cluster for 20 s.*goes on"):
            sweep(STUDY, out, backend="dask", scheduler=address)
    monkeypatch.undo()
    assert 0 < len(load(out)) < 2400
    check(sweep(STUDY, out, jobs=1).out, alone)


def test_workers_of_an_own_cluster_give_the_same_table(tmp_path, alone):
    pytest.importorskip("distributed")
    check(sweep(STUDY, tmp_path / "out", jobs=2, backend="dask").out, alone)


PARENT = """
import sys
from fastncm.sweeping import backends, store, sweep
from test_backends import STUDY
backends.WORKER_START_SECONDS = backends.MEASURED_SECONDS = 0.0
backends.Pace.rows_in_task = 60
store.PART_BYTES = 1
sweep(STUDY, sys.argv[1], jobs=2)
"""


def test_a_parent_that_is_killed_takes_its_workers_along(tmp_path, alone):
    psutil = pytest.importorskip("psutil")
    out = tmp_path / "out"
    here = os.path.dirname(__file__)
    (tmp_path / "tmp").mkdir()
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([here, *sys.path]),
        "TMPDIR": str(tmp_path / "tmp"),
    }
    command = [sys.executable, "-c", PARENT, str(out)]
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as process:
        while len(list((out / "curves").glob("part-*"))) <= 8:
            assert process.poll() is None
            time.sleep(0.002)
        workers = psutil.Process(process.pid).children(recursive=True)
        process.kill()
    assert len(workers) >= 2
    assert not psutil.wait_procs(workers, timeout=20)[1]
    assert not list((tmp_path / "tmp").glob("fastncm-*"))
    assert len(load(out)) < 2400
    check(sweep(STUDY, out, jobs=1).out, alone)


def test_on_each_host_one_worker_compiles_while_the_others_wait(tmp_path, monkeypatch):
    monkeypatch.setattr(tasks, "JIT_OFF", False)
    monkeypatch.setattr(tasks, "cache_directory", lambda: tmp_path)
    task = tasks.make_task(STUDY, np.arange(2), {})
    inside, most = [], []

    def first_task():
        with tasks._one_compiles(task):
            if not list(tmp_path.glob("*.ready")):  # this one compiles
                inside.append(1)
                most.append(len(inside))
                time.sleep(0.05)
                inside.pop()

    threads = [threading.Thread(target=first_task) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1]
    assert len(list(tmp_path.glob("*.ready"))) == 1


def test_what_a_task_carries_is_parameters_and_what_it_returns_columns(alone):
    import pickle

    wide = Study(CIRCLE, {"jaw.height": {"linspace": [0.0069, 0.0109, 100_000]}})
    task = tasks.make_task(wide, np.arange(50), {})
    assert len(pickle.dumps(task)) < 50 * 8 * 2 + 4000
    finished = tasks.run_task(task)
    assert len(pickle.dumps(finished)) < 50 * 8 * 16 + 4000
    assert "jaw.height" not in finished.results.column_names


def test_a_place_for_results_that_is_full_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "_watch_parent", lambda: None)
    task = tasks.make_task(STUDY, np.arange(2), {})
    name = processes.run_in_process(task, str(tmp_path))
    assert processes.collect(name).case_ids.tolist() == [0, 1]
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SweepError, match="cannot write to .*TMPDIR"):
        processes.run_in_process(task, str(tmp_path / "none"))


def test_a_worker_with_another_solver_refuses(monkeypatch):
    task = tasks.make_task(STUDY, np.arange(2), {})
    monkeypatch.setattr(tasks, "solver_version", lambda: "another")
    with pytest.raises(SweepError, match="another version of fastncm"):
        tasks.run_in_worker(task)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"backend": "mpi"}, "'mpi'.*loky, threading, dask"),
        ({"scheduler": "tcp://127.0.0.1:1"}, "only with backend 'dask'"),
        ({"jobs": 0}, "at least 1"),
    ],
)
def test_workers_that_do_not_exist_are_refused(tmp_path, options, words):
    with pytest.raises(SweepError, match=words):
        sweep(STUDY, tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_a_scheduler_that_does_not_answer_is_an_error(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(pools, "PATIENCE", 0.2)
    with pytest.raises(
        SweepError, match="no Dask cluster with workers answers at tcp://127.0.0.1:1"
    ):
        sweep(STUDY, tmp_path / "out", backend="dask", scheduler="tcp://127.0.0.1:1")
