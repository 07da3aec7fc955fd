"""Dotted names: complete, with units, and with a hint where one is misspelt."""

import pytest

from fastncm.errors import SceneError
from fastncm.scene import check_name, load_scene, scene_names, shipped_scenes, unit_of


def test_every_stored_value_has_a_name():
    for name in shipped_scenes():
        scene = load_scene(name)
        assert set(scene.flat()) <= set(scene_names())


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("finger.thickness", "m"),
        ("finger.young", "Pa"),
        ("jaw.lead_angle", "rad"),
        ("friction.mu", "1"),
        ("finger.profile", "m"),
        ("path.speed_ratio", "m/rad"),
        ("solver.order", "1"),
    ],
)
def test_units(name, unit):
    assert unit_of(name) == unit


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("finger.thicknes", "finger.thickness"),
        ("fingr.length", "finger.length"),
        ("jaw.leadangle", "jaw.lead_angle"),
        ("mu", "friction.mu"),
        ("thickness", "finger.thickness"),
    ],
)
def test_misspelt_name_points_to_the_nearest(wrong, right):
    with pytest.raises(SceneError, match=f"unknown name '{wrong}'; did you mean '{right}'"):
        check_name(wrong)


def test_a_word_without_a_neighbour_lists_the_names():
    with pytest.raises(SceneError, match=r"known: finger\.length, .*solver\.rtol"):
        check_name("qqqqqq")
