"""The page about a result: it stands alone, and its numbers are those of the result."""

import base64
import html.parser
import importlib.util
import json
import math
import pathlib
import shutil
import sys
import xml.etree.ElementTree

import h5py
import numpy as np
import pytest

from conftest import PROJECT, TIME_LIMIT, finish
from tissue import last, model_of

SCENE = PROJECT / "meshes/paper_jaw_opening.yaml"
MARKS = PROJECT / "meshes/paper.mrk.json"
BENT = np.array([[1.1, 0.05, 0], [0, 0.9, 0.1], [0.02, 0, 1.05]])  # what the test does to a face


class Page(html.parser.HTMLParser):
    """Table rows by their first cell, text by tag, and what the page would load."""

    def __init__(self, file):
        super().__init__()
        self.open, self.rows, self.text, self.links, self.row = [], {}, {}, [], None
        self.feed(file.read_text(encoding="utf-8"))
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        self.links += [named[key] for key in ("src", "href") if key in named]
        if tag not in ("meta", "img", "input"):
            self.open.append(tag)
        if tag == "tr":
            self.row = []
        if tag == "td":
            self.row.append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        if tag == "tr" and self.row:
            self.rows.setdefault(self.row[0], self.row[1:])

    def handle_data(self, data):
        if "td" in self.open:
            self.row[-1] += data
        elif self.open:
            self.text[self.open[-1]] = self.text.get(self.open[-1], "") + data


@pytest.fixture
def report(tmp_path, environment):
    def write(*arguments):
        command = [sys.executable, "-B", "-W", "error", str(PROJECT / "drivers/report.py"),
                   *map(str, arguments)]
        return finish(command, tmp_path, environment, TIME_LIMIT)

    return write


@pytest.fixture
def opened(solved):
    return solved(SCENE.name)


def page_of(report, tmp_path, file, *options):
    result = report(file, "-output", tmp_path / "page.html", *options)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout == f"{tmp_path / 'page.html'}\n"
    return Page(tmp_path / "page.html")


def test_numbers_are_those_of_the_result(report, opened, tmp_path):
    page = page_of(report, tmp_path, opened, "-landmarks", MARKS)
    step, model = last(opened), model_of(opened)
    skin = np.unique(model["skin/points"])
    far = np.linalg.norm(step["point/displacement"][skin], axis=1).max()
    volume = (model["prism/rest_volume"] * (step["prism/volume_ratio"] - 1)).sum()
    assert page.rows["largest movement of the skin, mm"] == [f"{far:.2f}"]
    assert page.rows["change of the tissue's volume, mm³"] == [f"{volume:.2f}"]
    assert page.rows["prisms inside out"] == [str(step["inverted_prisms"])]
    assert page.rows["bulk modulus, N/mm²"] == [f"{step['bulk_modulus']:.4g}"]
    tension = abs(step["spring/tension"]).max()
    assert page.rows["largest tension of a spring, N"] == [f"{tension:.3g}"]
    assert page.rows["springs"] == [str(len(model["spring/points"]))]
    assert page.rows["mandible"][1].startswith("8.00° about (1, 0, 0)")
    assert page.rows["skull"] == ["stays", "none", "0.00"]
    assert f"{step['displacement_error']:.2g} mm" in page.text["p"]
    assert page.rows["1.00"][0] == "yes"
    assert page.rows["ranks"] == ["1"] and page.rows["program"][0].startswith("Repose ")
    assert page.rows["command"][0].endswith(f"{SCENE} -allow_folded -output {opened.with_suffix('')}")


def test_contact_is_told_where_there_is_any(report, opened, tmp_path):
    assert "points of tissue in contact" not in page_of(report, tmp_path, opened).rows
    shutil.copy(opened, tmp_path / "touching.h5")
    with h5py.File(tmp_path / "touching.h5", "r+") as h5:
        step = h5["step"][sorted(h5["step"])[-1]]
        pressure = np.zeros(len(step["point/position"]))
        pressure[:3] = 0.5, 0.25, np.nan
        step["point/contact_pressure"] = pressure
        step.attrs["penetration"] = 0.0213
    page = page_of(report, tmp_path, tmp_path / "touching.h5")
    assert page.rows["points of tissue in contact"] == ["2"]
    assert page.rows["largest contact pressure, N/mm²"] == ["0.5"]
    assert page.rows["deepest that anything passes what it touches, mm"] == ["0.021"]


def test_lips_that_part_are_measured(report, opened, tmp_path):
    row = "lips and cuts open by at most, mm"
    assert row not in page_of(report, tmp_path, opened).rows
    shutil.copy(opened, tmp_path / "parted.h5")
    with h5py.File(tmp_path / "parted.h5", "r+") as h5:
        one, other = np.unique(h5["model/skin/points"][:])[[3, 40]]
        h5["model/point/position"][other] = h5["model/point/position"][one]
        after = h5["step"][sorted(h5["step"])[-1]]["point/position"]
        apart = np.linalg.norm(after[one] - after[other])
        h5["step"][sorted(h5["step"])[-1]].attrs["smallest_eigenvalue"] = 0.0125
    page = page_of(report, tmp_path, tmp_path / "parted.h5")
    assert page.rows[row] == [f"{apart:.2f}"]
    assert "Stable: smallest eigenvalue 0.0125 N/mm." in page.text["p"]


def test_the_page_stands_alone(report, opened, tmp_path):
    page = page_of(report, tmp_path, opened)
    assert all(link.startswith("data:image/png;base64,") for link in page.links)
    for word in ("http:", "https:", "import(", "fetch("):
        assert word not in page.text["script"]
    has_pictures = importlib.util.find_spec("matplotlib") is not None
    assert len(page.links) == has_pictures
    for link in page.links:
        assert base64.b64decode(link.split(",")[1]).startswith(b"\x89PNG")
    viewer = (PROJECT / "drivers/report_viewer.js").read_text()
    assert page.text["script"].endswith(viewer) and viewer.count("\n") < 150


def test_the_view_holds_the_head(report, opened, tmp_path):
    stored = json.JSONDecoder().raw_decode(page_of(report, tmp_path, opened).text["script"])[0]
    step, model = last(opened), model_of(opened)
    skin, corners = np.unique(model["skin/points"], return_inverse=True)

    def numbers(text, kind):
        return np.frombuffer(base64.b64decode(text), kind)

    def places(mesh, name):
        return mesh["low"] + mesh["step"] * numbers(mesh[name], "<u2").reshape(-1, 3)

    for name, points in (("before", model["point/position"]), ("after", step["point/position"])):
        assert np.abs(places(stored["skin"], name) - points[skin]).max() < 0.005
    assert np.array_equal(numbers(stored["skin"]["triangles"], "<u4"), corners.ravel())
    moved = np.concatenate([places(bone, "after") for bone in stored["bones"]])
    assert np.abs(moved - step["bone_surface/points"]).max() < 0.005


def sphere(radius, middle, count):
    """A sphere of 2 count² triangles, as a CT's bone is: as fine as its voxels."""
    u, v = np.meshgrid(np.linspace(0, np.pi, count + 1), np.linspace(0, 2 * np.pi, count + 1),
                       indexing="ij")
    points = radius * np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], -1)
    row = np.arange(count * (count + 1)).reshape(count, -1)[:, :-1]
    below = row + count + 1
    faces = [np.stack(corners, -1).reshape(-1, 3) for corners in
             ((row, below, below + 1), (row, below + 1, row + 1))]
    return points.reshape(-1, 3) + middle, np.concatenate(faces)


def test_a_fine_bone_is_drawn_coarser_and_the_page_stays_small(report, opened, tmp_path):
    shutil.copy(opened, tmp_path / "fine.h5")
    points, faces = sphere(60, (0, 20, 10), 400)
    with h5py.File(tmp_path / "fine.h5", "r+") as h5:
        step = h5["step"][sorted(h5["step"])[-1]]
        moved = step["bone_surface/points"][:]
        other = len(h5["model/bone_surface/0/points"])
        for name, values in (("points", points), ("triangles", faces)):
            del h5[f"model/bone_surface/0/{name}"]
            h5[f"model/bone_surface/0/{name}"] = values
        del step["bone_surface/points"]
        step["bone_surface/points"] = np.concatenate([points, moved[other:]])
    page = page_of(report, tmp_path, tmp_path / "fine.h5")
    assert (tmp_path / "page.html").stat().st_size < 5e6
    bone = json.JSONDecoder().raw_decode(page.text["script"])[0]["bones"][0]
    corners = np.frombuffer(base64.b64decode(bone["triangles"]), "<u4").reshape(-1, 3)
    whole = np.frombuffer(base64.b64decode(bone["before"]), "<u2").reshape(-1, 3)
    places = bone["low"] + bone["step"] * whole
    assert 20_000 < len(corners) <= 80_000 and corners.max() < len(places)
    assert np.abs(np.linalg.norm(places - (0, 20, 10), axis=1) - 60).max() < 0.1


def test_landmarks_beyond_the_solved_skin_are_kept(report, run, tmp_path):
    """On the given skin: those that it solves move, those far from it stay."""
    text = (PROJECT / "meshes/head_jaw_opening.yaml").read_text()
    text = text.replace(": head_", f": {PROJECT}/meshes/head_")
    (tmp_path / "part.yaml").write_text(text.replace("  layers: 4", "  layers: 3\n  edge: 8", 1))
    assert run("repose-solve", "part.yaml", "-accuracy", 1).returncode == 0
    with h5py.File(tmp_path / "part.h5") as h5:
        solved = h5["model/point/position"][:][np.unique(h5["model/skin/points"][:])]
    given = xml.etree.ElementTree.parse(tmp_path / "part_given_skin.vtp").iter("DataArray")
    skin = next(np.frombuffer(base64.b64decode(item.text)[8:]).reshape(-1, 3) for item in given
                if item.get("Name") == "Points")
    off = np.array([np.linalg.norm(solved - point, axis=1).min() for point in skin])
    beyond = skin[np.argmax(off)]
    marks = {"far": list(beyond), "near": list(skin[np.argmin(off)]), "in the air": [0, -400, 0]}
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    page = page_of(report, tmp_path, tmp_path / "part.h5", "-landmarks", tmp_path / "marks.json")
    assert off.max() > 20
    assert page.rows["far"] == ["skin beyond the solved part", "0.00", "0.00", "0.00", "0.00"]
    assert page.rows["near"][0] == "skin" and "in the air" in page.text["p"]


def bent(file, copy):
    """A copy of a result whose face is bent by a known map, and landmarks at vertices of it."""
    shutil.copy(file, copy)
    model = model_of(file)
    skin = np.unique(model["skin/points"])
    marks = {}
    for name, place in json.loads((PROJECT / "meshes/paper_landmarks.json").read_text()).items():
        if name in ("glabella_soft", "pronasale", "subnasale", "upper_lip", "lower_lip",
                    "pogonion_soft", "menton_soft"):
            points = model["point/position"][skin]
            marks[name] = list(points[np.argmin(((points - place)**2).sum(1))])
    with h5py.File(copy, "r+") as h5:
        step = h5["step"][sorted(h5["step"])[-1]]
        step["point/position"][...] = model["point/position"] @ BENT.T
        step["point/displacement"][...] = model["point/position"] @ BENT.T - model["point/position"]
    return marks


def corner(one, middle, other):
    a, b = one - middle, other - middle
    return math.degrees(math.acos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)))


def test_landmarks_and_angles_are_right(report, opened, tmp_path):
    marks = bent(opened, tmp_path / "bent.h5")
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    page = page_of(report, tmp_path, tmp_path / "bent.h5", "-landmarks", tmp_path / "marks.json")
    here = {name: np.array(place) for name, place in marks.items()}
    sides = [here, {name: BENT @ place for name, place in here.items()}]
    for name in marks:
        x, y, z = sides[1][name] - here[name]
        wanted = ["skin", *(f"{v:.2f}" for v in (-y, x, z, math.hypot(x, y, z)))]
        assert page.rows[name.replace("_", " ")] == wanted
    convexity = [corner(p["glabella_soft"], p["subnasale"], p["pogonion_soft"]) for p in sides]
    assert page.rows["facial convexity (glabella–subnasale–pogonion)"] == [
        "°", *(f"{v:.2f}" for v in (*convexity, convexity[1] - convexity[0]))]
    lips = [np.linalg.norm(p["upper_lip"] - p["lower_lip"]) for p in sides]
    assert page.rows["upper lip to lower lip"][1:3] == [f"{v:.2f}" for v in lips]
    for lip in ("upper", "lower"):
        off = []
        for p in sides:
            line = p["pogonion_soft"] - p["pronasale"]
            away = np.cross(p[f"{lip}_lip"] - p["pronasale"], line / np.linalg.norm(line))
            off.append(-np.linalg.norm(away))  # both lips are behind the line
        assert page.rows[f"{lip} lip in front of the E-line"][1:3] == [f"{v:.2f}" for v in off]
    assert "nasolabial angle (pronasale–subnasale–upper lip)" in page.rows
    assert "mentolabial angle (lower lip–sublabiale–pogonion)" in page.rows


def test_bones_landmarks_go_with_the_bone(report, opened, tmp_path):
    page = page_of(report, tmp_path, opened, "-landmarks", MARKS)
    marks = json.loads((PROJECT / "meshes/paper_landmarks.json").read_text())
    at, turn = np.array(marks["pogonion_bone"]), np.radians(8)
    to = np.array([at[0], math.cos(turn) * at[1] - math.sin(turn) * at[2],
                   math.sin(turn) * at[1] + math.cos(turn) * at[2]])
    assert page.rows["pogonion bone"] == ["mandible", f"{at[1] - to[1]:.2f}", "0.00",
                                          f"{to[2] - at[2]:.2f}", f"{np.linalg.norm(to - at):.2f}"]
    assert page.rows["nasion bone"][0] == "skull"
    assert "condyle right center" in page.text["p"]


def test_the_scene_is_shown_and_names_the_landmarks(report, opened, tmp_path):
    scene = SCENE.read_text() + f"landmarks: {MARKS}\n# <b>\n"
    (tmp_path / "plan.yaml").write_text(scene)
    page = page_of(report, tmp_path, opened, "-scene", tmp_path / "plan.yaml")
    assert page.text["pre"] == scene and "pogonion bone" in page.rows


def test_a_bad_end_is_warned_of(report, run, tmp_path):
    assert run("repose-solve", SCENE, "-time_limit", 0, "-output", "cut").returncode == 2
    page = page_of(report, tmp_path, tmp_path / "cut.h5")
    assert "NOT CONVERGED" in page.text["p"] and "did not reach its accuracy" in page.text["p"]


def test_mistakes_are_one_line(report, opened, tmp_path):
    (tmp_path / "bad.json").write_text("{")
    (tmp_path / "none.h5").write_bytes(b"")
    for arguments, part in ((["missing"], "missing.h5: no such file"),
                            ([opened, "-landmarks", "bad.json"], "bad.json: not landmarks"),
                            ([opened, "-output", "no/page.html"], "make its folder first"),
                            ([opened, "-outptu", "x"], "-outptu"),
                            (["none.h5"], "none.h5: cannot be read")):
        result = report(*arguments)
        assert result.returncode == 1 and len(result.stderr.splitlines()) == 1, result.stderr
        assert result.stderr.startswith("report.py: ") and part in result.stderr
    assert not [f for f in pathlib.Path(tmp_path).iterdir() if f.suffix in (".html", ".part")]
