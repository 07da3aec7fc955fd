"""Sweeps that are killed, again and again: the final table is that of an undisturbed run.

The victims are forked from one process that has loaded everything (tests/victim.py), so that a
kill costs a tenth of a second.
"""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
import victim

from fastncm.sweeping import load
from fastncm.sweeping.parts import survey
from fastncm.sweeping.storage import Storage

KILLS = 50
pytestmark = pytest.mark.compiled


class Server:
    """The process that forks the victims."""

    def __init__(self, process):
        self.process = process

    def start(self, out, doom=None):
        self.process.stdin.write(json.dumps({"out": str(out), "doom": doom}) + "\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def end(self):
        self.process.stdin.write("wait\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())


@pytest.fixture(scope="module")
def server():
    command = [sys.executable, victim.__file__]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "ready\n"
        yield Server(process)
        process.stdin.close()


@pytest.fixture(scope="module")
def undisturbed(server, tmp_path_factory):
    """The tables of a run in peace, and how long it took."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    began = time.perf_counter()
    server.start(out)
    assert server.end() == 0
    seconds = time.perf_counter() - began
    return load(out), load(out, "curves"), seconds


def check(out, undisturbed):
    """Row for row, bit for bit the same, and nothing left lying about."""
    cases, curves, _ = undisturbed
    assert len(cases) == victim.CASES
    pd.testing.assert_frame_equal(load(out), cases, check_exact=True)
    pd.testing.assert_frame_equal(load(out, "curves"), curves, check_exact=True)
    files = {path.name for path in Path(out).rglob("*") if path.is_file()}
    assert not {name for name in files if name.endswith(".tmp")}
    named = {file.name for part in survey(Storage(out))[0] for file in part.facts.curves}
    assert {path.name for path in (Path(out) / "curves").iterdir()} == named
    assert len(pd.read_parquet(Path(out) / "cases")) == victim.CASES


def test_50_kills_at_random_moments_lose_and_double_nothing(tmp_path, server, undisturbed):
    moments = random.Random(20261122)
    whole_run = undisturbed[-1]
    killed, folders, interrupted = 0, 0, 0
    while killed < KILLS:
        out = tmp_path / f"out{folders}"
        while True:
            process = server.start(out)
            if killed < KILLS:
                time.sleep(moments.uniform(0.0, whole_run))
                os.kill(process, signal.SIGKILL)
            code = server.end()
            if code == 0:
                break
            assert code == -signal.SIGKILL
            killed += 1
            if (out / "cases").exists() and any((out / "cases").iterdir()):
                interrupted += 1
        check(out, undisturbed)
        folders += 1
    assert interrupted > KILLS // 3, "most kills should find a table begun"


def test_a_kill_after_any_operation_on_the_file_system(tmp_path, server, undisturbed):
    """Every one of them in turn, joining of parts included, until a run gets through."""
    life = 0
    while True:
        life += 1
        out = tmp_path / f"out{life}"
        server.start(out, doom=life)
        code = server.end()
        if code == 0:
            break
        assert code == -signal.SIGKILL
        server.start(out)
        assert server.end() == 0
        check(out, undisturbed)
    assert life > 15
