"""Scenes as values: round trips, replacing, and the ways to move a jaw."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fastncm.errors import SceneError
from fastncm.scene import Scene, load_scene

CIRCLE = load_scene("snapfit-circle")
CORNER = load_scene("snapfit-corner")


@pytest.mark.parametrize("scene", [CIRCLE, CORNER], ids=lambda scene: scene.name)
def test_round_trip_through_plain_values(scene):
    changed = scene.replace({"finger.thickness": [0.004, 0.003], "finger.shear_modulus": 1e9})
    for original in (scene, changed):
        assert Scene.from_dict(original.to_dict()) == original
        assert original.replace({}) == original


def test_replace_leaves_the_original_alone():
    changed = CIRCLE.replace({"finger.thickness": 0.0042, "friction.mu": 0.2})
    assert (changed.finger.thickness, changed.friction.mu) == (0.0042, 0.2)
    assert (CIRCLE.finger.thickness, CIRCLE.friction.mu) == (0.0032, 0.0)


def test_values_take_their_plain_type():
    scene = CIRCLE.replace({"finger.length": 1, "path.steps": 10.0, "finger.thickness": [1, 1]})
    assert type(scene.finger.length) is float
    assert type(scene.path.steps) is int
    assert scene.finger.thickness == 1.0


def test_shear_modulus_can_be_given_and_taken_back():
    given_one = CIRCLE.replace({"finger.shear_modulus": 1e9})
    assert given_one.finger.shear_modulus == 1e9
    assert given_one.replace({"finger.shear_modulus": None}) == CIRCLE


def test_path_may_start_at_a_position_or_at_the_touch():
    assert CIRCLE.replace({"path.start": 0.07}).path.start == 0.07
    assert CIRCLE.replace({"path.start": 0.07}).replace({"path.start": "touch"}) == CIRCLE


def test_changing_shapes_drops_what_they_do_not_use():
    flat = CORNER.replace({"jaw.shape": "segment"})
    assert flat.jaw.radius is None
    back = flat.replace({"jaw.shape": "arc", "jaw.radius": 0.05})
    assert back == CORNER


def test_shear_correction_of_a_rectangle():
    # (20): 5/6 at nu = 0
    assert CIRCLE.replace({"finger.poisson": 0.0}).finger.shear_correction == pytest.approx(5 / 6)


def test_jaw_measures_of_the_paper():
    assert math.degrees(CIRCLE.jaw.lead_angle) == pytest.approx(25, abs=0.2)
    assert CIRCLE.jaw.length == pytest.approx(0.0192)
    assert CORNER.jaw.height == pytest.approx(0.0069)
    assert CORNER.jaw.length == pytest.approx(0.019)


def test_height_moves_a_vertically():
    jaw = CIRCLE.replace({"jaw.height": 0.005}).jaw
    assert jaw.a == (0.057, 0.0016 + 0.005)
    assert jaw.b == CIRCLE.jaw.b


def test_length_moves_b_horizontally():
    jaw = CIRCLE.replace({"jaw.length": 0.03}).jaw
    assert jaw.a == CIRCLE.jaw.a
    assert jaw.b == (0.057 + 0.03, 0.0016)


lengths = st.floats(1e-3, 1e-1)
angles = st.floats(0.05, 1.5)


@settings(deadline=None)  # the machine may be busy
@given(angle=angles)
def test_lead_angle_alone_keeps_the_length(angle):
    jaw = CIRCLE.replace({"jaw.lead_angle": angle}).jaw
    assert jaw.lead_angle == pytest.approx(angle, rel=1e-12)
    assert jaw.b == CIRCLE.jaw.b
    assert jaw.a[0] == CIRCLE.jaw.a[0]


@settings(deadline=None)  # the machine may be busy
@given(length=lengths, other=lengths, angle=angles)
def test_two_moves_hold_in_either_order(length, other, angle):
    moves = {"jaw.length": length, "jaw.height": other, "jaw.lead_angle": angle}
    for left_out in moves:
        pair = {name: value for name, value in moves.items() if name != left_out}
        jaw = CIRCLE.replace(pair).jaw
        assert CIRCLE.replace(dict(reversed(pair.items()))).jaw == jaw
        reached = {
            "jaw.length": jaw.length,
            "jaw.height": jaw.height,
            "jaw.lead_angle": jaw.lead_angle,
        }
        for name, value in pair.items():
            assert reached[name] == pytest.approx(value, rel=1e-9)
        assert (jaw.a[0], jaw.b[1]) == (CIRCLE.jaw.a[0], CIRCLE.jaw.b[1])


def test_three_moves_contradict():
    with pytest.raises(SceneError, match="two of them fix the third"):
        CIRCLE.replace({"jaw.length": 0.02, "jaw.height": 0.01, "jaw.lead_angle": 0.4})


@pytest.mark.parametrize("angle", [0.0, -0.3])
def test_height_and_angle_must_leave_a_length(angle):
    with pytest.raises(SceneError, match=r"jaw\.lead_angle = .* finite length greater than 0"):
        CIRCLE.replace({"jaw.height": 0.01, "jaw.lead_angle": angle})
