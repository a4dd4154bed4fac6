"""A real head (CT) whose jaw opens by 8° and comes 6 mm forward. The data are not
shipped: they lie beside the project, in ../shared/data/head."""

import re
from collections import defaultdict

import numpy as np
import pytest

from conftest import PROJECT, runner
from tissue import last, model_of, prism_volumes, steps

DATA = PROJECT.parent / "shared/data/head"
CHIN = [3.3, -303.9, 343.2]  # its tip on the skin, mm

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The scene and the surfaces it names."""
    top = tmp_path_factory.mktemp("real_head")
    for name in ("skin.ply", "skull.ply", "mandible.ply"):
        (top / name).symlink_to(DATA / name)
    (top / "scene.yaml").symlink_to(PROJECT / "meshes/real_head_springs.yaml")
    return top


@pytest.fixture(scope="module")
def face(folder, environment):
    """The result on two ranks, which must converge."""
    result = runner(folder, environment)("repose-solve", "scene.yaml", "-output", "face", ranks=2)
    assert (result.returncode, result.stderr) == (0, ""), result
    return folder / "face.h5"


def test_arrives_and_every_number_is_right(run, face):
    step = last(face)
    assert step["load"] == 1 and step["converged"] and step["displacement_error"] <= 0.1
    assert run("repose-check", face).returncode == 0


def test_tissue_is_never_inside_out(face):
    model = model_of(face)
    assert prism_volumes(model["point/position"], model["prism/points"])[0].min() > 0
    for step in steps(face):
        assert step["inverted_prisms"] == 0 and step["prism/volume_ratio"].min() > 0.5


def test_the_chin_moves_most(face):
    model, step = model_of(face), last(face)
    moved = np.linalg.norm(step["point/displacement"], axis=1)
    skin = np.unique(model["skin/points"])
    most = skin[np.argmax(moved[skin])]
    from_chin = np.linalg.norm(model["point/position"] - CHIN, axis=1)
    assert from_chin[most] < 20
    tip = skin[np.argmin(from_chin[skin])]
    assert moved[tip] > 0.9 * moved[most]
    jaw = (model["point/set"] == 2) & (model["point/bone"] == list(model["bone"]).index(b"mandible"))
    assert moved[most] == pytest.approx(moved[jaw].max(), rel=0.1)


def displacement_gradients(points, displacement, triangles):
    """The displacement's gradient in each triangle, [K, 3, 3], zero across it."""
    p, u = points[triangles], displacement[triangles]
    edges = np.stack([p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]], axis=2)
    changes = np.stack([u[:, 1] - u[:, 0], u[:, 2] - u[:, 0]], axis=2)
    return changes @ np.linalg.pinv(edges)


def neighbors(triangles):
    """Pairs of triangles that share an edge."""
    owners = defaultdict(list)
    for row, (a, b, c) in enumerate(triangles):
        for edge in ((a, b), (b, c), (c, a)):
            owners[tuple(sorted(edge))].append(row)
    return np.array([pair for pair in owners.values() if len(pair) == 2])


def test_the_skin_is_smooth(face):
    """Neighboring triangles are strained and turned alike."""
    model, step = model_of(face), last(face)
    triangles = model["skin/points"]
    gradient = displacement_gradients(model["point/position"], step["point/displacement"], triangles)
    one, other = neighbors(triangles).T
    jump = np.linalg.norm(gradient[one] - gradient[other], axis=(1, 2))
    assert jump.max() < 0.6
    assert np.quantile(jump, 0.99) < 0.25


@pytest.mark.long
def test_a_face_scanned_lying_is_in_equilibrium_and_hangs_upright(folder, run, tmp_path):
    (folder / "posture.yaml").symlink_to(PROJECT / "meshes/real_head_springs_posture.yaml")
    result = run("repose-solve", folder / "posture.yaml", "-stability", ranks=2)
    assert (result.returncode, result.stderr) == (0, ""), result
    row = next(line for line in result.stdout.splitlines() if "initial equilibrium" in line)
    left, before = float(row.split()[2]), float(row.split("left of")[1].split()[0])
    assert left <= 1e-12 * before
    file = tmp_path / "posture.h5"
    step = last(file)
    assert step["converged"] and step["smallest_eigenvalue"] > 0 and step["inverted_prisms"] == 0
    sag = step["point/displacement"][model_of(file)["point/layer"] == 0][:, 2]
    assert -4 < sag.min() < -2 and sag.max() < 0.5


def test_lips_of_a_split_jaw_are_named_where_they_are(run, folder):
    """The skin that is solved is chin and neck for the most part, and faces down."""
    for name in ("real_head_split.yaml", "real_head_split.obj"):
        (folder / name).symlink_to(PROJECT / "meshes" / name)
    result = run("repose-solve", "real_head_split.yaml", "-accuracy", "1", "-skip_other_rest", cwd=folder)
    rows = [line for line in result.stdout.splitlines() if "largest movement" in line]
    assert len(rows) == 1 and re.search(r"lower lip \d\.\d mm forward", rows[0]), result
    assert not re.search(r"(upper lip|nose) [3-9]\.\d mm", rows[0]), rows
