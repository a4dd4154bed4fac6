"""Bones cut, moved and kept apart: repose-osteotomy, repose-collide and the shipped operations."""

import re
import shutil
from collections import Counter

import meshio
import numpy as np
import pytest

from conftest import PROJECT, runner, some_on_ranks
from tissue import last, model_of, prism_volumes

MESHES = PROJECT / "meshes"
DATA = PROJECT.parent / "shared/data/head"
PIECES = {"genioplasty": ("mandible", "chin"), "split": ("mandible", "jaw"),
          "le_fort": ("skull", "maxilla")}
REAL = pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")
HEADS = [pytest.param("head"), pytest.param("real_head", marks=REAL)]


@pytest.fixture
def folder(tmp_path):
    """Both heads' operations, and a scene to spoil."""
    for file in [*MESHES.glob("*head_*"), *DATA.glob("[fsm]*.ply")]:
        (tmp_path / file.name).symlink_to(file)
    return tmp_path


def surface(file):
    mesh = meshio.read(file)
    return mesh.points.astype(float), mesh.cells_dict["triangle"]


def volume(points, triangles):
    a, b, c = (points[triangles[:, k]] - points[0] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def is_closed_manifold(triangles):
    """Every edge is run through once each way."""
    runs = Counter((int(t[i]), int(t[(i + 1) % 3])) for t in triangles for i in range(3))
    return all(runs[a, b] == 1 and runs[b, a] == 1 for a, b in runs)


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize("operation", PIECES)
def test_parts_are_closed_and_nothing_is_lost(run, folder, head, operation):
    result = run("repose-osteotomy", f"{head}_{operation}.yaml", "-output", "plan", cwd=folder)
    assert (result.returncode, result.stderr) == (0, ""), result
    bone, piece = PIECES[operation]
    kerf = float(re.search(r"the saw takes (\d+) mm³", result.stdout)[1])
    whole = folder / (f"{bone}.ply" if head == "real_head" else f"{head}_{bone}.ply")
    parts = [surface(folder / f"plan_{name}.ply") for name in (bone, piece)]
    for points, triangles in parts:
        assert is_closed_manifold(triangles)
        assert volume(points, triangles) > 0
    total = sum(volume(*part) for part in parts)
    assert total + kerf == pytest.approx(volume(*surface(whole)), abs=0.6)


@pytest.mark.quick
def test_one_bone_from_the_command_line(run, folder):
    result = run("repose-osteotomy", MESHES / "head_mandible.ply", "-point", "0", "-88", "-52",
                 "-normal", "0", "0", "-1", "-piece", "chin", "-kerf", "1.5", cwd=folder)
    assert result.returncode == 0, result
    points, _ = surface(folder / "head_mandible_chin.ply")
    assert points[:, 2].max() == pytest.approx(-52.75, abs=1e-9)
    points, _ = surface(folder / "head_mandible_rest.ply")
    assert points[:, 2].min() == pytest.approx(-51.25, abs=1e-9)


def solve(environment, folder, scene):
    result = runner(folder, environment)("repose-solve", scene, "-output", "face", ranks=2,
                                         time_limit=400)
    assert (result.returncode, result.stderr) == (0, ""), result
    return folder / "face.h5"


@pytest.mark.parametrize("head", ["head", pytest.param("real_head", marks=[REAL, pytest.mark.long])])
def test_the_chin_takes_its_tissue_along(environment, folder, head):
    face = solve(environment, folder, f"{head}_genioplasty.yaml")
    model, step = model_of(face), last(face)
    assert step["load"] == 1 and step["converged"] and step["displacement_error"] <= 0.1
    assert prism_volumes(model["point/position"], model["prism/points"])[0].min() > 0
    assert step["inverted_prisms"] == 0
    chin = list(model["bone"]).index(b"chin")
    held = (model["point/set"] == 2) & (model["point/bone"] == chin)
    assert held.sum() > 50
    assert step["point/displacement"][held] == pytest.approx(np.tile([0, -8, 0], (held.sum(), 1)))
    moved = np.linalg.norm(step["point/displacement"], axis=1)
    skin = np.unique(model["skin/points"])
    most = skin[np.argmax(moved[skin])]
    assert 7 < moved[most] < 9
    above = model["point/position"][most] - model["point/position"][held]
    assert np.linalg.norm(above, axis=1).min() < 20


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize("operation", PIECES)
def test_every_operation_builds(run, folder, head, operation):
    result = run("repose-solve", f"{head}_{operation}.yaml", "-dry_run", cwd=folder)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert f"piece '{PIECES[operation][1]}' of" in result.stdout


def collide(run, folder, *options):
    result = run("repose-collide", *options, cwd=folder)
    assert (result.returncode, result.stderr) == (0, ""), result
    return result.stdout


def test_contacts_are_found_and_none_is_made_up(run, folder):
    assert "as planned" in collide(run, folder, "head_genioplasty.yaml")
    assert "as planned" in collide(run, folder, "head_jaw_advance.yaml")
    tight = collide(run, folder, "head_jaw_advance.yaml", "-clearance", "2")
    assert "up to load" in tight
    split = collide(run, folder, "head_split.yaml")
    assert "'mandible' and 'jaw', 0.50 mm apart at the start: come within" in split


def scene_with(folder, text, base="head_jaw_advance.yaml"):
    """A scene with more keys."""
    (folder / "scene.yaml").write_text((MESHES / base).read_text() + text)
    return "scene.yaml"


@pytest.mark.quick
def test_a_clamped_jaw_stops_at_the_clearance(run, folder):
    scene = (MESHES / "head_jaw_advance.yaml").read_text().replace("[0, -6, 0]", "[0, 0, 9]")
    (folder / "scene.yaml").write_text(scene + "collision: {mode: clamp, clearance: 0.5}\n")
    result = run("repose-solve", "scene.yaml", "-dry_run", cwd=folder)
    assert result.returncode == 0, result
    assert re.search(r"all moves end at load 0\.\d+ of the plan", result.stdout)
    (folder / "scene.yaml").write_text(scene + "collision: {mode: stop}\n")
    result = run("repose-solve", "scene.yaml", cwd=folder)
    assert result.returncode == 1
    assert "bones 'skull' and 'mandible'" in result.stderr and "collision.mode" in result.stderr
    assert len(result.stderr.splitlines()) == 1


CUT = "osteotomies:\n  - {bone: mandible, piece: chin, %s}\n"
PLANE = "planes: [{point: [0, -88, -52], normal: [0, 0, %s]}]"
BAD_SCENES = {
    "a plane that misses the bone": (
        CUT % "planes: [{point: [0, 0, 90], normal: [0, 0, 1]}]",
        ["osteotomies[0]", "chin", "misses the bone", "in front of its plane"]),
    "a plane that ends inside the bone": (
        CUT % "planes: [{point: [0, -80, -52], normal: [0, 0, -1], radius: 20}]",
        ["osteotomies[0]", "chin", "ends inside the bone"]),
    "a piece that comes out empty": (
        CUT % "planes: [{point: [0, 0, -52], normal: [0, 0, -1]}, {point: [0, 0, -40], "
        "normal: [0, 0, 1]}]", ["osteotomies[0]", "chin", "comes out empty"]),
    "a seed outside the bone": (
        CUT % (PLANE % "-1" + ", seed: [0, 0, 90]"), ["chin", "seed", "not inside the bone"]),
    "a move of a bone that does not exist": (
        CUT % (PLANE % "-1") + "landmarks: head_landmarks.json\n",
        ["moves[0].bone", "chinn", "chin"]),
    "an unknown landmark": (
        "landmarks: head_landmarks.json\n", ["moves[0].landmark.from", "pogonio_bone",
                                             "pogonion_bone"]),
}


@pytest.mark.parametrize("case, ranks", some_on_ranks(BAD_SCENES, 3))
def test_bad_plans_are_refused_in_one_line(run, folder, case, ranks):
    text, words = BAD_SCENES[case]
    scene_with(folder, text)
    file = folder / "scene.yaml"
    if "does not exist" in case:
        file.write_text(file.read_text().replace("bone: mandible, translate", "bone: chinn, translate"))
    if "landmark" in case:
        file.write_text(file.read_text().replace(
            "translate: [0, -6, 0]", "landmark: {from: pogonio_bone, to: [0, 0, 0]}"))
    before = sorted(folder.iterdir())
    for program in ("repose-solve", "repose-collide", "repose-osteotomy"):
        result = run(program, "scene.yaml", ranks=ranks, cwd=folder)
        assert result.returncode == 1, result
        assert len(result.stderr.splitlines()) == 1, result.stderr
        assert [word for word in words if word not in result.stderr] == [], result.stderr
        assert "scene.yaml" in result.stderr
        assert sorted(folder.iterdir()) == before


def crossed_bone(folder):
    """Two balls that go through each other, in one surface."""
    points, triangles = surface(MESHES / "head_mandible.ply")
    both = np.concatenate([points, points + [11, 3, 2]])
    cells = np.concatenate([triangles, triangles + len(points)])
    meshio.Mesh(both, [("triangle", cells)]).write(folder / "crossed.ply", binary=False)
    return "crossed.ply"


PLANE_OPTIONS = ["-point", "0", "-88", "-52", "-normal", "0", "0", "-1"]
BAD_BONES = {
    "no cut": (lambda f: ["head_mandible.ply"], ["-point", "-normal"]),
    "half a plane": (lambda f: ["head_mandible.ply", "-point", "0", "0", "0"], ["-normal"]),
    "too few numbers": (lambda f: ["head_mandible.ply", "-point", "0", "0"], ["-point"]),
    "a normal whose square overflows": (
        lambda f: ["head_mandible.ply", *PLANE_OPTIONS[:-1], "1e155"], ["-normal", "1e155", "1e+07"]),
    "a point beyond any body": (
        lambda f: ["head_mandible.ply", *PLANE_OPTIONS, "-point", "0", "0", "1e300"], ["-point", "1e300"]),
    "an open bone": (lambda f: ["head_skin.ply", *PLANE_OPTIONS], ["head_skin.ply", "open"]),
    "a bone that intersects itself": (
        lambda f: [crossed_bone(f), *PLANE_OPTIONS], ["crossed.ply", "intersects itself"]),
    "a scene with options": (lambda f: ["head_split.yaml", "-kerf", "1"], ["-kerf"]),
    "a scene without osteotomies": (lambda f: ["head_jaw_advance.yaml"], ["no osteotomies"]),
    "a piece outside the folder": (
        lambda f: ["head_mandible.ply", *PLANE_OPTIONS, "-piece", "../x"], ["-piece '../x'", "'/'"]),
    "a piece without a name": (
        lambda f: ["head_mandible.ply", *PLANE_OPTIONS, "-piece", ""], ["-piece"]),
    "a piece named as the rest": (
        lambda f: ["head_mandible.ply", *PLANE_OPTIONS, "-piece", "rest"], ["-piece 'rest'"]),
    "a missing bone": (lambda f: ["nowhere.ply", *PLANE_OPTIONS], ["nowhere.ply"]),
    "a cutter that is no mesh": (
        lambda f: ["head_mandible.ply", "-surface", "head_split.yaml"], ["head_split.yaml"]),
}


@pytest.mark.parametrize("case", BAD_BONES)
def test_bad_cuts_are_refused_in_one_line(run, folder, case):
    make, words = BAD_BONES[case]
    arguments = make(folder)
    before = sorted(folder.iterdir())
    result = run("repose-osteotomy", *arguments, cwd=folder, time_limit=60)
    assert result.returncode == 1, result
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert [word for word in words if word not in result.stderr] == [], result.stderr
    assert sorted(folder.iterdir()) == before


@pytest.mark.quick
def test_a_planned_landmark_is_reached(run, folder):
    scene = (MESHES / "head_genioplasty.yaml").read_text()
    shutil.copy(MESHES / "head_landmarks.json", folder / "points.json")
    (folder / "scene.yaml").write_text(scene.replace(
        "translate: [0, -8, 0]", "landmark: {from: pogonion_bone, to: [0, -99.8706, -62]}")
        + "landmarks: points.json\n")
    one = collide(run, folder, "scene.yaml")
    other = collide(run, folder, "head_genioplasty.yaml")
    assert one.split("time")[0] == other.split("time")[0]
