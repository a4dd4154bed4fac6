"""One real head as people bring theirs: scenes of its jaw opened, their skins of many kinds."""

import base64
import pathlib
import re

import meshio
import numpy as np
from scipy.spatial import cKDTree

PROJECT = pathlib.Path(__file__).resolve().parents[2]
DATA = PROJECT.parent / "shared/data/head"
SCENE = PROJECT / "meshes/real_head_ct.yaml"
BONES = {"skull": 1, "mandible": 2}
AXIS, CENTER = np.array([0.9995, 0.0038, -0.0327]), np.array([2.4, -208.2, 398.3])
VARIANTS = ["volume", "raw", "decimated", "turned", "noise", "soup"]
LARGE = "clinic"  # 2.5 million triangles, with a table and a tube: too long for a test


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


def box(low, high):
    """Triangles of a box, [12, 3, 3]."""
    corners = np.array([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners[[(f[0], f[2 + k], f[1 + k]) for f in faces for k in (0, 1)]]


def tube(begin, end, radius, sides=48):
    """Triangles of an open tube, [2 sides, 3, 3]."""
    along = np.subtract(end, begin) / np.linalg.norm(np.subtract(end, begin))
    across = np.cross(along, [1, 0, 0]) / np.linalg.norm(np.cross(along, [1, 0, 0]))
    angle = np.linspace(0, 2 * np.pi, sides + 1)[:, None]
    ring = radius * (np.cos(angle) * across + np.sin(angle) * np.cross(along, across))
    a, b, c, d = ring[:-1] + begin, ring[1:] + begin, ring[:-1] + end, ring[1:] + end
    return np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])


def in_nine(corners):
    """Every triangle as nine, [9 n, 3, 3]."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]

    def at(i, j):
        return a + i / 3 * (b - a) + j / 3 * (c - a)
    parts = [(at(i, j), at(i + 1, j), at(i, j + 1)) for i in range(3) for j in range(3 - i)]
    parts += [(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)) for i in range(2) for j in range(2 - i)]
    return np.concatenate([np.stack(part, 1) for part in parts])


def write_stl(file, corners):
    """Binary STL of loose triangles [n, 3, 3], as 3D Slicer writes it."""
    rows = np.zeros(len(corners), [("normal", "<3f4"), ("corners", "<9f4"), ("more", "<u2")])
    rows["corners"] = corners.reshape(-1, 9)
    file.write_bytes(bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())


def make_large(top):
    """The raw skin of make_surfaces, finer, with the table it lies on and a tube in its mouth."""
    mesh = meshio.read(top / "raw.ply")
    low, high = mesh.points.min(0), mesh.points.max(0)
    table = box((low[0] - 50, high[1] - 3, low[2]), (high[0] + 50, high[1] + 20, high[2]))
    corners = in_nine(mesh.points[mesh.cells_dict["triangle"]])
    write_stl(top / f"{LARGE}.stl", np.concatenate(
        [corners, table, tube((2, -285, 369), (2, -380, 380), 4.5)]))
    (top / f"{LARGE}.yaml").write_text(scene_of(f"{LARGE}.stl"))


def scene_of(skin, edge=4, prefix="", axis=AXIS, center=CENTER):
    bones = ", ".join(f"{{name: {bone}, file: {prefix}{bone}.ply}}" for bone in BONES)
    return (f"skin: {skin}\nbones: [{bones}]\ntissue: {{layers: 4, edge: {edge}}}\n"
            f"moves: [{{bone: mandible, rotate: {{axis: {axis.tolist()}, "
            f"center: {center.tolist()}, angle: 8}}}}]\n")


def make_surfaces(top, run):
    """Puts the skins and bones of all variants into a folder; run(program, *arguments) runs one."""
    for name in ("head_hu.mhd", "head_hu.zraw", "labels.nii.gz"):
        (top / name).symlink_to(DATA / name)
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


def make_scenes(top, edge=4):
    """Writes VARIANT.yaml beside the surfaces."""
    (top / "volume.yaml").write_text(SCENE.read_text().replace("edge: 4", f"edge: {edge}"))
    for variant in ("raw", "decimated", "noise", "soup"):
        (top / f"{variant}.yaml").write_text(scene_of(f"{variant}.ply", edge))
    (top / "turned.yaml").write_text(
        scene_of("turned_raw.ply", edge, "turned_", turn() @ AXIS, turn() @ CENTER))


def read_vtp(file):
    """Points, triangles and point data of a VTP file."""
    text, arrays = file.read_text(), {}
    for kind, name, width, data in re.findall(
            r'<DataArray type="(\w+)" Name="(\w+)" NumberOfComponents="(\d)"[^>]*>\s*(\S+)', text):
        values = np.frombuffer(base64.b64decode(data)[8:], "<f8" if kind[0] == "F" else "<i8")
        arrays[name] = values.reshape(-1, 3) if width == "3" else values
    return arrays


def face_of(folder, variant):
    """Vertices over the solved skin and their displacements, in the head's own frame."""
    skin = read_vtp(folder / f"{variant}_given_skin.vtp")
    back, solved = turn() if variant == "turned" else np.eye(3), skin["solved"] == 1
    return skin["Points"][solved] @ back, skin["displacement"][solved] @ back


def apart(face, other):
    """Distances, mm, between displacements of two faces at vertices within 1 mm of each other."""
    off, nearest = cKDTree(other[0]).query(face[0])
    near = off < 1
    return np.linalg.norm(face[1][near] - other[1][nearest[near]], axis=1)
