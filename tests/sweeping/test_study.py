"""Study files: what they mean, and that what is wrong is named with file and line."""

import numpy as np
import pytest

from fastncm.errors import SceneError
from fastncm.scene import load_scene
from fastncm.sweeping import Report, Study, load_study

GOOD = """\
scene = "snapfit-circle"
[set]
friction.mu = 0.2
"jaw.height" = 0.0080
[axes]
"finger.thickness" = { linspace = [0.0022, 0.0042, 5] }
"finger.young" = { geomspace = [1e9, 4e9, 3] }
"solver.order" = [4, 6]
"jaw.a" = [[0.057, 0.0105], [0.057, 0.0115]]
[output]
curves = true
[report]
column = "max_strain"
best = "max"
limits = { peak_force_N = 5.0 }
"""


def write(folder, text):
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_a_study_file_is_read_as_written(tmp_path):
    study = load_study(write(tmp_path, GOOD))
    assert study.name == "mine"
    assert study.scene.friction.mu == 0.2
    assert study.scene.jaw.height == pytest.approx(0.0080, rel=1e-15)
    assert list(study.cases.axes) == [
        "finger.thickness",
        "finger.young",
        "solver.order",
        "jaw.a",
    ]
    np.testing.assert_array_equal(
        study.cases.axes["finger.thickness"], np.linspace(0.0022, 0.0042, 5)
    )
    np.testing.assert_array_equal(study.cases.axes["finger.young"], np.geomspace(1e9, 4e9, 3))
    assert study.cases.axes["solver.order"].tolist() == [4, 6]
    assert study.cases.size == 60
    assert study.curves
    assert study.report == Report("max_strain", "max", {"peak_force_N": 5.0})


def test_axes_may_be_written_without_quotes_or_as_tables(tmp_path):
    plain = 'scene = "snapfit-circle"\n[axes]\njaw.height = [0.008]\nfriction.mu = [0, 0.1]\n'
    tables = (
        'scene = "snapfit-circle"\n[axes.jaw]\nheight = [0.008]\n[axes.friction]\nmu = [0, 0.1]\n'
    )
    one, other = (load_study(write(tmp_path, text)) for text in (plain, tables))
    assert one.to_dict() == other.to_dict()
    assert list(one.cases.axes) == ["jaw.height", "friction.mu"]


def test_a_scene_file_is_looked_for_beside_the_study(tmp_path, monkeypatch):
    (tmp_path / "own").mkdir()
    source = load_scene("snapfit-corner")
    text = ['name = "own"']
    for section, values in source.to_dict().items():
        if isinstance(values, dict):
            text.append(f"[{section}]")
            text += [f"{key} = {toml(value)}" for key, value in values.items()]
    (tmp_path / "own" / "scene.toml").write_text("\n".join(text))
    path = tmp_path / "study.toml"
    path.write_text('scene = "own/scene.toml"\n[axes]\n"jaw.height" = [0.007]\n')
    monkeypatch.chdir("/")
    assert load_study(path).scene.jaw == source.jaw


def toml(value):
    return str(value).lower() if isinstance(value, bool) else repr(value).replace("'", '"')


def test_a_study_survives_its_dictionary(tmp_path):
    study = load_study(write(tmp_path, GOOD))
    again = Study.from_dict(study.to_dict())
    assert again.to_dict() == study.to_dict()
    ids = np.arange(study.cases.size)
    for one, other in zip(
        study.cases.columns(ids).values(), again.cases.columns(ids).values(), strict=True
    ):
        assert one.tolist() == other.tolist()


@pytest.mark.parametrize(
    ("line", "text", "words"),
    [
        (4, '\n[axes]\n"jaw.height" = [', "Invalid value"),
        (6, "[axes]\n'friction.mu' = [0.1]\n\n\n'jaw.hieght' = [0.008]", "'jaw.height'"),
        (3, "[axes]\n'friction.mu' = []", "empty"),
        (3, "[axes]\n'friction.mu' = { linspace = [0, 1, 0] }", "empty"),
        (3, "[axes]\n'friction.mu' = { linspace = [0, 1] }", "linspace"),
        (3, "[axes]\n'friction.mu' = { linspace = [0, 1, 2.5] }", "linspace"),
        (3, "[axes]\n'friction.mu' = { linspace = [0, 1, -1] }", "a whole number from 1 to"),
        (3, "[axes]\n'friction.mu' = { linspace = [0, 1, 1e15] }", "a whole number from 1 to"),
        (3, "[axes]\n'friction.mu' = { uniform = [0, 1] }", "a [design] that is drawn"),
        (3, "[axes]\n'friction.mu' = { logspace = [0, 1, 2] }", "geomspace"),
        (3, "[axes]\n'friction.mu' = { geomspace = [0, 1, 2] }", "geomspace"),
        (3, "[axes]\n'friction.mu' = 0.2", "list"),
        (3, "[axes]\n'friction.mu' = [0.1, -0.1]", "-0.1 (case 1)"),
        (3, "[axes]\n'friction.mu' = [0.1, true]", "True (case 1)"),
        (3, "[axes]\n'friction.mu' = [0.1, 'much']", "'much' (case 1)"),
        (3, "[axes]\n'friction.mu' = [0.1, nan]", "nan (case 1)"),
        (3, "[axes]\n'finger.poisson' = [0.3, 0.5]", "0.5 (case 1)"),
        (3, "[axes]\n'jaw.radius' = [0.3]", "jaw.radius"),
        (3, "[axes]\n'target.semi_axes' = [[0.1, 0.2]]", "does not belong"),
        (2, "axes = 3", "table"),
        (3, "[set]\n'finger.thickness' = -1.0\n[axes]\n'friction.mu' = [0]", "-1.0"),
        (3, "[output]\ncurve = true\n[axes]\n'friction.mu' = [0]", "'curves'"),
        (3, "[output]\ncurves = 'yes'\n[axes]\n'friction.mu' = [0]", "true or false"),
        (3, "[report]\ncolumn = 'peak_froce_N'\n[axes]\n'friction.mu' = [0]", "'peak_force_N'"),
        (3, "[report]\ncolumn = 'hysteresis_J'\n[axes]\n'friction.mu' = [0]", "path.withdraw"),
        (3, "[report]\nbest = 'least'\n[axes]\n'friction.mu' = [0]", "'min'"),
        (3, "[report]\nlimits = {status = 1}\n[axes]\n'friction.mu' = [0]", "status"),
        (3, "[report]\nlimits = {max_strain = 'x'}\n[axes]\n'friction.mu' = [0]", "finite"),
        (2, "axis = {}", "'axes'"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path, line, text, words):
    header = 'scene = "snapfit-circle"\n'
    path = write(tmp_path, header + text)
    with pytest.raises(SceneError) as error:
        load_study(path)
    assert words in str(error.value)
    assert str(error.value).startswith(f"{path}:{line}: ")


def test_more_cases_than_can_be_counted_are_refused(tmp_path):
    text = "scene = 'snapfit-circle'\n[axes]\n"
    for name in ("friction.mu", "finger.thickness", "finger.young"):
        text += f"'{name}' = {{ linspace = [0.001, 0.002, 3000] }}\n"
    with pytest.raises(SceneError, match=r"mine.toml:2: the axes make 2.7e\+10 cases"):
        load_study(write(tmp_path, text))


def test_a_study_without_axes_is_refused(tmp_path):
    with pytest.raises(SceneError, match="at least one axis"):
        load_study(write(tmp_path, 'scene = "snapfit-circle"'))


def test_a_missing_or_unknown_scene_is_refused(tmp_path):
    with pytest.raises(SceneError, match="scene is missing"):
        load_study(write(tmp_path, "[axes]\n'friction.mu' = [0]"))
    with pytest.raises(SceneError, match=r"mine.toml:1: .*snapfit-circle"):
        load_study(write(tmp_path, "scene = 'snapfit-circel'\n[axes]\n'friction.mu' = [0]"))


def test_combinations_are_checked_before_anything_runs(tmp_path):
    """Each axis alone is fine; the arc is too short for the longest jaw only."""
    text = "scene = 'snapfit-corner'\n[axes]\n'jaw.radius' = [0.011, 0.05]\n"
    text += "'jaw.length' = [0.019, 0.025]\n"
    with pytest.raises(SceneError, match=r"jaw.radius = 0.011 \(case 1\)"):
        load_study(write(tmp_path, text))


@pytest.mark.parametrize("name", ["snapfit-circle", "fig16-snapfit-corner"])
def test_the_shipped_studies_are_valid(name, pytestconfig):
    study = load_study(pytestconfig.rootpath / "sweeps" / f"{name}.toml")
    assert study.cases.size == {"snapfit-circle": 2079, "fig16-snapfit-corner": 189}[name]
