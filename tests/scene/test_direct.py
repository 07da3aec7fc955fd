"""Scenes of direct contact: no jaw, the finger's own side touches."""

import math

import numpy as np
import pytest

from fastncm.errors import SceneError
from fastncm.scene import Scene, load_scene, tabulate

RUBBER = load_scene("rubber-ellipse")
CIRCLE = load_scene("snapfit-circle")
LENGTH = RUBBER.finger.length
PROFILE = ((0.0, 0.03), (0.1, 0.02), (LENGTH, 0.01))
SQUARE = ((0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01))


def refused(scene: Scene, name: str, value: object, why: str, **others: object) -> None:
    with pytest.raises(SceneError, match=why) as caught:
        scene.replace({name: value} | others)
    assert caught.value.name == name


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"finger.profile": PROFILE},
        {"target.shape": "polygon", "target.vertices": SQUARE},
        {"target.shape": "half-plane", "target.tilt": 0.3},
        {"path.kind": "translation", "path.start": "touch", "path.stop": 0.0, "path.angle": 1.5},
        {"target.shape": "circle", "target.radius": 0.02, "finger.side": "left"},
    ],
)
def test_round_trip_through_plain_values(changes):
    scene = RUBBER.replace(changes)
    assert Scene.from_dict(scene.to_dict()) == scene
    assert scene.replace({}) == scene
    assert scene.jaw is None


def test_a_scene_without_a_jaw_is_in_direct_contact():
    tables = RUBBER.to_dict()
    del tables["jaw"]
    assert Scene.from_dict(tables) == RUBBER
    with pytest.raises(SceneError, match=r"jaw\.shape is missing"):
        Scene.from_dict(tables | {"jaw": {"a": [0.1, 0.0]}})


def test_a_jaw_can_be_taken_off_and_put_on():
    bare = CIRCLE.replace({"jaw.shape": "none"})
    assert (bare.jaw, bare.solver.intervals) == (None, 90)
    back = bare.replace({"jaw.shape": "segment", "jaw.a": CIRCLE.jaw.a, "jaw.b": CIRCLE.jaw.b})
    assert back == CIRCLE


def test_the_paper_s_18():
    """phi[deg] = -236.22 x_e + 102; the text's coefficient is 6/0.0254 to five digits."""
    for degrees in (126, 102, 90, 78):
        pose = RUBBER.pose(math.radians(degrees))
        assert degrees == pytest.approx(-236.22 * pose.target_x + 102, abs=1e-4)
        assert (pose.target_y, pose.base_angle) == (0.12065, math.radians(degrees))
    assert CIRCLE.pose(0.07) == (0.07, 0.0105, 0.0)


def test_positions_are_angles_where_the_base_turns():
    assert RUBBER.position_unit == RUBBER.unit_of("path.start") == "rad"
    assert CIRCLE.position_unit == CIRCLE.unit_of("path.stop") == "m"
    assert RUBBER.unit_of("finger.young") == "Pa"


def test_another_kind_of_path_needs_positions_of_its_own():
    """Angles are no lengths."""
    with pytest.raises(SceneError, match=r"path\.start is missing"):
        RUBBER.replace({"path.kind": "translation", "path.stop": 0.0})
    with pytest.raises(SceneError, match=r"path\.stop is missing"):
        RUBBER.replace({"path.kind": "translation", "path.start": "touch"})
    with pytest.raises(SceneError, match=r"path\.start is missing"):
        jaw = {"jaw.shape": "segment", "jaw.a": [0.1, 0.02], "jaw.b": [0.12, 0.01]}
        RUBBER.replace(jaw | {"target.shape": "circle", "target.radius": 0.01})
    assert RUBBER.replace({"path.kind": "rotation"}) == RUBBER


def test_stations_of_the_thickness():
    assert RUBBER.finger.stations == ((0.0, 0.030), (LENGTH, 0.017))
    assert CIRCLE.finger.stations == ((0.0, 0.0032), (0.057, 0.0032))
    assert RUBBER.replace({"finger.profile": PROFILE}).finger.stations == PROFILE


def test_a_profile_stands_in_place_of_a_thickness_and_back():
    profiled = RUBBER.replace({"finger.profile": [list(pair) for pair in PROFILE]})
    assert (profiled.finger.thickness, profiled.finger.profile) == (None, PROFILE)
    assert RUBBER.replace({"finger.profile": np.array(PROFILE)}) == profiled
    assert profiled.replace({"finger.thickness": [0.030, 0.017]}) == RUBBER
    refused(RUBBER, "finger.profile", PROFILE, "given together", **{"finger.thickness": 0.02})


@pytest.mark.parametrize(
    ("value", "why"),
    [
        (0.03, r"= 0\.03: must be \[\[s, w\], \.\.\.\]"),
        ([[0.0, 0.03]], "at least two"),
        ([[0.0, 0.03], [LENGTH, 0.01, 1.0]], "pairs of finite numbers"),
        ([[0.0, 0.03], [LENGTH, math.nan]], "pairs of finite numbers"),
        ([[0.0, True], [LENGTH, 0.01]], "pairs of finite numbers"),
        ([[0.01, 0.03], [LENGTH, 0.01]], "begins at s = 0.01"),
        ([[0.0, 0.03], [0.1, 0.0], [LENGTH, 0.01]], r"greater than 0; at s = 0\.1 it is 0"),
        ([[0.0, 0.03], [LENGTH, -0.01]], "greater than 0"),
        ([[0.0, 0.03], [0.1, 0.02], [0.1, 0.01], [LENGTH, 0.01]], "s ascending"),
        ([[0.0, 0.03], [0.1, 0.01]], r"0 to finger\.length = 0\.1524; it ends at s = 0\.1"),
        ([[0.0, 0.03], [0.2, 0.01]], r"it ends at s = 0\.2"),
    ],
)
def test_profiles_are_positive_and_cover_the_finger(value, why):
    refused(RUBBER, "finger.profile", value, why)


def test_polygons_are_made_counter_clockwise():
    clockwise = {"target.shape": "polygon", "target.vertices": SQUARE[::-1]}
    assert RUBBER.replace(clockwise).target.vertices == SQUARE
    lists = {"target.shape": "polygon", "target.vertices": [list(corner) for corner in SQUARE]}
    assert RUBBER.replace(lists).target.vertices == SQUARE


STAR = [(math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)) for k in range(5)]


@pytest.mark.parametrize(
    ("value", "why"),
    [
        (SQUARE[:2], "at least three"),
        ([[0, 0], [1, 0], "ab"], "pairs of finite numbers"),
        ([[0, 0], [1, 0], [0.2, 0.2], [0, 1]], r"no convex corner at \[0\.2, 0\.2\]"),
        ([[0, 1], [0.2, 0.2], [1, 0], [0, 0]], r"no convex corner at \[0\.2, 0\.2\]"),
        ([[0, 0], [1, 0], [2, 0], [0, 1]], r"no convex corner at \[1, 0\]"),
        ([[0, 0], [1, 0], [1, 0], [0, 1]], r"no convex corner at \[1, 0\]"),
        (STAR, "sides cross"),
    ],
)
def test_polygons_are_convex(value, why):
    refused(RUBBER, "target.vertices", value, why, **{"target.shape": "polygon"})


@pytest.mark.parametrize(
    ("scene", "name", "value", "why"),
    [
        (RUBBER, "path.angle", 0.1, r"for path\.kind = 'translation', not 'rotation'"),
        (RUBBER, "target.radius", 0.1, r"for target\.shape = 'circle', not 'ellipse'"),
        (RUBBER, "target.semi_axes", [0.1, 0.0], "finite numbers greater than 0"),
        (RUBBER, "target.semi_axes", 0.1, r"a pair \[x, y\]"),
        (RUBBER, "target.shape", "block", "'ellipse' or 'polygon' or 'half-plane'"),
        (RUBBER, "solver.order", 4, "for jaw.shape = 'segment' or 'arc', not 'none'"),
        (RUBBER, "solver.hessian", "bfgs", r"must be 'exact' where jaw\.shape = 'none'"),
        (RUBBER, "solver.intervals", 3, "from 4 to 10000"),
        (RUBBER, "solver.intervals", 10_001, "from 4 to 10000"),
        (RUBBER, "jaw.height", 0.1, "does not belong to this scene"),
        (RUBBER, "finger.side", "top", "'right' or 'left'"),
        (RUBBER, "model.surface", "top", "'side' or 'axis'"),
        (CIRCLE, "solver.intervals", 90, "for jaw.shape = 'none'"),
        (CIRCLE, "finger.profile", PROFILE, "the finger's own side touches"),
        (CIRCLE, "finger.offset", 0.01, "for jaw.shape = 'none'"),
        (CIRCLE, "finger.side", "left", "for jaw.shape = 'none'"),
        (CIRCLE, "model.surface", "axis", "for jaw.shape = 'none'"),
        (CIRCLE, "path.kind", "rotation", "for jaw.shape = 'none'"),
        (CIRCLE, "path.angle", 0.1, "for jaw.shape = 'none'"),
        (CIRCLE, "path.x", 0.1, "for jaw.shape = 'none'"),
        (CIRCLE, "target.shape", "half-plane", "'circle' or 'block' where"),
    ],
)
def test_names_and_words_of_the_other_kind_of_contact_are_refused(scene, name, value, why):
    refused(scene, name, value, why)


@pytest.mark.parametrize("name", ["path.x", "path.y", "target.semi_axes", "finger.thickness"])
def test_missing_values_are_named(name):
    tables = RUBBER.to_dict()
    section, attribute = name.split(".")
    del tables[section][attribute]
    with pytest.raises(SceneError, match=f"{name} is missing"):
        Scene.from_dict(tables)


def test_cases_are_grouped_by_profile_side_and_surface():
    columns = {
        "finger.profile": [PROFILE, ((0.0, 0.02), (LENGTH, 0.02)), PROFILE, PROFILE],
        "model.surface": ["side", "side", "side", "axis"],
        "path.y": [0.12, 0.121, 0.122, 0.123],
    }
    groups = tabulate(RUBBER, columns)
    assert [group.rows.tolist() for group in groups] == [[0, 2], [1], [3]]
    assert groups[0].scene.finger.profile == PROFILE
    assert groups[0].values["thickness_clamp"].tolist() == [0.03, 0.03]
    assert groups[0].values["thickness_tip"].tolist() == [0.01, 0.01]


def test_values_of_direct_contact():
    (group,) = tabulate(RUBBER, {"path.speed_ratio": [-0.2, -0.3]})
    value = {key: array.tolist() for key, array in group.values.items()}
    assert value["speed_ratio"] == [-0.2, -0.3]
    assert (value["offset"], value["path_x"]) == ([0.0254] * 2, [0.0508] * 2)
    assert (value["semi_x"], value["semi_y"]) == ([0.09906] * 2, [0.06731] * 2)
    assert np.isnan([value[key] for key in ("a_x", "jaw_radius", "path_angle")]).all()
    (group,) = tabulate(CIRCLE, {})
    for key in ("offset", "semi_x", "semi_y", "tilt", "path_x", "speed_ratio", "path_angle"):
        assert np.isnan(group.values[key]).all()
