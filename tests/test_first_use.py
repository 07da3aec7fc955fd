"""What the first use compiles, and what it says."""

import subprocess
import sys

import pytest

import fastncm
from fastncm import first_use

SCENES = {
    first_use.LANES: {"path.steps": 3},
    first_use.SQP: {"path.steps": 3, "solver.contact": "points-on-finger"},
}


PROGRAM = """
import fastncm
from fastncm import first_use
from fastncm.kernels.basis import _fill_profiles
from fastncm.path import careful, reduce, run, touch

first_use.compile_alone({entry!r})
first_use._compile_rest()
for shear in (False, True):
    scene = fastncm.load_scene("snapfit-circle").replace({changes!r})
    fastncm.solve(scene.replace({{"model.shear": shear}}))
main = run._run_lanes if {entry!r} == first_use.LANES else careful._trace
for function in (main, _fill_profiles, reduce.summarise, touch._find):
    print(len(function.signatures))
"""


@pytest.mark.compiled
@pytest.mark.parametrize("entry", SCENES)
def test_what_is_compiled_for_no_designs_serves_all(entry: str) -> None:
    """Else it would be compiled again for the first ones."""
    program = PROGRAM.format(entry=entry, changes=SCENES[entry])
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["1", "1", "1", "1"]


class Elsewhere:
    """Stands for the process that compiles."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def wait(self) -> None:
        self.calls.append("wait")

    def kill(self) -> None:
        self.calls.append("kill")


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> dict[str, Elsewhere]:
    """The processes that are started for a package without machine code, by entry."""
    processes: dict[str, Elsewhere] = {}
    monkeypatch.setattr(first_use, "is_compiled", lambda entry: False)
    monkeypatch.setattr(
        first_use, "_compile_elsewhere", lambda entry: processes.setdefault(entry, Elsewhere())
    )
    return processes


@pytest.mark.parametrize("entry", SCENES)
def test_a_second_process_compiles_what_the_scene_needs(
    entry: str, started: dict[str, Elsewhere], capsys: pytest.CaptureFixture[str]
) -> None:
    first_use.prepare(fastncm.load_scene("snapfit-circle").replace(SCENES[entry]))
    assert {name: process.calls for name, process in started.items()} == {entry: ["wait", "kill"]}
    assert "first use only" in capsys.readouterr().err


def test_direct_contact_is_one_function(
    started: dict[str, Elsewhere], capsys: pytest.CaptureFixture[str]
) -> None:
    first_use.prepare(fastncm.load_scene("rubber-ellipse"))
    assert not started
    assert "first use only" in capsys.readouterr().err


def test_an_interrupt_stops_the_second_process(
    started: dict[str, Elsewhere], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(first_use, "_compile_rest", interrupted)
    with pytest.raises(KeyboardInterrupt):
        first_use.prepare(fastncm.load_scene("snapfit-circle"))
    assert started[first_use.LANES].calls == ["kill"]


def test_nothing_is_said_where_machine_code_is_there(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(first_use, "is_compiled", lambda entry: True)
    first_use.prepare(fastncm.load_scene("snapfit-circle"))
    assert capsys.readouterr().err == ""
