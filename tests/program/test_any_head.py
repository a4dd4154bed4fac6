"""Any mesh of a head's skin, however dirty, is solved as it comes, and all of one head move alike. The
data are not shipped: they lie beside the project, in ../shared/data/head."""

import base64
import re
from itertools import combinations

import meshio
import numpy as np
import pytest
from scipy.spatial import cKDTree

from conftest import PROJECT, runner
from tissue import last

DATA = PROJECT.parent / "shared/data/head"
SCENE = PROJECT / "meshes/real_head_ct.yaml"
BONES = {"skull": 1, "mandible": 2}
AXIS, CENTER = np.array([0.9995, 0.0038, -0.0327]), np.array([2.4, -208.2, 398.3])
VARIANTS = ["volume", "raw", "decimated", "turned", "noise", "soup"]

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")


def turn():
    """30° about an axis along none of the grid's."""
    x, y, z = np.array([1, 2, 3]) / 14**0.5
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 0.5 * cross + (1 - 0.75**0.5) * cross @ cross


def write(file, points, triangles):
    meshio.Mesh(points, [("triangle", triangles)]).write(file)


def soup(points, triangles, random):
    """2 % of the triangles and 40 discs of them gone, a tenth turned round."""
    triangles = triangles[random.random(len(triangles)) > 0.02]
    middle = points[triangles].mean(axis=1)
    for seed in middle[random.integers(0, len(middle), 40)]:
        middle[np.linalg.norm(middle - seed, axis=1) < 2.5] = np.nan
    triangles = triangles[np.isfinite(middle[:, 0])]
    flipped = random.random(len(triangles)) < 0.1
    triangles[flipped] = triangles[flipped][:, ::-1]
    return triangles


def scene_of(skin, prefix="", axis=AXIS, center=CENTER):
    bones = ", ".join(f"{{name: {bone}, file: {prefix}{bone}.ply}}" for bone in BONES)
    tissue = next(line for line in SCENE.read_text().splitlines() if "springs:" in line).strip()
    return (f"skin: {skin}\nbones: [{bones}]\ntissue: {{layers: 4, edge: 4, {tissue}}}\n"
            f"moves: [{{bone: mandible, rotate: {{axis: {axis.tolist()}, "
            f"center: {center.tolist()}, angle: 8}}}}]\n")


@pytest.fixture(scope="module")
def folder(tmp_path_factory, environment):
    """The scenes VARIANT.yaml of one head and what they name."""
    top = tmp_path_factory.mktemp("any_head")
    run = runner(top, environment)
    for name in ("head_hu.mhd", "head_hu.zraw", "labels.nii.gz"):
        (top / name).symlink_to(DATA / name)
    (top / "volume.yaml").symlink_to(SCENE)
    run("repose-isosurface", "head_hu.mhd", "-level", -300, "-largest", "-output", "raw.ply")
    for bone, label in BONES.items():
        run("repose-isosurface", "labels.nii.gz", "-label", label, "-largest",
            "-output", f"{bone}.ply")
    run("repose-decimate", DATA / "skin.ply", "-distance", 0.3, "-output", "decimated.ply")
    mesh, random = meshio.read(top / "raw.ply"), np.random.default_rng(1)
    points, triangles = mesh.points, mesh.cells_dict["triangle"]
    write(top / "noise.ply", points + random.normal(scale=0.5, size=points.shape), triangles)
    write(top / "soup.ply", points, soup(points, triangles, random))
    for part in ("raw", *BONES):
        mesh = meshio.read(top / f"{part}.ply")
        write(top / f"turned_{part}.ply", mesh.points @ turn().T, mesh.cells_dict["triangle"])
    for variant in ("raw", "decimated", "noise", "soup"):
        (top / f"{variant}.yaml").write_text(scene_of(f"{variant}.ply"))
    (top / "turned.yaml").write_text(
        scene_of("turned_raw.ply", "turned_", turn() @ AXIS, turn() @ CENTER))
    return top


def read_vtp(file):
    """Points, triangles and point data of a VTP file."""
    text, arrays = file.read_text(), {}
    for kind, name, width, data in re.findall(
            r'<DataArray type="(\w+)" Name="(\w+)" NumberOfComponents="(\d)"[^>]*>\s*(\S+)', text):
        values = np.frombuffer(base64.b64decode(data)[8:], "<f8" if kind[0] == "F" else "<i8")
        arrays[name] = values.reshape(-1, 3) if width == "3" else values
    return arrays


@pytest.fixture(scope="module")
def faces(folder, environment):
    """VARIANT → vertices over the solved skin, and their displacements, in the head's own frame."""
    run, found = runner(folder, environment), {}
    for variant in VARIANTS:
        result = run("repose-solve", f"{variant}.yaml", "-output", variant)
        assert (result.returncode, result.stderr) == (0, ""), result
        step = last(folder / f"{variant}.h5")
        assert step["load"] == 1 and step["converged"] and step["inverted_prisms"] == 0
        skin = read_vtp(folder / f"{variant}_given_skin.vtp")
        back = turn() if variant == "turned" else np.eye(3)
        solved = skin["solved"] == 1
        found[variant] = skin["Points"][solved] @ back, skin["displacement"][solved] @ back
    return found


def test_the_scene_has_ten_lines():
    lines = [line for line in SCENE.read_text().splitlines() if not line.startswith("#")]
    assert len(lines) == 10


def test_the_given_skin_keeps_its_vertices(folder, faces):
    mesh, skin = meshio.read(folder / "soup.ply"), read_vtp(folder / "soup_given_skin.vtp")
    assert np.array_equal(mesh.points, skin["Points"])
    assert np.array_equal(mesh.cells_dict["triangle"].ravel(), skin["connectivity"])


def test_the_chin_follows_the_jaw(faces):
    points, moved = faces["volume"]
    chin = np.argmin(np.linalg.norm(points - [3.3, -303.9, 343.2], axis=1))
    assert 12 < np.linalg.norm(moved[chin]) < 17 and moved[chin][2] < -8


@pytest.mark.parametrize("variant, other", combinations(VARIANTS, 2))
def test_all_move_alike(faces, variant, other):
    points, moved = faces[variant]
    off, nearest = cKDTree(faces[other][0]).query(points)
    near = off < 1
    assert near.sum() > 300
    apart = np.linalg.norm(moved[near] - faces[other][1][nearest[near]], axis=1)
    assert np.quantile(apart, 0.95) < 0.5


def test_metres_are_refused(folder, environment):
    mesh = meshio.read(folder / "decimated.ply")
    write(folder / "metres.ply", mesh.points / 1000, mesh.cells_dict["triangle"])
    (folder / "metres.yaml").write_text(scene_of("metres.ply"))
    result = runner(folder, environment)("repose-solve", "metres.yaml")
    assert result.returncode == 1 and "metres" in result.stderr
