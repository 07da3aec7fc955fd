"""The decks for CalculiX (bench/calculix.py), and a run of the coarsest where it is installed."""

import numpy as np
import pytest
from calculix_parts.cases import MESHES, SMALL, Case, all_cases
from calculix_parts.deck import Increments, deck
from calculix_parts.mesh import block, cuts, ruled
from calculix_parts.model import SLICE, Model
from calculix_parts.runs import available, run

CASES = [Case(scene, "coarse", 0.2 if "snapfit" in scene else 0.0) for scene in MESHES]


def only_model(case: Case) -> Model:
    return next(case.paths())[0]


def area(nodes: np.ndarray) -> float:
    """Of a polygon (n, 2), positive where it is counter-clockwise."""
    x, y = nodes.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def test_block_has_a_node_for_each_corner_and_middle() -> None:
    x = cuts([0.0, 3.0], [3])
    low = np.column_stack([x, 0.0 * x])
    made = block(ruled(low, low + [0.0, 2.0], cuts([0.0, 1.0], [2])))
    assert len(made.elements) == 6
    assert len(made.nodes) == 12 + 17  # corners of a 3 x 2 grid, and its edges' middles
    for element in made.elements:
        assert area(made.nodes[element[:4]]) == pytest.approx(1.0)
        corners = made.nodes[element[:4]]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
        np.testing.assert_allclose(made.nodes[element[4:]], middles)
    assert made.side("bottom") == [(0, 1), (1, 1), (2, 1)]
    assert made.side("right") == [(2, 2), (5, 2)]
    assert made.side("top") == [(3, 3), (4, 3), (5, 3)]
    assert made.side("left") == [(0, 4), (3, 4)]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.scene)
def test_elements_are_counter_clockwise_and_the_finger_has_its_area(case: Case) -> None:
    model = only_model(case)
    areas = {
        name: [area(model.nodes[element[:4]]) for element in elements]
        for name, elements in model.parts.items()
    }
    assert all(min(some) > 0.0 for some in areas.values())
    finger = case.beam().finger
    mean = float(np.mean(finger.thickness))
    assert sum(areas["FINGER"]) == pytest.approx(1e6 * finger.length * mean, rel=1e-9)
    ends = model.nodes[model.clamp]
    thickness = np.hypot(*(ends[:, None] - ends).T).max()
    assert thickness == pytest.approx(1e3 * np.max(finger.thickness), rel=1e-9)


def test_jaw_hangs_on_the_finger_and_ends_where_the_scene_says() -> None:
    for scene in ("snapfit-circle", "snapfit-corner"):
        case = Case(scene, "coarse", 0.0)
        model, jaw = only_model(case), case.beam().jaw
        used = np.unique(model.parts["JAW"])
        shared = np.intersect1d(used, np.unique(model.parts["FINGER"]))
        assert len(shared) == 2 * case.fineness.through + 1
        np.testing.assert_allclose(model.nodes[shared, 0], 57.0)
        for point in (jaw.a, jaw.b):
            off = np.hypot(*(model.nodes[used] - 1e3 * np.array(point)).T)
            assert off.min() < 1e-9


def test_arc_keeps_its_radius() -> None:
    model = only_model(Case("snapfit-corner", "coarse", 0.0))
    faces = model.surfaces["LINE"]
    corners = [model.parts["JAW"][element][[2, 3, 6]] for _, element, _ in faces]
    line = model.nodes[np.unique(corners)]
    a, b = line[0], line[np.argmax(line[:, 0])]
    chord = np.hypot(*(b - a))
    middle = line[np.argmin(np.abs(np.hypot(*(line - a).T) - np.hypot(*(line - b).T)))]
    x, y = middle - 0.5 * (a + b)
    left = np.array([a[1] - b[1], b[0] - a[0]]) / chord
    off = x * left[0] + y * left[1]
    near = 50.0 - np.sqrt(50.0**2 - 0.25 * chord**2)
    assert 0.9 * near < off <= near * (1.0 + 1e-9)  # convex: on the jaw's outside
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]]) @ left
    for point in line:  # |point - centre| = 50 mm
        t, n = (point - 0.5 * (a + b)) @ turn, (point - 0.5 * (a + b)) @ left
        assert np.hypot(t, n + np.sqrt(50.0**2 - 0.25 * chord**2)) == pytest.approx(50.0)


def test_targets_lie_where_the_path_begins_and_go_where_it_ends() -> None:
    circle = only_model(Case("snapfit-circle", "coarse", 0.0))
    rim = circle.nodes[np.unique(circle.parts["TARGET"])]
    assert np.hypot(*(rim - [78.3, 10.5]).T).max() == pytest.approx(8.9)
    first, beyond = (path[0] for path in Case("snapfit-corner", "coarse", 0.0).paths())
    corner = first.nodes[np.unique(first.parts["TARGET"])].min(axis=0)
    np.testing.assert_allclose(corner, [74.5, 2.6])
    assert first.motions[0][-1, 1] == pytest.approx(57.94 - 74.5)
    corner = beyond.nodes[np.unique(beyond.parts["TARGET"])].min(axis=0)
    np.testing.assert_allclose(corner + [m[-1, 1] for m in beyond.motions[:2]], [56.5, 2.6])


def test_clamp_of_the_rubber_finger_turns_about_the_origin() -> None:
    model = only_model(Case(SMALL, "coarse", 0.0))
    tables = {(node, k): model.motions[number] for node, k, number in model.driven}
    for node in model.clamp:
        end = model.nodes[node] + [tables[node, k][-1, 1] for k in (1, 2)]
        turned = np.arctan2(*end[::-1]) - np.arctan2(*model.nodes[node][::-1])
        assert np.degrees(turned) == pytest.approx(102.0 - 87.0)
        assert np.hypot(*end) == pytest.approx(np.hypot(*model.nodes[node]))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.scene)
def test_deck_says_what_the_model_has(case: Case) -> None:
    model = only_model(case)
    lines = deck(model, case.mu, Increments(0.1, 0.5)).splitlines()
    begin = lines.index("*NODE, NSET=NALL") + 1
    count = next(i for i, line in enumerate(lines[begin:]) if line.startswith("*"))
    assert count == len(model.nodes)
    assert sum(line.startswith("*ELEMENT, TYPE=CPS8R") for line in lines) == len(model.parts)
    sections = [i for i, line in enumerate(lines) if line.startswith("*SOLID SECTION")]
    assert {lines[i + 1] for i in sections} == {f"{SLICE}"}
    assert ("*FRICTION" in lines) == (case.mu > 0.0)
    driven = {(node, k) for node, k, _ in model.driven}
    for node in [*np.unique(model.parts["TARGET"]), *model.clamp]:
        assert {(node, 1), (node, 2)} <= driven


@pytest.mark.skipif(not available(), reason="CalculiX (ccx) is not installed")
@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_coarsest_mesh_is_near_the_reference(mu: float) -> None:
    """The first half of the path of snapfit-circle."""
    case = Case("snapfit-circle", "coarse", mu)
    model, increments = next(case.paths())
    known = case.reference().iloc[:5]
    short = Model(**{**vars(model), "times": model.times[:5]})
    found = run(short, mu, increments, limit=300.0)
    assert not found.message
    theirs = known[["force_x_N", "force_y_N"]].to_numpy()
    off = np.hypot(*(found.forces - theirs).T) / np.hypot(*theirs.T)
    assert off.max() < 0.02


def test_what_is_compared_has_three_meshes_and_the_snapfits_friction() -> None:
    for scene in ("snapfit-circle", "snapfit-corner", SMALL):
        meshes = {(mesh.along, mesh.through) for mesh in MESHES[scene].values()}
        assert len(meshes) == 3
        frictions = {case.mu for case in all_cases() if case.scene == scene}
        assert frictions == ({0.0} if scene == SMALL else {0.0, 0.2, 0.4})
