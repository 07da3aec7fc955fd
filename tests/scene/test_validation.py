"""Bad values are refused with the name, the value and what is allowed."""

import math
import pickle

import numpy as np
import pytest

from fastncm.errors import FastNcmError, SceneError
from fastncm.scene import Scene, load_scene

CIRCLE = load_scene("snapfit-circle")
CORNER = load_scene("snapfit-corner")
POSITIVE = [
    "finger.length",
    "finger.thickness",
    "finger.width",
    "finger.young",
    "finger.shear_modulus",
    "target.radius",
    "jaw.length",
]


def refused(scene: Scene, name: str, value: object, why: str) -> None:
    with pytest.raises(SceneError, match=why) as caught:
        scene.replace({name: value})
    assert str(caught.value).startswith(name)
    assert caught.value.name == name


@pytest.mark.parametrize("name", POSITIVE)
@pytest.mark.parametrize("value", [0.0, -0.01, math.nan, math.inf, 10**400])
def test_lengths_and_stiffnesses_are_finite_and_positive(name, value):
    refused(CIRCLE, name, value, "must be a finite number greater than 0")


@pytest.mark.parametrize("name", [*POSITIVE, "path.stop", "path.y", "friction.mu", "jaw.height"])
@pytest.mark.parametrize("value", ["0.01", True, [0.01], 1j, {}, np.True_, np.array(["a"])])
def test_numbers_are_numbers(name, value):
    refused(CIRCLE, name, value, "must be a finite number")


@pytest.mark.parametrize("value", [[0.003, 0.0], [0.003], [0.003, 0.002, 0.001], [0.003, True]])
def test_thickness_pairs(value):
    refused(CIRCLE, "finger.thickness", value, r"or a pair \[clamp, tip\]")


@pytest.mark.parametrize("value", [0.057, [0.057], [0.05, math.nan], ["x", "y"], "ab", None])
def test_points_are_pairs(value):
    refused(CIRCLE, "jaw.a", value, r"a pair \[x, y\] of finite numbers")


@pytest.mark.parametrize("value", [-1.0, 0.5, 0.7])
def test_poisson_is_between_minus_one_and_a_half(value):
    refused(CIRCLE, "finger.poisson", value, "greater than -1 and less than 0.5")


def test_friction_is_not_negative():
    refused(CIRCLE, "friction.mu", -0.1, "at least 0")
    assert CIRCLE.replace({"friction.mu": 0}).friction.mu == 0.0


def test_arc_spans_its_chord():
    half = math.hypot(CORNER.jaw.length, CORNER.jaw.height) / 2
    refused(CORNER, "jaw.radius", half * 0.999, "at least half the distance")
    assert CORNER.replace({"jaw.radius": half * 1.001}).jaw.radius == half * 1.001


def test_jaw_has_two_ends():
    refused(CIRCLE, "jaw.b", CIRCLE.jaw.a, "a point away from jaw.a")


@pytest.mark.parametrize("value", [math.pi / 2, -math.pi / 2, 2.0])
def test_lead_angle_is_acute(value):
    refused(CIRCLE, "jaw.lead_angle", value, "greater than -1.5708 and less than 1.5708")


def test_path_leads_somewhere():
    refused(CIRCLE.replace({"path.start": 0.07}), "path.stop", 0.07, "different from path.start")


@pytest.mark.parametrize("value", ["tuch", None, True, math.nan])
def test_path_start_is_a_number_or_touch(value):
    refused(CIRCLE, "path.start", value, "a finite number, or 'touch'")


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("path.steps", 1, "a whole number >= 2"),
        ("path.steps", 2.5, "a whole number >= 2"),
        ("path.steps", True, "a whole number >= 2"),
        ("path.steps", math.inf, "a whole number >= 2"),
        ("solver.order", 1, "from 2 to 32 or 'auto'"),
        ("solver.order", 33, "from 2 to 32 or 'auto'"),
        ("solver.order", "atuo", "from 2 to 32 or 'auto'"),
        ("solver.points", 0, "a whole number >= 2"),
        ("solver.rtol", 1e-13, "at least 1e-12 and at most 0.01"),
        ("solver.rtol", 0.1, "at least 1e-12 and at most 0.01"),
        ("solver.rtol", math.nan, "at least 1e-12 and at most 0.01"),
        ("solver.rtol", "small", "at least 1e-12 and at most 0.01"),
        ("solver.contact", "nearest", "'closest' or 'points-on-finger' or 'points-on-target'"),
        ("solver.hessian", "BFGS", "'exact' or 'bfgs'"),
        ("model.section", ["psi"], r"'psi' or 'psi\+gamma'"),
        ("model.shear", 1, "true or false"),
        ("jaw.shape", "line", "'segment' or 'arc'"),
        ("target.shape", "ellipse", "'circle' or 'block'"),
        ("friction.model", "coulomb", "'equilibrium' or 'recovered'$"),
    ],
)
def test_options_say_what_they_may_be(name, value, why):
    refused(CIRCLE, name, value, why)


@pytest.mark.parametrize(
    ("scene", "name", "value"),
    [
        (CORNER, "target.radius", 0.01),
        (CIRCLE, "jaw.radius", 0.05),
        (CIRCLE, "jaw.convex", True),
    ],
)
def test_names_of_another_shape_are_refused(scene, name, value):
    refused(scene, name, value, "does not belong to this scene: it is for")


@pytest.mark.parametrize("name", ["finger.length", "jaw.shape", "jaw.a", "path.stop", "path.y"])
def test_missing_values_are_named(name):
    tables = CIRCLE.to_dict()
    section, attribute = name.split(".")
    del tables[section][attribute]
    with pytest.raises(SceneError, match=f"{name} is missing"):
        Scene.from_dict(tables)


def test_a_new_shape_needs_its_values():
    with pytest.raises(SceneError, match=r"jaw\.radius is missing"):
        CIRCLE.replace({"jaw.shape": "arc"})


def test_sections_are_tables_with_known_names():
    with pytest.raises(SceneError, match="finger must be a table"):
        Scene.from_dict(CIRCLE.to_dict() | {"finger": 3})
    with pytest.raises(SceneError, match="unknown name 'fingr'; did you mean 'finger'"):
        Scene.from_dict(CIRCLE.to_dict() | {"fingr": {}})
    with pytest.raises(SceneError, match="name = 3: must be a string"):
        Scene.from_dict(CIRCLE.to_dict() | {"name": 3})
    with pytest.raises(SceneError, match="name is missing"):
        Scene.from_dict({})


def test_long_values_are_cut():
    with pytest.raises(SceneError) as caught:
        CIRCLE.replace({"friction.model": "x" * 1000})
    assert len(str(caught.value)) < 200


def test_errors_survive_the_way_from_another_process():
    error = pickle.loads(pickle.dumps(SceneError("finger.length is missing", name="finger.length")))
    assert isinstance(error, FastNcmError)
    assert (str(error), error.name) == ("finger.length is missing", "finger.length")


@pytest.mark.parametrize(
    "changes", [{"solver.contact": "points-on-finger"}, {"solver.hessian": "bfgs"}]
)
def test_what_solves_without_friction_only(changes):
    """The point forms and BFGS minimise an energy, and friction in equilibrium has none."""
    with pytest.raises(SceneError, match=r"friction\.mu = 0\.2: must be 0 .*'recovered'"):
        CIRCLE.replace({**changes, "friction.mu": 0.2})
    assert CIRCLE.replace(changes).friction.mu == 0.0
    assert CIRCLE.replace({**changes, "friction.mu": 0.2, "friction.model": "recovered"})


@pytest.mark.parametrize(
    ("changes", "angle", "low", "high"),
    [
        # the chord of snapfit-circle descends by 24.87 degrees
        ({}, 2.75, 0.0, math.pi - math.atan2(0.0089, 0.0192)),
        # a quarter of a circle over a chord that descends by 45 degrees: level at a if convex,
        # upright if concave
        ({"convex": True}, 2.40, 0.0, 0.75 * math.pi),
        ({"convex": False}, 0.5 * math.pi + 0.01, 0.0, 0.5 * math.pi),
        # three eighths of one: rises by 22.5 degrees at a
        ({"convex": True, "half": 3.0}, 0.38, math.pi / 8.0, 0.75 * math.pi),
    ],
)
def test_return_faces_lie_behind_the_jaw(changes, angle, low, high):
    arc = {}
    if changes:
        half = changes.get("half", 2.0) * math.pi / 8.0
        arc = {
            "jaw.shape": "arc",
            "jaw.a": (0.057, 0.011),
            "jaw.b": (0.067, 0.001),
            "jaw.radius": 0.005 * math.sqrt(2.0) / math.sin(half),
            "jaw.convex": changes["convex"],
        }
    with pytest.raises(SceneError, match="behind the jaw") as caught:
        CIRCLE.replace(arc | {"jaw.return_angle": angle})
    assert caught.value.name == "jaw.return_angle"
    assert f"between {low:.6g} and {high:.6g}" in str(caught.value)
    CIRCLE.replace(arc | {"jaw.return_angle": 0.5 * (low + high)})


def test_an_endless_block_never_comes_to_the_return_face():
    steep = {"jaw.a": (0.057, 0.0086), "jaw.b": (0.0571, 0.0016), "jaw.radius": 0.0051}
    leaning = steep | {"jaw.convex": False, "jaw.return_angle": 2.5}
    CORNER.replace(leaning)
    with pytest.raises(SceneError, match="behind the jaw"):
        CORNER.replace(leaning | {"target.length": 0.01})
