"""drivers/sheet, what report.py, render.py and others share: surfaces made coarser, landmarks, written files."""

import json
import os
import re
import resource
import struct
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from conftest import PROJECT

sys.path[:0] = [str(PROJECT / "drivers"), str(PROJECT / "drivers/python")]
from repose.scene import Scene  # noqa: E402
from sheet import tables  # noqa: E402
from sheet.appearance import read_appearance, read_ply  # noqa: E402
from sheet.landmarks import STANDARD, on_surface, place_landmarks, read_landmarks  # noqa: E402
from sheet.measures import MEASURES, following, read_norms  # noqa: E402
from sheet.meshes import coarser  # noqa: E402
from sheet.page import plan_table  # noqa: E402
from sheet.profile import middle_plane  # noqa: E402
from sheet.published import PUBLISHED  # noqa: E402
from sheet.scene import read_scene, with_moves  # noqa: E402
from sheet.script import Unusable, own_names  # noqa: E402
from sheet.shown_skin import Skin, matching_rows, rows_of_patient  # noqa: E402
from sheet.whole_file import Target  # noqa: E402
from sheet.words import to_html  # noqa: E402

pytestmark = pytest.mark.quick


def parted_sheet(n, wide):
    """A flat sheet of n × n vertices with a seam along the middle row, doubled but at its ends: states
    before and after, in which the half beyond the seam has moved by `wide`, and corners."""
    y, x = np.divmod(np.arange(n * n), n)
    row, middle = np.arange(n * n).reshape(n, n), n // 2
    seam = row[middle, 2:-2]
    before = np.stack([x, y, 0.0 * x], axis=1)
    before = np.concatenate([before, before[seam]])
    upper = row.copy()
    upper[middle, 2:-2] = np.arange(n * n, len(before))
    after = before.copy()
    after[upper[middle:, 2:-2].ravel(), 1] += wide
    corners = []
    for rows, grid in ((range(middle), row), (range(middle, n - 1), upper)):
        for r in rows:
            a, b, c, d = grid[r, :-1], grid[r, 1:], grid[r + 1, 1:], grid[r + 1, :-1]
            corners += [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    return [before, after], np.concatenate(corners)


def border_of(corners):
    ends = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    found, count = np.unique(ends, axis=0, return_counts=True)
    return found[count == 1]


@pytest.mark.parametrize("wide, open_edges", [(4.0, True), (0.0, False)])
def test_a_coarser_surface_keeps_its_cuts_open_and_welds_other_seams(wide, open_edges):
    (before, after), corners = parted_sheet(41, wide)
    most = len(corners) // 4
    (coarse, moved), faces, (height,) = coarser([before, after], corners, [before[:, 1]], most)
    assert 0.5 * most < len(faces) <= most and faces.max() < len(coarse)
    assert np.allclose(height, coarse[:, 1]), "fields go with the vertices"
    inside = coarse[border_of(faces)].mean(1)
    inside = inside[(inside[:, :2] > 2.5).all(1) & (inside[:, :2] < 37.5).all(1)]
    assert (len(inside) > 10) == open_edges, inside
    assert np.abs(inside[:, 1] - 20).max(initial=0) < 1, "the border is that of the seam"
    sides = (moved - coarse)[np.abs(coarse[:, 1] - 20) < 1][:, 1]
    assert sides.max() == pytest.approx(wide) and sides.min() == pytest.approx(0)


def parted_skin(n, jagged=0.0):
    """A parted sheet of 40 × 40 mm, whose far half moves by 4 mm."""
    (before, after), corners = parted_sheet(n, 4.0)
    places = before * 40 / (n - 1)
    places[:, 1] += jagged * np.sin(40 * places[:, 0])
    return Skin(places, places + after - before, corners, np.ones(len(places)))


@pytest.mark.parametrize("n", [41, 31, 21])
def test_a_skin_is_compared_with_the_same_side_of_a_cut(n):
    one, other = parted_skin(41), parted_skin(n, jagged=0.3)
    off = other.movement - one.movement[matching_rows(one, other)]
    inside = np.abs(other.before[:, :2] - 20).max(1) < 15
    assert np.abs(off[inside]).max() < 1e-9


def test_equal_skins_are_compared_row_by_row():
    one, other = parted_skin(21), parted_skin(21)
    assert (matching_rows(one, other) == np.arange(len(one.before))).all()
    other.before += [0, 0, 6]
    with pytest.raises(Unusable, match="b.h5: not the skin of a.h5; two plans of one patient"):
        rows_of_patient(one, other, ["a.h5", "b.h5"])


# ----- landmarks


def test_a_landmark_goes_to_the_nearest_place_of_all_triangles():
    generator = np.random.default_rng(7)
    places, corners = generator.normal(size=(60, 3)), generator.integers(0, 60, (90, 3))
    weights = generator.dirichlet([1, 1, 1], 20_000)
    samples = (weights @ places[corners]).reshape(-1, 3)
    for point in generator.normal(size=(20, 3)) * 1.5:
        near, _, distance = on_surface(places, places, corners, point)
        sampled = np.linalg.norm(samples - point, axis=1).min()
        assert sampled - 0.02 < distance < sampled + 1e-9
        assert distance == pytest.approx(np.linalg.norm(near - point))


def test_a_chin_aside_does_not_tilt_the_plane_of_symmetry():
    straight = {"nasion": (0.0, -90, 60), "pronasale": (0, -110, 20), "upper lip": (0, -95, -5)}
    aside = straight | {"pogonion": (8.0, -90, -40), "menton": (8, -80, -50)}
    middle, normal = middle_plane(None, {name: [np.array(place)] for name, place in aside.items()})
    assert middle[0] == 0 and normal == pytest.approx([1, 0, 0])


def test_a_landmark_amid_a_large_triangle_of_bone_goes_with_the_bone():
    corners = np.array([[0, 1, 2]])
    flat = np.array([[-30.0, 0, 0], [30, 0, 0], [0, 0, 50]])
    skin = Skin(flat + [0, -9, 0], flat + [0, -9, 0], corners, np.ones(3))
    bone = {"name": "jaw", "before": flat, "corners": corners, "motion": (np.eye(3), np.array([0, -5, 0]))}
    result = SimpleNamespace(solved=skin, given=None, bones=[bone])
    (placed,), lost = place_landmarks(result, {"pogonion": np.array([0, 0.5, 15])})
    assert placed["on"] == "jaw" and placed["after"].tolist() == [0, -4.5, 15] and not lost


MARKUP = '{{"markups": [{{"coordinateSystem": "{}", "controlPoints": [{{"label": "a b", "position": {}}}]}}]}}'
SAME = {"lps.mrk.json": MARKUP.format("LPS", "[1, -2, 3.5]"),
        "UPPER.MRK.JSON": MARKUP.format("LPS", "[1, -2, 3.5]"), "ras.mrk.json": MARKUP.format("RAS", "[-1, 2, 3.5]"),
        "named.json": '{"a b": [1, -2, 3.5], "about": "a head"}',
        "lps.csv": "# CoordinateSystem = LPS\nname, x, y, z\n\"a b\", 1, -2, 3.5\n",
        "ras.csv": "\ufeff# CoordinateSystem = RAS\r\na b,-1,2,3.5\r\n",
        "ras.fcsv": "# Markups fiducial file version = 4.6\n# CoordinateSystem = 0\n"
                    "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
                    "vtkMRMLMarkupsFiducialNode_0,-1,2,3.5,0,0,0,1,1,1,0,a b,\"of the, skin\",\n",
        "lps.fcsv": "# CoordinateSystem = LPS\n# columns = label,x,y,z\na b,1,-2,3.5\n"}


@pytest.mark.parametrize("name", SAME)
def test_every_format_of_landmarks_is_read_in_lps(tmp_path, run, name):
    (tmp_path / name).write_text(SAME[name], encoding="utf-8")
    (position,) = read_landmarks(tmp_path / name).items()
    assert position[0] == "a b" and position[1].tolist() == [1, -2, 3.5]
    (tmp_path / "other.csv").write_text("# CoordinateSystem = LPS\nnone, 0, 0, 0\n")
    mesh = PROJECT / "meshes/head_skin.ply"
    refused = run("repose-register", mesh, mesh, "-landmarks", name, "other.csv", "-output", "o")
    assert "common" in refused.stderr, "the programs read it, too: " + refused.stderr


REFUSED = {"null.json": "null", "list.json": "[1, 2]", "deep.json": "[" * 100_000, "empty.json": "{}",
           "nan.json": '{"a": [NaN, 0, 0]}', "word.json": '{"a": ["x", 0, 0]}', "none.mrk.json": '{"markups": [3]}',
           "frame.mrk.json": MARKUP.format("IJK", "[1, 2, 3]"), "short.mrk.json": MARKUP.format("LPS", "[1, 2]"),
           "frame.csv": "a, 1, 2, 3\n", "short.csv": "# CoordinateSystem = LPS\n1, 2\n",
           "long.csv": "# CoordinateSystem = LPS\na, 1, 2, 3, 4\n", "empty.fcsv": "", "a.txt": "a, 1, 2, 3\n",
           "word.csv": "# CoordinateSystem = LPS\na, 1, 2, 3\nb, 1, x, 3\n"}


@pytest.mark.parametrize("name", REFUSED)
def test_files_that_are_no_landmarks_are_refused(tmp_path, name):
    (tmp_path / name).write_text(REFUSED[name])
    with pytest.raises(Unusable, match=f"{name}: "):
        read_landmarks(tmp_path / name)


def test_names_of_landmarks_are_those_of_the_programs():
    text = (PROJECT / "src/scene/landmark_names.cpp").read_text()
    listed = {name: tuple(re.findall(r'"([^"]+)"', others))
              for name, others in re.findall(r'\{"(\w+)",\s*\{([^}]*)\}', text)}
    assert len(listed) > 20 and listed == {name: STANDARD[name] for name in listed}


@pytest.mark.parametrize("spelling, name", [
    ("Condyle Right-Center", "condyle_right_center"), ("Right Condyle", "condyle_right_center"),
    (" Pog\u2032", "pogonion_soft"), ("N", "nasion_bone"), ("GLABELLA", "glabella_soft"), ("L1", "lower_incisor_edge"),
    ("Soft_Tissue.Pogonion", "pogonion_soft"), ("Orbitale Left", "Orbitale Left"), ("U 1", "U 1")])
def test_names_of_landmarks_are_read_in_any_spelling(tmp_path, spelling, name):
    (tmp_path / "marks.json").write_text(json.dumps({spelling: [1, 2, 3], name: [1, 2, 3]}))
    assert list(read_landmarks(tmp_path / "marks.json")) == [name]


TWICE = {"spelled.json": '{"Pog": [0, 0, 0], "pogonion bone": [0, 0, 3]}',
         "key.json": '{"a b": [0, 0, 0], "a b": [0, 0, 3]}',
         "label.mrk.json": MARKUP.format("LPS", '[0, 0, 0]}, {"label": "a b", "position": [0, 0, 3]'),
         "row.csv": "# CoordinateSystem = LPS\na b, 0, 0, 0\na b, 0, 0, 3\n"}


@pytest.mark.parametrize("name, words", [
    ("spelled.json", "'Pog' and 'pogonion bone' are both pogonion_bone, 3.0 mm apart; remove one"),
    ("key.json", "'a b' comes twice; remove one"), ("label.mrk.json", "are both a b, 3.0 mm apart"),
    ("row.csv", "are both a b, 3.0 mm apart")])
def test_two_landmarks_of_one_name_are_refused(tmp_path, name, words):
    (tmp_path / name).write_text(TWICE[name])
    with pytest.raises(Unusable, match=words):
        read_landmarks(tmp_path / name)
    (tmp_path / name).write_text(TWICE[name].replace("3", "0"))
    assert len(read_landmarks(tmp_path / name)) == 1


def test_a_list_of_three_points_is_no_place(tmp_path):
    more = '[0, 0, 0]}, {"label": "scar", "position": [0, 0, 3]}, {"label": "mole", "position": [0, 0, 6]'
    (tmp_path / "three.mrk.json").write_text(MARKUP.format("LPS", more))
    assert list(read_landmarks(tmp_path / "three.mrk.json")) == ["a b", "scar", "mole"]


def test_other_keys_and_places_that_agree_may_come_twice(tmp_path):
    (tmp_path / "marks.json").write_text('{"note": "x", "note": "y", "a b": [0, 0, 0], "a b": [0, 0, 0.0005]}')
    assert list(read_landmarks(tmp_path / "marks.json")) == ["a b"]


# ----- text as Windows saves it


MARKED = "\ufeff# a plan\r\nskin: face.ply\r\n"


def test_a_scene_that_is_written_again_begins_without_a_byte_order_mark(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(MARKED, encoding="utf-8", newline="")
    Scene(scene).with_plan(["chin"], tmp_path / "planned.yaml")
    for text in ((tmp_path / "planned.yaml").read_text(encoding="utf-8"), with_moves(scene, {}),
                 tables.provenance(Nothing(tmp_path), scene)):
        assert "skin: face.ply" in text and "\ufeff" not in text


class Nothing:
    """A result of which a page states where it is from."""

    def __init__(self, folder):
        self.file, self.origin, self.counts = folder / "scene.yaml", {}, {}
        self.end = {"functional": "", "volume": "", "bulk_modulus": 1.0, "lambda": 1.0}


def test_norms_with_a_byte_order_mark_are_read(tmp_path):
    group = {"source": "ours", "population": "12", "norms": {"facial convexity": [9, 2]}}
    (tmp_path / "norms.json").write_text(json.dumps([group]), encoding="utf-8-sig")
    assert read_norms(tmp_path / "norms.json") == [group]


@pytest.mark.parametrize("stored", ['""', "{}", "[]", '[{"source": "ours", "population": "12", "norms": '
                                    '{"facial convexity": [9, Infinity]}}]'])
def test_norms_that_are_none_are_refused(tmp_path, stored):
    (tmp_path / "norms.json").write_text(stored)
    with pytest.raises(Unusable, match="norms.json"):
        read_norms(tmp_path / "norms.json")


def test_a_plan_of_any_pieces_is_written(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text("skin: face.ply\n")
    for pieces in ("chin", ["left, upper", "Kinn: #1", "menton à l'avant 🙂"]):
        planned = Scene(scene).with_plan(pieces, tmp_path / "planned.yaml")
        assert read_scene(planned.path)["plan"]["pieces"] == (pieces if isinstance(pieces, list) else [pieces])


# ----- colors of a skin


COLORED = ("ply\nformat {} 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
           "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n")


@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["Unix", "Windows"])
@pytest.mark.parametrize("layout", ["ascii", "binary_little_endian"])
def test_colors_are_read_whatever_the_line_ends(tmp_path, layout, end):
    head = COLORED.format(layout).replace("\n", end).encode()
    body = f"1 2 3 4 5 6{end}-1 -2 -3 7 8 9{end}".encode() if layout == "ascii" else b"".join(
        struct.pack("<3f3B", *row) for row in ((1, 2, 3, 4, 5, 6), (-1, -2, -3, 7, 8, 9)))
    (tmp_path / "skin.ply").write_bytes(head + body)
    points, colors = read_ply(tmp_path / "skin.ply")
    assert points.tolist() == [[1, 2, 3], [-1, -2, -3]] and colors.tolist() == [[4, 5, 6], [7, 8, 9]]


@pytest.mark.parametrize("body, part", [
    ("1 2 3 4 5 6\n", "vertex 2 of 2 is missing or incomplete"),
    ("1 2 3 4 5 6\n1 2 3 4 5\n", "vertex 2 of 2 is missing or incomplete"),
    ("1 2 3 4 5 6\n1 2 nan 4 5 6\n", "not a finite number"), ("1 2 3 4 5 6\n1 2 x 4 5 6\n", "x")])
def test_damaged_colors_are_refused(tmp_path, body, part):
    (tmp_path / "skin.ply").write_text(COLORED.format("ascii") + body)
    with pytest.raises(Unusable, match=f"skin.ply: damaged, or not a mesh of the skin: .*{part}"):
        read_appearance(tmp_path / "skin.ply", None)


@pytest.mark.parametrize("most", ["mesh", "skin"])
def test_colors_of_a_part_of_the_skin_are_taken(tmp_path, most):
    part = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    whole = np.concatenate([part, part + 50, part + 60])
    mesh, skin = (whole, part) if most == "mesh" else (part, whole)
    (tmp_path / "skin.obj").write_text("".join(f"v {x} {y} {z} 0 {k} 0\n" for k, (x, y, z) in enumerate(mesh)))
    shown = read_appearance(tmp_path / "skin.obj", Skin(skin, skin, np.array([[0, 1, 2]]), np.ones(len(skin))))
    assert shown.colors[:3].tolist() == [[0, 0, 0], [0, 255, 0], [0, 510, 0]]


def test_rows_from_the_end_of_a_texture_are_those_so_far(tmp_path):
    (tmp_path / "face.mtl").write_text("map_Kd photo.png\n")
    (tmp_path / "photo.png").write_bytes(b"\x89PNG a photograph")
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0]])
    lines = [f"v {x} {y} {z}\nvt {x / 10} {y / 10}" for x, y, z in points]
    (tmp_path / "skin.obj").write_text("\n".join(
        ["mtllib face.mtl", *lines[:3], "f -3/-3 -2/-2/1 -1/-1", *lines[3:], "f -3/-3 5/5 -1/-1"]))
    shown = read_appearance(tmp_path / "skin.obj", Skin(points, points, np.array([[0, 1, 2], [3, 4, 5]]), np.ones(6)))
    assert shown.skin.before[shown.skin.corners].tolist() == points.reshape(2, 3, 3).tolist()
    assert np.allclose(shown.uv, shown.skin.before[:, :2] / 10)


def test_a_row_before_the_first_is_refused(tmp_path):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    (tmp_path / "face.mtl").write_text("map_Kd photo.png\n")
    (tmp_path / "photo.png").write_bytes(b"\x89PNG a photograph")
    lines = [f"v {x} {y} {z}\nvt {x} {y}" for x, y, z in points]
    (tmp_path / "skin.obj").write_text("\n".join(["mtllib face.mtl", *lines, "f -4/-3 -2/-2 -1/-1"]))
    with pytest.raises(Unusable, match="skin.obj: .*a vertex that is not there: -4/-3"):
        read_appearance(tmp_path / "skin.obj", Skin(points, points, np.array([[0, 1, 2]]), np.ones(3)))


def test_measures_of_the_profile_do_not_depend_on_the_side():
    places = {"glabella": (0, -80, 60), "subnasale": (0, -84, 0), "pronasale": (0, -98, 8), "upper lip": (0, -88, -10),
              "lower lip": (0, -86, -20), "pogonion": (0, -82, -40)}
    for name in ("facial convexity", "lower lip in front of the E-line", "lower lip in front of subnasale–pogonion"):
        _, _, needed, value = MEASURES[name]
        straight, aside = (value(*(np.add(places[mark], (6 * side * (mark == "pogonion"), 0, 0)) for mark in needed))
                           for side in (0, 1))
        assert aside == pytest.approx(straight, abs=1e-9), name


def test_a_bone_of_several_words_that_moves_is_no_bone_that_stays():
    before = np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]])
    bones = [{"name": name, "before": before, "planned": before + shift}
             for name, shift in (("upper_jaw", (0, -5, 0)), ("lower_jaw", (0, 0, 0)))]
    plan = SimpleNamespace(name="plan", placed=[], bones={}, result=SimpleNamespace(bones=bones, end={"load": 1}))
    assert "Does not move: lower jaw." in plan_table([plan], "the scan")


def test_results_of_one_name_are_told_apart_by_their_folders(tmp_path):
    assert own_names(["a/face", "b/other"]) == ["face", "other"]
    assert own_names(["a/face", str(tmp_path / "b/face")]) == ["a/face", "b/face"]


def test_no_line_ends_within_a_command():
    assert to_html("A < B (repose-solve -discretisation does).") == (
        "A &lt; B (<code>repose-solve -discretisation</code> does).")
    assert "code{white-space:nowrap}" in (PROJECT / "drivers/web/sheet.css").read_text()


# ----- written files


def test_a_target_is_written_whole(tmp_path):
    file = tmp_path / "page.html"
    for text in ("one", "two"):
        Target(file, ".html", [tmp_path / "none.h5", None]).write(text)
        assert file.read_text() == text
    assert os.listdir(tmp_path) == ["page.html"]


def test_a_name_that_the_system_refuses_is_refused_before_the_work(tmp_path):
    with pytest.raises(Unusable, match="File name too long; choose a shorter name"):
        Target(tmp_path / ("x" * 253), "")
    assert os.listdir(tmp_path) == []


def test_targets_that_must_not_be_written_are_refused(tmp_path):
    (tmp_path / "in.html").write_text("input")
    (tmp_path / "folder.html").mkdir()
    os.link(tmp_path / "in.html", tmp_path / "hard.html")
    (tmp_path / "soft.html").symlink_to("in.html")
    os.mkfifo(tmp_path / "pipe.html")
    for name, part in (("in.html", "is an input of this run"), ("hard.html", "is an input of this run"),
                       ("soft.html", "is an input of this run"), ("folder.html", "no regular file"),
                       ("pipe.html", "no regular file"), ("no/page.html", "there is no folder"),
                       ("page.h5", "does not end in .html or .htm")):
        with pytest.raises(Unusable, match=part):
            Target(tmp_path / name, (".html", ".htm"), [tmp_path / "in.html"])
    assert (tmp_path / "in.html").read_text() == "input"


FILLS = """import sys
sys.path.insert(0, sys.argv[1])
from sheet.script import run
from sheet.whole_file import Target
run(lambda: Target(sys.argv[2], "").write(b"x" * 100_000))
"""
SAVES = """import sys
import numpy as np
sys.path[:0] = [sys.argv[1], sys.argv[1] + "/python"]
from repose.samples import Sample, SampleStore
from sheet.script import run
run(lambda: SampleStore(".", "key").save(Sample(np.zeros(2), np.zeros((10_000, 3)), np.zeros((2, 10_000, 3)), True)))
"""


def run_with_small_files(text, *arguments, folder):
    """Runs Python's text where no file may be larger than 4 KiB."""
    return subprocess.run([sys.executable, "-B", "-c", text, PROJECT / "drivers", *arguments], cwd=folder, text=True,
                          capture_output=True,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)))


@pytest.mark.parametrize("name, part", [("full.html", "File too large; free some space"),
                                        ("x" * 253, "File name too long; choose a shorter name")])
def test_what_cannot_be_written_leaves_the_file_as_it_was(tmp_path, name, part):
    (tmp_path / name).write_text("old")
    done = run_with_small_files(FILLS, name, folder=tmp_path)
    assert done.returncode == 1 and part in done.stderr and len(done.stderr.splitlines()) == 1, done
    assert os.listdir(tmp_path) == [name] and (tmp_path / name).read_text() == "old"


@pytest.mark.quick
def test_a_plan_of_the_map_that_cannot_be_kept_is_one_line(tmp_path):
    done = run_with_small_files(SAVES, folder=tmp_path)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done
    assert re.search(r"key/\w+\.npz: File too large; free some space or choose another folder$", done.stderr), done
    assert os.listdir(tmp_path / "key") == []


def places(y=0.0, z=0.0):
    """A landmark before and after it moves."""
    return np.zeros(3), np.array([0, y, z])


@pytest.mark.parametrize("landmark, skin, bones, key", [
    ("upper lip", places(z=1.2), {"upper incisor": places(z=4)}, ("impaction", "upper_lip")),
    ("upper lip", places(y=-4), {"upper incisor": places(y=-5)}, ("Le Fort I", "upper_lip")),
    ("subnasale", places(y=-3), {"nasal spine": places(y=-5)}, ("Le Fort I", "subnasale")),
    ("lower lip", places(y=-3), {"lower incisor": places(y=-5)}, ("advance", "lower_lip")),
    ("lower lip", places(y=4), {"lower incisor": places(y=5)}, ("set-back", "lower_lip")),
    ("pogonion", places(y=-7), {"chin bone": places(y=-8), "lower incisor": places()},
     ("chin", "pogonion_soft")),
    ("pogonion", places(y=5), {"chin bone": places(y=5), "lower incisor": places(y=5)},
     ("set-back", "pogonion_soft"))])
def test_ratios_are_shown_beside_what_is_published_of_their_operation(landmark, skin, bones, key):
    row, = following({landmark: skin}, bones, None)
    assert [round(share / 100, 2) for share in row[-1]] == list(PUBLISHED[key][1:])


def test_a_ratio_of_which_nothing_is_published_has_no_range():
    row, = following({"upper lip": places(z=-1)}, {"upper incisor": places(z=-4)}, None)
    assert row[-1] is None
    opened = {"lower incisor": places(y=-1.5, z=-11.5), "chin bone": places(y=4, z=-12)}
    rows = following({"lower lip": places(), "pogonion": places()}, opened, None)
    assert [row[-1] for row in rows] == [None, None]
