"""Instruments pushed into the skin: where they hold it, and the force they feel."""

import re

import numpy as np
import pytest

from conftest import PROJECT
from heads import box, write
from tissue import Tissue, as_springs, last, model_of

SHIPPED = as_springs((PROJECT / "meshes/head_instrument.yaml").read_text()).replace(
    "stiffness: 1.0", "modulus: 0.05")
SHAPE = "sphere: {center: [63, -98, -10], radius: 20}"
# The coarser head, and a ball large enough for it.
SCENE = SHIPPED.replace("head_", "paper_").replace("sphere: {center: [57, -90, -10], radius: 10}",
                                                   SHAPE)
CENTER, RADIUS = np.array([54, -86, -10]), 20  # at the end of the push, mm


def press(run, folder, *options, scene=SCENE, ranks=1, accuracy=1e-6):
    (folder / "press.yaml").write_text(scene)
    result = run("repose-solve", "press.yaml", "-accuracy", accuracy, *options, ranks=ranks,
                 cwd=folder)
    assert (result.returncode, result.stderr) == (0, ""), result
    found = re.search(r"instrument 0 .*holds (\d+) points; .*with \((.*?)\) N", result.stdout)
    return int(found[1]), np.array([float(w) for w in found[2].split(",")])


def test_skin_lies_on_the_ball_and_pushes_back(run, folder):
    count, force = press(run, folder, ranks=2)
    model, step = model_of(folder / "press.h5"), last(folder / "press.h5")
    held = model["point/set"] == 3
    assert held.sum() == count > 2
    from_center = np.linalg.norm(step["point/position"][held] - CENTER, axis=1)
    assert from_center == pytest.approx(RADIUS, abs=1e-9)
    assert step["inverted_prisms"] == 0
    assert force @ np.array([-0.6, 0.8, 0]) < 0, "against the push"
    assert run("repose-check", "press.h5", cwd=folder).returncode == 0


def slope(tissue, x, held):
    """Derivative of the objective when all held points move as one."""
    result = np.zeros(3)
    for axis in range(3):
        for sign in (-1, 1):
            moved = x.copy()
            moved[held, axis] += sign * 1e-5
            result[axis] += sign * tissue.value_and_gradient(moved)[0] / 2e-5
    return result


@pytest.mark.parametrize("layers", [2, 4])
@pytest.mark.parametrize("volume", ["none", "penalty", "paper"])
def test_the_force_is_the_slope_of_the_objective(run, folder, volume, layers):
    given = ["-lambda", "0.9"] if volume == "paper" else []
    _, force = press(run, folder, "-volume", volume, *given,
                     scene=SCENE.replace("layers: 4", f"layers: {layers}"))
    model, step = model_of(folder / "press.h5"), last(folder / "press.h5")
    held, x = model["point/set"] == 3, step["point/position"]
    weight = step["lambda"] if volume == "paper" else step["bulk_modulus"]
    tissue = Tissue(model, volume, weight)
    tissue.spring[:] = tissue.prism[:] = True
    expected = -slope(tissue, x, held)
    assert force == pytest.approx(expected, rel=1e-3, abs=1e-3 * np.linalg.norm(expected))


def test_sliding_skin_is_not_pulled_along_the_ball(run, folder):
    """Forces of the independent energy at the skin are along the ball's normals."""
    _, stuck = press(run, folder, accuracy=1e-4)
    sticking = last(folder / "press.h5")["objective"]
    (folder / "slide.yaml").write_text(SCENE.replace(
        "instruments:\n  - {", "instruments:\n  - {skin: slide, "))
    result = run("repose-solve", "slide.yaml", "-accuracy", 1e-4, cwd=folder)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert run("repose-check", folder / "slide.h5").returncode == 0
    found = re.search(r"(\d+) points press on instruments\[0\] with \((.*?)\) N", result.stdout)
    force = np.array([float(w) for w in found[2].split(",")])
    model, step = model_of(folder / "slide.h5"), last(folder / "slide.h5")
    x, pressed = step["point/position"], step["point/contact_pressure"] > 0
    of_bones = model["contact/body_bone"] >= 0  # which have surfaces, and no other shape
    assert of_bones.any() and (model["contact/body_shape"][of_bones] == 0).all()
    assert pressed.sum() == int(found[1]) > 2
    outward = (x[pressed] - CENTER) / np.linalg.norm(x[pressed] - CENTER, axis=1)[:, None]
    skin = model["point/layer"] == 0
    assert np.linalg.norm(x[skin] - CENTER, axis=1).min() > RADIUS - 1e-3
    tissue = Tissue(model, "penalty", step["bulk_modulus"])
    tissue.spring[:] = tissue.prism[:] = tissue.soft[:] = True
    forces = -tissue.value_and_gradient(x)[1][pressed]
    assert forces.sum(0) == pytest.approx(force, rel=1e-3, abs=1e-3)
    normal = (forces * outward).sum(1)
    along = np.linalg.norm(forces - normal[:, None] * outward, axis=1)
    assert along.max() < 1e-3 * np.abs(normal).max()
    assert step["objective"] < 0.8 * sticking
    assert np.linalg.norm(force) < np.linalg.norm(stuck)


@pytest.mark.quick
def test_the_shipped_scene_presses_a_cheek(run, tmp_path):
    """Skin around the held points, which pull it along, does not enter the ball either."""
    result = run("repose-solve", PROJECT / "meshes/head_instrument.yaml", "-output", "press")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "instrument 0           holds 12 points" in result.stdout
    model, step = model_of(tmp_path / "press.h5"), last(tmp_path / "press.h5")
    skin = step["point/position"][model["point/layer"] == 0]
    assert np.linalg.norm(skin - [48, -78, -10], axis=1).min() > 10 - 0.05
    assert run("repose-check", "press.h5").returncode == 0


def test_an_instrument_inside_the_tissue_is_no_rest_position(run, folder):
    """A ball that comes out of the bone lifts the skin, which alone touches it, and ends inside the
    tissue below, in whatever load steps."""
    center, radius = np.array([43.8, -72.4, -10]), 6  # at the end of the push, mm
    (folder / "pierce.yaml").write_text(SCENE.replace(
        SHAPE, f"skin: slide, sphere: {{center: [28.8, -52.4, -10], radius: {radius}}}").replace(
        "push: [-9, 12, 0]", "push: [15, -20, 0]"))
    result = run("repose-solve", "pierce.yaml", "-verify_path", ranks=2, cwd=folder)
    assert (result.returncode, result.stderr) == (2, ""), result
    assert "NOT AT REST" in result.stdout and "verified" not in result.stdout
    found = re.search(r"pierced by instrument +(\d+) columns?, up to (.*?) mm deep, .* by "
                      r"instruments\[0\] at \((.*?)\) mm; push it less far", result.stdout)
    model, step = model_of(folder / "pierce.h5"), last(folder / "pierce.h5")
    inside = radius - np.linalg.norm(step["point/position"] - center, axis=1) > 0.5
    assert int(found[1]) >= len(set(model["point/column"][inside])) > 0
    assert not inside[model["point/layer"] == 0].any()
    place = np.array([float(x) for x in found[3].split(",")])
    assert radius - np.linalg.norm(place - center) == pytest.approx(float(found[2]), abs=0.2)
    assert not step["converged"] and b"pierced by an instrument" in step["reason"]
    again = run("repose-solve", "pierce.yaml", "-restart", "pierce.h5", "-output", "again",
                cwd=folder)
    assert again.returncode == 2 and "pierced by instrument" in again.stdout, again


BAD = {
    "no shape": (SHAPE + ", ", "", ["press.yaml:", "instruments[0]", "exactly one of sphere"]),
    "two shapes": (SHAPE, SHAPE + ", box: {center: [0, 0, 0], size: [1, 1, 1]}",
                   ["instruments[0]", "exactly one of sphere"]),
    "no push": ("push: [-9, 12, 0]", "push: [0, 0, 0]", ["instruments[0].push", "not be zero"]),
    "far from the skin": ("[63, -98, -10]", "[163, -98, -10]",
                          ["instruments[0]", "reaches no free point"]),
    "huge": ("radius: 20", "radius: 1.0e+8", ["instruments[0].sphere.radius", "> 0 and ≤ 1e+07"]),
    "held by another": ("push: [-9, 12, 0]}", "push: [-9, 12, 0]}\n  - {" + SHAPE + ", push: [-9, 12, 0]}",
                        ["instruments[1]", "held by instruments[0]"]),
    "no radius": (", radius: 20", "", ["instruments[0].sphere", "radius"]),
    "a flat box": (SHAPE, "box: {center: [0, 0, 0], size: [1, 0, 1]}",
                   ["instruments[0].box.size", "greater than 0"]),
    "a half-space pulled": (SHAPE, "half_space: {point: [60, -90, 0], normal: [6, -8, 0]}",
                            ["instruments[0]", "side of its normal"]),
    "an open mesh": (SHAPE, "mesh: paper_skin.ply", ["paper_skin.ply", "a closed surface; it is open, "]),
    "meters": (SHAPE, "mesh: rod.ply", ["instruments[0]", "rod.ply is 0.0346 mm across and seems not to be in mm"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_instruments_are_refused_in_one_line(run, folder, case):
    old, new, words = BAD[case]
    assert old in SCENE
    (folder / "press.yaml").write_text(SCENE.replace(old, new))
    write(folder / "rod.ply", box((0.05, -0.1, -0.02), (0.07, -0.08, 0.0)).reshape(-1, 3),
          np.arange(36, dtype=np.int32).reshape(-1, 3))
    before = sorted(folder.iterdir())
    result = run("repose-solve", "press.yaml", cwd=folder)
    assert result.returncode == 1, result
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert [word for word in words if word not in result.stderr] == [], result.stderr
    assert sorted(folder.iterdir()) == before


@pytest.fixture
def slab(run, tmp_path):
    """slab(instruments, young, along, *options) → the run and result of a flat slab on a bone that moves."""
    grid = np.arange(-27, 28, 3.0)
    points = np.array([(x, y, 15) for y in grid for x in grid], float)
    corner = np.arange(len(points), dtype=np.int32).reshape(len(grid), -1)[:-1, :-1].ravel()
    right, up = corner + 1, corner + len(grid)
    write(tmp_path / "slab_skin.ply", points,
          np.concatenate([np.column_stack([corner, right, up + 1]),
                          np.column_stack([corner, up + 1, up])]))
    below = box((-60.0, -60.0, -10.0), (60.0, 60.0, 0.0)).reshape(-1, 3)
    write(tmp_path / "slab_bone.ply", below, np.arange(36, dtype=np.int32).reshape(-1, 3))

    def solve(instruments, young, along, *options, deep=0.01, regions="", ranks=1, status=0):
        (tmp_path / "slab.yaml").write_text(f"""skin: slab_skin.ply
bones: [{{name: base, file: slab_bone.ply}}]
tissue:
  layers: 4
  edge: given
  attach_within: 200
  material: {{young: {deep}, poisson: 0.4, strata: [{{thickness: 2, young: {young}, poisson: 0.4}}]{regions}}}
boundary: {{rim: fixed}}
instruments: [{instruments}]
moves: [{{bone: base, translate: [{along}, 0.2, -0.3]}}]
""")
        result = run("repose-solve", "slab.yaml", *options, ranks=ranks)
        assert result.returncode == status, result
        return result, last(tmp_path / "slab.h5") if status != 1 else None
    return solve


def test_tangents_of_what_slides_along_a_ball_are_differences_of_faces(slab):
    """The bone moves by so little that no point begins or ends to press."""
    ball = "{sphere: {center: [4, 1, 21.3], radius: 6}, push: [0, 0, -1.5], skin: slide}"
    solve = lambda *change: slab(ball, *change, "-accuracy", 1e-7)[1]
    _, at = slab(ball, 0.05, 0.5, "-accuracy", 1e-7, "-tangents")
    for name, change, ends in (
            ("tangent_0_tx", 0.002, [(0.05, 0.499), (0.05, 0.501)]),
            ("tangent_young_0", 0.002, [(0.05 * np.exp(t), 0.5) for t in (-0.001, 0.001)])):
        first, second = (solve(*end) for end in ends)
        pressed = [np.linalg.norm(step["point/contact_force"], axis=1) > 0
                   for step in (first, at, second)]
        assert pressed[0].sum() > 2 and (pressed[0] == pressed[1]).all()
        assert (pressed[1] == pressed[2]).all()
        difference = (second["point/position"] - first["point/position"]) / change
        off = np.linalg.norm(at[f"point/{name}"] - difference, axis=1).max()
        assert off < 2e-3 * np.linalg.norm(difference, axis=1).max(), name


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_region_with_the_modulus_of_a_stratum_is_none_of_the_strata(slab, ranks):
    scar = ", regions: [{sphere: {center: [0, 0, 10], radius: 9}, young: 0.01, poisson: 0.4}]"
    solve = lambda deep, *options: slab("", 0.05, 0.5, "-accuracy", 1e-6, *options, deep=deep, regions=scar,
                                        ranks=ranks)[1]
    column = solve(0.01, "-tangents")["point/tangent_young_1"]
    ends = [solve(0.01 * np.exp(by))["point/position"] for by in (-0.001, 0.001)]
    difference = (ends[1] - ends[0]) / 0.002
    off = np.linalg.norm(column - difference, axis=1).max()
    assert off < 5e-3 * np.linalg.norm(difference, axis=1).max()


def test_points_that_one_instrument_slides_on_and_another_holds_belong_to_the_other(slab):
    ball = "{sphere: {center: [4, 1, 21.3], radius: 6}, push: [0, 0, -1.5], skin: slide}"
    plate = "{box: {center: [4, 1, 17.3], size: [20, 20, 4]}, push: [0, 0, -1]}"
    result, _ = slab(f"{ball}, {plate}", 0.05, 0, status=1)
    assert "instruments[0]: all points of the skin that it reaches are held by instruments[1]" \
        in result.stderr, result


@pytest.mark.parametrize("ranks", [1, 2])
def test_another_rest_position_at_an_edge_names_the_instrument(slab, ranks):
    plate = "{box: {center: [1, -1, 17.3], size: [8, 6, 4]}, push: [2, 0, -2], skin: slide}"
    result, _ = slab(plate, 0.05, 0, "-accuracy", 0.001, ranks=ranks)
    assert re.search(r"other rest position .* on either side of an edge of instruments\[0\], and",
                     result.stdout), result


def test_an_instrument_thinner_than_a_layer_does_not_pass_the_skin_unseen(slab, tmp_path):
    """A plate inside the tissue, where the search for another rest position leads, stores no energy."""
    plate = "{box: {center: [0, 0, 16], size: [14, 14, 0.9]}, push: [0, 0, -2], skin: slide}"
    _, step = slab(plate, 0.05, 0)
    model = model_of(tmp_path / "slab.h5")
    below = (model["point/layer"] == 0) & (np.abs(model["point/position"][:, :2]).max(1) < 5)
    assert step["point/displacement"][below][:, 2] == pytest.approx(-1.45, abs=0.02)
    rod = "capsule: {from: [-8, 0.2, 16], to: [8, 0.2, 16], radius: 0.4}, push: [0, 0, -4], skin: slide"
    result, _ = slab(f"{{{rod}}}", 0.05, 0, status=2)
    assert re.search(r"pierced by instrument +\d+ (columns|prisms between columns), up to 0\.\d+ mm deep",
                     result.stdout)


def test_what_an_instrument_pierces_does_not_depend_on_the_order_of_corners(slab, tmp_path):
    """The rod is thicker than the short edges of the skin, and goes in between its long ones."""
    x, y = np.arange(-20, 20.1, 1.6), np.arange(-32, 33, 8.0)
    corner = np.arange(len(x) * len(y), dtype=np.int32).reshape(len(y), -1)[:-1, :-1].ravel()
    right, up = corner + 1, corner + len(x)
    triangles = np.concatenate([np.column_stack([right, up + 1, corner]), np.column_stack([up, corner, up + 1])])
    rod = "{capsule: {from: [-6, 4, 16.9], to: [6, 7, 16.9], radius: 1.7}, push: [0, 0, -4], skin: stick}"
    counts = set()
    for first in range(3):
        write(tmp_path / "slab_skin.ply", np.array([(a, b, 15) for b in y for a in x], float),
              np.roll(triangles, first, axis=1))
        result, _ = slab(rod, 0.01, 0, status=2)
        counts.add(re.search(r"pierced by instrument +(\d+) prisms between columns", result.stdout)[1])
    assert len(counts) == 1, counts
