"""Any mesh of a head's skin, however dirty, is solved as it comes, and all of one head move alike. The
data are not shipped: they lie beside the project, in ../shared/data/head."""

from itertools import combinations

import h5py
import meshio
import numpy as np
import pytest

from conftest import runner
from heads import (DATA, SCENE, VARIANTS, apart, face_of, make_scenes, make_surfaces, read_vtp,
                   scene_of, write)
from tissue import last

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")


@pytest.fixture(scope="module")
def folder(tmp_path_factory, environment):
    """The scenes VARIANT.yaml of one head and what they name."""
    top = tmp_path_factory.mktemp("any_head")
    make_surfaces(top, runner(top, environment))
    make_scenes(top)
    return top


@pytest.fixture(scope="module")
def faces(folder, environment):
    """VARIANT → vertices over the solved skin, and their displacements, in the head's own frame."""
    run = runner(folder, environment)
    for variant in VARIANTS:
        result = run("repose-solve", f"{variant}.yaml", "-output", variant)
        assert (result.returncode, result.stderr) == (0, ""), result
        step = last(folder / f"{variant}.h5")
        assert step["load"] == 1 and step["converged"] and step["inverted_prisms"] == 0
    return {variant: face_of(folder, variant) for variant in VARIANTS}


def test_the_scene_has_ten_lines():
    lines = [line for line in SCENE.read_text().splitlines() if not line.startswith("#")]
    assert len(lines) == 10


def test_the_given_skin_keeps_its_vertices(folder, faces):
    mesh, skin = meshio.read(folder / "soup.ply"), read_vtp(folder / "soup_given_skin.vtp")
    assert np.array_equal(mesh.points, skin["Points"])
    assert np.array_equal(mesh.cells_dict["triangle"].ravel(), skin["connectivity"])
    with h5py.File(folder / "soup.h5") as h5:
        held = {name: array[:] for name, array in h5["given_skin"].items()}
    assert np.array_equal(held["points"], mesh.points)
    assert np.array_equal(held["triangles"], mesh.cells_dict["triangle"])
    assert np.array_equal(held["displacement"].ravel(), skin["displacement"].ravel())
    assert np.array_equal(held["solved"], skin["solved"])


def test_the_chin_follows_the_jaw(faces):
    points, moved = faces["volume"]
    chin = np.argmin(np.linalg.norm(points - [3.3, -303.9, 343.2], axis=1))
    assert 12 < np.linalg.norm(moved[chin]) < 17 and moved[chin][2] < -8


@pytest.mark.parametrize("variant, other", combinations(VARIANTS, 2))
def test_all_move_alike(faces, variant, other):
    distances = apart(faces[variant], faces[other])
    assert len(distances) > 300 and np.quantile(distances, 0.95) < 0.5


def test_a_painted_face_is_solved_in_place_of_that_over_the_jaw(folder, environment, faces):
    skin = read_vtp(folder / "raw_given_skin.vtp")
    within = np.linalg.norm(skin["Points"] - [2, -290, 360], axis=1) < 70
    meshio.Mesh(skin["Points"], [("triangle", skin["connectivity"].reshape(-1, 3))],
                point_data={"paint": within.astype(float)}).write(folder / "painted.ply")
    scene = scene_of("raw.ply").replace(
        "edge: 4", "edge: 4, face: [{painted: {mesh: painted.ply, property: paint}}]")
    (folder / "of_paint.yaml").write_text(scene)
    result = runner(folder, environment)("repose-solve", "of_paint.yaml", "-output", "of_paint")
    assert (result.returncode, result.stderr) == (0, ""), result
    solved = read_vtp(folder / "of_paint_given_skin.vtp")["solved"] == 1
    outer = solved & ~within
    assert 0.85 < solved.sum() / (within & (skin["solved"] == 1)).sum() < 1.15
    assert outer.sum() < 0.05 * solved.sum()


@pytest.mark.parametrize("variant, why", [
    ("raw", "more than 100000 triangles"), ("decimated", "closed, as that of a whole head"),
    ("soup", "more than 100000 triangles"), ("folded", "inside bone")])
def test_a_skin_without_a_key_is_remeshed_where_it_must_be(folder, environment, variant, why):
    if variant == "folded":  # open at the neck, and a wall of its own inside the skull
        mesh, wall = meshio.read(DATA / "face.ply"), meshio.read(DATA / "face.ply")
        points = np.where(mesh.points[:, 2:] > 470, mesh.points + [0, 60, 0], mesh.points)
        write(folder / "folded.ply", points, wall.cells_dict["triangle"])
    (folder / "keyless.yaml").write_text(scene_of(f"{variant}.ply").replace(", edge: 4", ""))
    result = runner(folder, environment)("repose-solve", "keyless.yaml", "-dry_run")
    assert (result.returncode, result.stderr) == (0, ""), result
    remarks = [line for line in result.stdout.splitlines() if "was remeshed" in line]
    assert len(remarks) == 1 and why in remarks[0] and "tissue.edge: given" in remarks[0]


def test_an_insisted_edge_lists_and_writes_all_places(folder, environment):
    (folder / "as_it_is.yaml").write_text(scene_of("raw.ply").replace(", edge: 4", ", edge: given"))
    result = runner(folder, environment)("repose-solve", "as_it_is.yaml")
    assert result.returncode == 1 and result.stderr.count("\n") == 1
    assert "in 2 places" in result.stderr and "inside bone" in result.stderr
    places = meshio.read(folder / "as_it_is_refused.ply")
    assert 300 < len(places.points) < 1000


def test_meters_are_refused(folder, environment):
    mesh = meshio.read(folder / "decimated.ply")
    write(folder / "meters.ply", mesh.points / 1000, mesh.cells_dict["triangle"])
    (folder / "meters.yaml").write_text(scene_of("meters.ply"))
    result = runner(folder, environment)("repose-solve", "meters.yaml")
    assert result.returncode == 1 and "meters" in result.stderr
