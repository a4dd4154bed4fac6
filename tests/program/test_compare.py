"""repose-compare from outside: the numbers of surfaces at known distances, its files, and what it
refuses."""

import json
import re
import subprocess
import sys

import meshio
import numpy as np
import pytest

import volumes as v
from conftest import PROJECT, expect_refusal


def sphere(file, radius, n=60):
    """A closed sphere around the origin, seen from outside counter-clockwise."""
    points, triangles = [[0, 0, radius], [0, 0, -radius]], []
    for j in range(1, n):
        for i in range(2 * n):
            a, b = np.pi * i / n, np.pi * j / n
            points.append(radius * np.array([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)]))

    def at(i, j):
        return 2 + (j - 1) * 2 * n + i % (2 * n)

    for i in range(2 * n):
        triangles += [[0, at(i, 1), at(i + 1, 1)], [1, at(i + 1, n - 1), at(i, n - 1)]]
        for j in range(1, n - 1):
            triangles += [[at(i, j), at(i, j + 1), at(i + 1, j + 1)],
                          [at(i, j), at(i + 1, j + 1), at(i + 1, j)]]
    meshio.Mesh(np.array(points, float), [("triangle", np.array(triangles))]).write(file)
    return file


def rows(text):
    """The table's numbers by the name of each row: samples, signed, mean, rms, 90 %, 95 %, max."""
    return {name: found[:4] + found[5:8] for name, found in full_rows(text).items()}


def full_rows(text):
    """Samples, signed, mean, rms, median, 90 %, 95 %, max, % within 1 mm, % within 2 mm."""
    pattern = r"^ *(\S.*?)  +(\d+)" + r" +(-?[\d.]+)" * 9 + r"$"
    return {m[1]: [float(n) for n in m.groups()[1:]] for m in re.finditer(pattern, text, re.M)}


@pytest.mark.quick
def test_spheres_two_millimeters_apart(run, tmp_path):
    result = run("repose-compare", sphere(tmp_path / "a.ply", 38), sphere(tmp_path / "b.stl", 40),
                 "-both", "-reach", "3")
    assert (result.returncode, result.stderr) == (0, ""), result
    there, back = rows(result.stdout)["PREDICTED to ACTUAL"], rows(result.stdout)["ACTUAL to PREDICTED"]
    assert there[1:] == pytest.approx([-2, 2, 2, 2, 2, 2], abs=0.06)
    assert back[1:] == pytest.approx([2, 2, 2, 2, 2, 2], abs=0.06)
    histogram = np.genfromtxt(tmp_path / "compared.csv", delimiter=",", names=True)
    assert histogram["share_of_area"].sum() == pytest.approx(1, abs=1e-4)
    fullest = histogram[np.argmax(histogram["share_of_area"])]
    assert fullest["low_mm"] <= -1.97 <= fullest["high_mm"] + 0.06
    assert "Name=\"distance\"" in (tmp_path / "compared.vtp").read_text()


def test_a_closed_surface_that_points_inward_is_turned(run, tmp_path):
    mesh = meshio.read(sphere(tmp_path / "b.ply", 32))
    meshio.Mesh(mesh.points, [("triangle", mesh.cells_dict["triangle"][:, ::-1])]).write(tmp_path / "inward.ply")
    result = run("repose-compare", sphere(tmp_path / "a.ply", 30), "inward.ply")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert rows(result.stdout)["PREDICTED to ACTUAL"][1] == pytest.approx(-2, abs=0.06)
    assert "note: triangles of inward.ply point inward" in result.stdout


def test_of_two_open_surfaces_the_one_that_points_inward_is_turned(run, tmp_path):
    for name, radius, step in (("small", 30, 1), ("large", 33, -1)):
        mesh = meshio.read(sphere(tmp_path / f"{name}.ply", radius))
        half = mesh.cells_dict["triangle"]
        half = half[mesh.points[half][:, :, 1].mean(axis=1) < 0][:, ::step]
        meshio.Mesh(mesh.points, [("triangle", half)]).write(tmp_path / f"{name}.ply")
    for files, signed in ((["small.ply", "large.ply"], -3), (["large.ply", "small.ply"], 3)):
        for register in "none", "all":
            result = run("repose-compare", *files, "-both", "-skip_rim", "-register", register)
            assert (result.returncode, result.stderr) == (0, "")
            assert "note: triangles of large.ply point inward; they are turned" in result.stdout
            found = rows(result.stdout)
            if register == "none":
                assert found["PREDICTED to ACTUAL"][1] == pytest.approx(signed, abs=0.1)
                assert found["ACTUAL to PREDICTED"][1] == pytest.approx(-signed, abs=0.1)


def test_corresponding_vertices_have_the_sign_of_the_surface(run, tmp_path):
    small, large = sphere(tmp_path / "a.ply", 38), sphere(tmp_path / "b.ply", 40)
    for predicted, actual, signed in ((small, large, -2), (large, small, 2)):
        found = rows(run("repose-compare", predicted, actual).stdout)["corresponding vertices"]
        assert found[1:] == pytest.approx([signed, 2, 2, 2, 2, 2], abs=1e-3)


def test_triangles_that_share_no_vertices_make_no_rims(run, tmp_path):
    mesh = meshio.read(sphere(tmp_path / "b.ply", 38, n=10))
    corners = mesh.points[mesh.cells_dict["triangle"]].reshape(-1, 3)
    meshio.Mesh(corners, [("triangle", np.arange(len(corners)).reshape(-1, 3))]).write(tmp_path / "soup.ply")
    sphere(tmp_path / "a.ply", 42)
    tables = [run("repose-compare", "a.ply", file, "-skip_rim").stdout for file in ("b.ply", "soup.ply")]
    assert rows(tables[0])["PREDICTED to ACTUAL"] == rows(tables[1])["PREDICTED to ACTUAL"]


def test_vertices_in_no_triangle_take_no_part(run, tmp_path):
    for name, radius, stray in (("a", 38, 900), ("b", 40, -900)):
        mesh = meshio.read(sphere(tmp_path / f"{name}.ply", radius, n=20))
        points = np.concatenate([mesh.points, np.full((50, 3), stray)])
        meshio.Mesh(points, mesh.cells).write(tmp_path / f"{name}.ply")
    found = rows(run("repose-compare", "a.ply", "b.ply").stdout)["corresponding vertices"]
    assert found == pytest.approx([2 + 19 * 40, -2, 2, 2, 2, 2, 2], abs=1e-3)


def test_regions_by_a_label_map(run, tmp_path):
    labels = np.zeros((40, 50, 48), "<i2")
    labels[:20], labels[20:] = 1, 2
    v.write_meta(tmp_path / "labels.mha", labels)
    k, j, i = 25, 20, 20
    middle = v.ORIGIN + v.TURN @ (v.SPACING * [i, j, k])
    mesh = meshio.read(sphere(tmp_path / "a.ply", 1, n=12))
    meshio.Mesh(mesh.points + middle, mesh.cells).write(tmp_path / "a.ply")
    result = run("repose-compare", "a.ply", "a.ply", "-regions", "labels.mha")
    assert result.returncode == 0, result
    assert [*rows(result.stdout)] == ["PREDICTED to ACTUAL", "corresponding vertices", "label 2"]


def paint(file, mesh, kind, names, values):
    """A text PLY of the mesh with what a person painted at its vertices."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(mesh.points)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"property {kind} {name}" for name in names]
    faces = mesh.cells_dict["triangle"]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(map(str, [*p, *v])) for p, v in zip(mesh.points, values)]
    rows += [" ".join(map(str, [3, *face])) for face in faces]
    file.write_text("\n".join(head + rows) + "\n")


def test_regions_painted_on_a_mesh(run, tmp_path):
    """A red cap, its rim blended with the white of the rest by the brush; and labels."""
    mesh = meshio.read(sphere(tmp_path / "a.ply", 40))
    sphere(tmp_path / "b.ply", 38)
    red = np.clip((mesh.points @ [1, 2, 3] / 14**0.5 - 10) / 4, 0, 1)
    colors = np.column_stack([np.full(len(red), 255), *[np.round(255 * (1 - red)).astype(int)] * 2])
    paint(tmp_path / "painted.ply", mesh, "uchar", ["red", "green", "blue"], colors)
    found = rows(run("repose-compare", "a.ply", "b.ply", "-regions", "painted.ply").stdout)
    assert {name for name in found if name.startswith("color")} == {"color 255 255 255", "color 255 0 0"}
    share = found["color 255 0 0"][0] / found["PREDICTED to ACTUAL"][0]
    assert share == pytest.approx((40 - 12) / 80, abs=0.06)  # area goes with height, samples nearly
    assert found["color 255 0 0"][1] == pytest.approx(2, abs=0.05)
    paint(tmp_path / "labels.ply", mesh, "int", ["label"], (mesh.points[:, :1] > 0).astype(int) + 6)
    found = rows(run("repose-compare", "a.ply", "b.ply", "-regions", "labels.ply").stdout)
    assert sum(found[f"label {n}"][0] for n in (6, 7)) == found["PREDICTED to ACTUAL"][0]
    assert found["label 6"][0] == pytest.approx(found["label 7"][0], rel=0.1)
    # What is far from all that is painted belongs to no region.
    moved = meshio.Mesh(mesh.points + [500, 0, 0], mesh.cells)
    paint(tmp_path / "far.ply", moved, "int", ["label"], [[1]] * len(mesh.points))
    result = run("repose-compare", "a.ply", "b.ply", "-regions", "far.ply")
    assert re.search(r"^ *label 1 +0 +-$", result.stdout, re.M), "no numbers without samples"


def test_numbers_around_landmarks(run, tmp_path):
    sphere(tmp_path / "b.ply", 40)
    mesh = meshio.read(sphere(tmp_path / "a.ply", 40))
    bump = mesh.points + np.outer(mesh.points[:, 2] > 35, [0, 0, 3.0])
    meshio.Mesh(bump, mesh.cells).write(tmp_path / "a.ply")
    (tmp_path / "marks.csv").write_text(
        "# CoordinateSystem = RAS\ntop, 0, 0, 40\nside, -40, 0, 0\nfar, 900, 0, 0\n")
    result = run("repose-compare", "a.ply", "b.ply", "-landmarks", "marks.csv", "-radius", "10")
    assert (result.returncode, result.stderr) == (0, ""), result
    found = rows(result.stdout)
    assert found["top"][1:] == pytest.approx([3] * 6, abs=0.2)
    assert found["side"][1:] == pytest.approx([0] * 6, abs=0.05)
    assert found["side"][0] > 100 and re.search(r"^ *far +0 +-$", result.stdout, re.M)


SKIN, MARKS = PROJECT / "meshes/head_skin.ply", PROJECT / "meshes/head.mrk.json"


def turned(points):
    """Moves points as a patient who lies differently."""
    a = np.radians(6)
    turn = [[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]
    return points @ np.array(turn).T + [4, -7, 9]


def marks_of(file):
    points = json.loads(file.read_text())["markups"][0]
    assert points["coordinateSystem"] == "LPS"
    return {p["label"]: np.array(p["position"]) for p in points["controlPoints"]}


@pytest.fixture
def follow_up(tmp_path):
    """A scan of the shipped head after its chin came 2.5 mm forward, elsewhere in space."""
    mesh, marks = meshio.read(SKIN), marks_of(MARKS)
    chin = marks["pogonion_soft"]

    def grown(points):
        near = np.clip(1.5 - np.linalg.norm(points - chin, axis=-1) / 20, 0, 1)
        return points + np.multiply.outer(near, [0, -2.5, 0])

    meshio.Mesh(turned(grown(mesh.points)), [("triangle", mesh.cells_dict["triangle"])]).write(
        tmp_path / "scan.ply")
    (tmp_path / "scan.csv").write_text("# CoordinateSystem = LPS\n" + "".join(
        f"{name},{x},{y},{z}\n" for name, place in marks.items()
        for x, y, z in [turned(grown(place))]))
    return tmp_path / "scan.ply"


def test_the_scorecard_finds_the_chin(run, follow_up):
    card = ["repose-compare", SKIN, follow_up, "-parts", "-landmarks", MARKS, "-actual_landmarks",
            follow_up.with_suffix(".csv"), "-register"]
    result = run(*card, "upper")
    assert (result.returncode, result.stderr) == (0, ""), result
    found = full_rows(result.stdout)
    chin, nose, all_of_it = found["chin"], found["nose"], found["corresponding vertices"]
    assert chin[1] < -0.3 and chin[7] == pytest.approx(2.5, abs=0.1)  # behind where the chin came
    assert nose[4] < 0.02 and nose[8:] == [100, 100] and chin[8] < 90
    assert all_of_it[0] == len(meshio.read(SKIN).points)
    assert all_of_it[7] == pytest.approx(2.5, abs=0.05)
    apart = dict(re.findall(r"^  (\w+) +([\d.]+)", result.stdout.split("predicted - actual")[1], re.M))
    assert float(apart["pogonion_soft"]) == pytest.approx(2.5, abs=0.05)
    assert float(apart["nasion_soft"]) < 0.05 and len(apart) == len(marks_of(MARKS))
    assert {"upper lip", "lower lip", "left cheek", "right cheek"} <= found.keys()
    # By all of it the chin pulls the rest along.
    assert full_rows(run(*card, "all").stdout)["chin"][7] < 3


def test_landmarks_off_their_mesh_get_a_note(run, follow_up):
    marks = follow_up.with_suffix(".csv")
    card = ["repose-compare", SKIN, follow_up, "-landmarks", MARKS, "-actual_landmarks", marks, "-register", "all"]
    assert "note" not in run(*card).stdout
    marks.write_text(marks.read_text().replace("LPS", "RAS"))
    assert re.search(r"^note: landmark \w+ lies [\d.]+ mm from \S*scan.ply", run(*card).stdout, re.M)


def test_beyond_the_rim_is_left_out(run, tmp_path):
    corners = np.array([[0, 0, 0], [40, 0, 0], [40, 40, 0], [0, 40, 0]], float)
    flat = meshio.Mesh(corners, [("triangle", np.array([[0, 1, 2], [0, 2, 3]]))])
    flat.write(tmp_path / "small.ply")
    flat.points = flat.points * 3 - [40, 40, -1]
    flat.write(tmp_path / "large.ply")
    whole = rows(run("repose-compare", "large.ply", "small.ply").stdout)["PREDICTED to ACTUAL"]
    inner = rows(run("repose-compare", "large.ply", "small.ply", "-skip_rim").stdout)
    assert whole[6] > 50
    assert inner["PREDICTED to ACTUAL"][1:] == [1, 1, 1, 1, 1, 1]


@pytest.mark.long
def test_the_histogram_is_drawn(run, tmp_path):
    pytest.importorskip("matplotlib")
    sphere(tmp_path / "a.ply", 38, n=12), sphere(tmp_path / "b.ply", 40, n=12)
    assert run("repose-compare", "a.ply", "b.ply", "-output", "d").returncode == 0
    script = [sys.executable, PROJECT / "drivers/plot_compare.py"]
    assert subprocess.run([*script, "d"], cwd=tmp_path).returncode == 0
    assert (tmp_path / "d.png").stat().st_size > 5000
    header = "low_mm,high_mm,share_of_area\n"
    (tmp_path / "one.csv").write_text(header + "-1,1,1\n")
    assert subprocess.run([*script, "one"], cwd=tmp_path).returncode == 0
    for name, text, part in (("e", None, "e.csv"), ("header", header, "has no rows"), ("empty", "", "has no rows"),
                             ("words", header + "a,1,1\n", "row 1 of column low_mm holds 'a', no finite number")):
        text is None or (tmp_path / f"{name}.csv").write_text(text)
        bad = subprocess.run([*script, name], cwd=tmp_path, text=True, capture_output=True)
        assert bad.returncode == 1 and len(bad.stderr.splitlines()) == 1 and part in bad.stderr, bad


CASES = {
    "no second surface": (["a.ply"], ["ACTUAL is missing"]),
    "missing file": (["a.ply", "none.ply"], ["none.ply", "no such file"]),
    "no mesh": (["a.ply", "text.ply"], ["text.ply"]),
    "no folder": (["a.ply", "a.ply", "-output", "no/such/x"], ["no/such/x"]),
    "no such regions": (["a.ply", "a.ply", "-regions", "none.nii"], ["none.nii"]),
    "unpainted regions": (["a.ply", "a.ply", "-regions", "a.ply"], ["a.ply", "neither colors"]),
    "no such landmarks": (["a.ply", "a.ply", "-landmarks", "none.csv"], ["none.csv"]),
    "parts of nothing": (["a.ply", "a.ply", "-parts"], ["-landmarks"]),
    "parts of a head without nose": (["a.ply", "a.ply", "-parts", "-landmarks", "marks.csv"],
                                     ["marks.csv", "pronasale is missing"]),
    "registered by nothing": (["a.ply", "a.ply", "-register", "upper"], ["-landmarks"]),
    "spacing of zero": (["a.ply", "a.ply", "-spacing", "0"], ["-spacing"]),
    "meters": (["a.ply", "meters.ply"], ["meters.ply is 0.001 times as large as a.ply", "not in mm"]),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_refused(run, tmp_path, case):
    arguments, words = CASES[case]
    sphere(tmp_path / "a.ply", 30, n=6)
    sphere(tmp_path / "meters.ply", 0.03, n=6)
    (tmp_path / "text.ply").write_text("no mesh\n")
    (tmp_path / "marks.csv").write_text("# CoordinateSystem = LPS\ntop, 0, 0, 40\n")
    expect_refusal(run, tmp_path, words, "repose-compare", *arguments)


def test_isosurfaces_of_two_levels_compare(run, tmp_path):
    v.write_meta(tmp_path / "ct.mha", v.samples())
    for name, level in (("inner", 1000), ("outer", 900)):
        assert run("repose-isosurface", "ct.mha", "-level", level,
                   "-output", f"{name}.ply").returncode == 0
    result = run("repose-compare", "inner.ply", "outer.ply")
    assert -2.1 < rows(result.stdout)["PREDICTED to ACTUAL"][1] < -0.9  # a tenth of the radii
