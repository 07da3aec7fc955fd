"""Scene files: what is shipped, and errors that name the file and the line."""

import pytest

from fastncm.errors import SceneError
from fastncm.scene import load_scene, read_toml, shipped_scenes

GOOD = """\
# a scene
[finger]
length = 0.057
thickness = [0.0032, 0.003]
width = 0.0095
young = 2.62e9

[jaw]
shape = "segment"
a = [0.057, 0.0105]
b = [0.0762, 0.0016]

[target]
shape = "circle"
radius = 0.0089

[path]
stop = 0.06
y = 0.0105
"""


@pytest.fixture
def scene_file(tmp_path):
    def write(text: str):
        path = tmp_path / "mine.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_file_gives_its_name_and_the_defaults(scene_file):
    scene = load_scene(scene_file(GOOD))
    assert scene.name == "mine"
    assert scene.finger.thickness == (0.0032, 0.003)
    assert (scene.path.start, scene.path.steps) == ("touch", 60)
    assert (scene.solver.order, scene.solver.rtol) == ("auto", 1e-6)
    assert load_scene(str(scene_file('name = "own"\n' + GOOD))).name == "own"


def test_shipped_scenes_have_the_numbers_of_the_paper():
    assert list(shipped_scenes()) == ["rubber-ellipse", "snapfit-circle", "snapfit-corner"]
    assert all(shipped_scenes().values())
    circle, corner = load_scene("snapfit-circle"), load_scene("snapfit-corner")
    assert circle.finger == corner.finger
    assert (circle.finger.length, circle.finger.thickness) == (0.057, 0.0032)
    assert (circle.finger.width, circle.finger.young) == (0.0095, 2.62e9)
    assert (circle.jaw.a, circle.jaw.b) == ((0.057, 0.0105), (0.0762, 0.0016))
    assert (circle.target.radius, circle.path.y, circle.path.stop) == (0.0089, 0.0105, 0.06)
    assert (corner.jaw.a, corner.jaw.b) == ((0.057, 0.0085), (0.076, 0.0016))
    assert (corner.jaw.radius, corner.jaw.convex) == (0.05, True)
    assert (corner.target.shape, corner.path.y, corner.path.stop) == ("block", 0.0026, 0.05)
    assert (circle.solver.points, corner.solver.points) == (50, 20)


@pytest.mark.parametrize(
    ("change", "line", "why"),
    [
        (("width = 0.0095", "width = -1"), 5, r"finger\.width = -1: must be"),
        (("width =", "widht ="), 5, r"did you mean 'finger\.width'"),
        (("[path]", "[pth]"), 17, "did you mean 'path'"),
        (("radius = 0.0089\n", ""), 13, r"target\.radius is missing"),
        (("b = [0.0762, 0.0016]", "b = [0.0762]"), 11, r"a pair \[x, y\]"),
        (("stop = 0.06", 'stop = "far"'), 18, r"path\.stop = 'far'"),
        (("# a scene", 'name = ""'), 1, "name is missing"),
        (("[path]", "friction = 3\n[path]"), 17, "unknown name 'target.friction'"),
        (("y = 0.0105\n", "solver.intervals = 90"), 19, "path.solver"),
        (("young = 2.62e9", "young = 2.62e"), 6, "Expected newline"),
        (("shape =", "shape"), 9, "Expected '='"),
        (('"circle"', '"circle'), 14, "Illegal character"),
        (("y = 0.0105\n", 'y = """'), 19, "Unterminated string"),
        (("stop = 0.06", "stop = 0.06\nstop = 0.07"), 19, "Cannot overwrite a value"),
    ],
)
def test_errors_name_the_file_and_the_line(scene_file, change, line, why):
    path = scene_file(GOOD.replace(*change, 1))
    with pytest.raises(SceneError, match=why) as caught:
        load_scene(path)
    assert str(caught.value).startswith(f"{path}:{line}: ")


@pytest.mark.parametrize(
    ("text", "name", "line"),
    [
        ("[ finger . 'x' ]\nlength = 1", "finger.x.length", 2),
        ("a.b = 1\n[c]\n'd'.e = 2", "c.d.e", 3),
        ("[c]\nd = { e = 1 }", "c.d.e", 2),
        ("\n[[axes]]\nname = 'x'", "axes", 2),
    ],
)
def test_names_are_found_again(tmp_path, text, name, line):
    path = tmp_path / "file.toml"
    path.write_text(text)
    located = read_toml(path).locate(SceneError("wrong", name=name))
    assert str(located) == f"{path}:{line}: wrong"


def test_an_error_without_a_name_names_the_file(scene_file):
    path = scene_file(GOOD)
    assert str(read_toml(path).locate(SceneError("wrong"))) == f"{path}: wrong"


def test_unknown_scenes_point_to_the_nearest():
    with pytest.raises(SceneError, match="'snapfit-cirlce'; did you mean 'snapfit-circle'"):
        load_scene("snapfit-cirlce")


def test_the_rubber_finger_has_the_numbers_of_the_paper_and_says_what_is_assumed():
    scene = load_scene("rubber-ellipse")
    finger, path = scene.finger, scene.path
    assert scene.jaw is None
    assert (finger.young, finger.shear_modulus, finger.poisson) == (4.8e6, 1.71e6, 0.4)
    assert (finger.width, finger.thickness) == (0.025, (0.030, 0.017))
    assert (finger.length, finger.offset, finger.side) == (0.1524, 0.0254, "right")
    assert (scene.target.semi_axes, path.y) == ((0.09906, 0.06731), 0.12065)
    assert (scene.model.shear, scene.solver.intervals) == (True, 90)
    for word in ("semi-axes", "0.0254", "0.1524", "right"):
        assert word in scene.assumed


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(SceneError, match="cannot be read: No such file"):
        load_scene(tmp_path / "none.toml")
    with pytest.raises(SceneError, match="cannot be read: Is a directory"):
        load_scene(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="not UTF-8"):
        load_scene(binary)
