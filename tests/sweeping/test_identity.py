"""A case's identity: equal parameters, equal key; anything else, another one."""

import subprocess
import sys

import numpy as np

from fastncm.scene import load_scene, tabulate
from fastncm.sweeping import identity
from fastncm.sweeping.identity import case_keys, solver_version

CIRCLE = load_scene("snapfit-circle")


def keys_of(scene, columns):
    return case_keys(tabulate(scene, columns))


def key(scene, **columns):
    values = {name.replace("_", ".", 1): np.array([v]) for name, v in columns.items()}
    return int(keys_of(scene, values or {"friction.mu": np.array([scene.friction.mu])})[0])


def test_a_case_is_the_same_however_it_is_written():
    plain = key(CIRCLE.replace({"jaw.height": 0.0080, "friction.mu": 0.2}))
    assert key(CIRCLE, jaw_height=0.0080, friction_mu=0.2) == plain
    assert key(CIRCLE.replace({"friction.mu": 0.2}), jaw_height=0.0080) == plain
    point = CIRCLE.replace({"jaw.height": 0.0080}).jaw.a
    column = np.empty(1, dtype=object)
    column[0] = point
    one = keys_of(CIRCLE, {"jaw.a": column, "friction.mu": np.array([0.2])})
    assert int(one[0]) == plain
    assert key(CIRCLE, friction_mu=0.0) == key(CIRCLE, friction_mu=-0.0) == key(CIRCLE)


def test_any_other_value_is_another_case():
    others = [
        {"jaw.height": 0.0080},
        {"finger.thickness": 0.0033},
        {"finger.thickness": (0.0032, 0.0033)},
        {"finger.thickness": (0.0033, 0.0032)},
        {"friction.mu": 1e-300},
        {"path.steps": 61},
        {"path.start": 0.078},
        {"model.shear": True},
        {"solver.rtol": 1e-7},
        {"solver.order": 6},
    ]
    keys = {key(CIRCLE.replace(change)) for change in others} | {key(CIRCLE)}
    assert len(keys) == len(others) + 1
    assert min(keys) >= 0


def test_a_million_cases_have_a_million_keys():
    height, mu = np.meshgrid(np.linspace(0.0069, 0.0109, 1000), np.linspace(0.0, 0.4, 1000))
    keys = keys_of(CIRCLE, {"jaw.height": height.ravel(), "friction.mu": mu.ravel()})
    assert len(np.unique(keys)) == 1_000_000
    assert abs(np.mean(keys / 2.0**63) - 0.5) < 1e-3


def test_keys_do_not_depend_on_the_company():
    heights = np.linspace(0.0069, 0.0109, 11)
    orders = np.array([4, 6] * 5 + [4])
    together = keys_of(CIRCLE, {"jaw.height": heights, "solver.order": orders})
    alone = [
        keys_of(CIRCLE.replace({"solver.order": int(order)}), {"jaw.height": np.array([height])})
        for height, order in zip(heights, orders, strict=True)
    ]
    assert together.tolist() == np.concatenate(alone).tolist()


def test_keys_and_version_are_the_same_in_the_next_process():
    code = (
        "import numpy as np; from fastncm.scene import load_scene, tabulate\n"
        "from fastncm.sweeping.identity import case_keys, solver_version\n"
        "groups = tabulate(load_scene('snapfit-circle'), {'friction.mu': np.array([0.2])})\n"
        "print(solver_version(), case_keys(groups)[0])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [solver_version(), str(key(CIRCLE, friction_mu=0.2))]


def test_the_solver_version_follows_the_sources(tmp_path, monkeypatch):
    for name in ("kernels/gap.py", "cases.py", "plot/run.py", "cli/__init__.py"):
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text("x = 1\n")
    monkeypatch.setattr(identity, "_PACKAGE", tmp_path)
    version = identity.solver_version.__wrapped__
    before = version()
    (tmp_path / "plot" / "run.py").write_text("x = 2\n")
    assert version() == before
    for name in ("kernels/gap.py", "cases.py"):
        (tmp_path / name).write_text("x = 2\n")
        assert version() != before
        before = version()
