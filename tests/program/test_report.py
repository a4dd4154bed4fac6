"""The planning sheet of a result: it stands alone, its numbers are those of the result, and its view
works in a browser."""

import base64
import html.parser
import json
import math
import pathlib
import re
import shutil
import sys
import xml.etree.ElementTree
import zlib

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from browser import browse, evaluate, needs_browser
from conftest import PROJECT, TIME_LIMIT, finish, shipped
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
        if tag not in ("meta", "link", "img", "input"):
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


@pytest.mark.quick
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
    place = json.loads((PROJECT / "meshes/paper_landmarks.json").read_text())["lower_incisor_edge"]
    shift = to_head(opened_jaw(place) - place)
    assert page.rows["mandible"] == ["at the lower incisor's edge", *(
        f"{value:.1f}".replace("-", "−") for value in (-shift[1], shift[2])), "0.0", "8.0", "0.0", "0.0"]
    assert "Does not move: skull." in page.text["p"]
    assert f"within {step['displacement_error']:.2g} mm of the answer" in page.text["b"]
    assert page.rows["1.00"][0] == "yes"
    assert page.rows["ranks"] == ["1"] and page.rows["program"][0].startswith("Repose ")
    assert page.rows["command"][0].endswith(f"{SCENE} -allow_folded -output {opened.with_suffix('')}")


def test_a_name_of_a_bone_ends_no_script(report, opened, tmp_path):
    shutil.copy(opened, tmp_path / "named.h5")
    with h5py.File(tmp_path / "named.h5", "r+") as h5:
        bones = [b"</script><b>jaw" if name == b"mandible" else name for name in h5["model/bone"][:]]
        del h5["model/bone"]
        h5["model/bone"] = np.array(bones)
    page = page_of(report, tmp_path, tmp_path / "named.h5")
    assert "</script><b>jaw" in page.rows
    assert "</script><b>jaw" in [one["name"] for one in View(tmp_path / "page.html").told["surfaces"]]


def to_head(vectors):
    """Vectors along left, back and up of the head by its landmarks."""
    sys.path.insert(0, str(PROJECT / "drivers"))
    from sheet.landmarks import head_axes, read_landmarks
    return (head_axes(read_landmarks(MARKS))[0] @ np.transpose(vectors)).T


def opened_jaw(place):
    """Moves a place of the jaw as the scene does: 8° about the x axis."""
    turn = np.radians(8)
    return np.array([place[0], math.cos(turn) * place[1] - math.sin(turn) * place[2],
                     math.sin(turn) * place[1] + math.cos(turn) * place[2]])


def test_a_head_that_is_turned_in_the_scan_has_the_same_page(report, opened, tmp_path):
    turn, rows = Rotation.from_rotvec([8, 16, -16], degrees=True).as_matrix(), []
    shutil.copy(opened, tmp_path / "turned.h5")
    with h5py.File(tmp_path / "turned.h5", "r+") as h5:
        def turn_points(name, stored):
            if name.rsplit("/", 1)[-1] in ("position", "displacement") or \
                    name.endswith("points") and stored.dtype.kind == "f":
                stored[...] = stored[:] @ turn.T
        h5.visititems(turn_points)
    marks = json.loads(MARKS.read_text())
    for point in marks["markups"][0]["controlPoints"]:
        point["position"] = (turn @ point["position"]).tolist()
    (tmp_path / "turned.json").write_text(json.dumps(marks))
    for file, places in ((opened, MARKS), (tmp_path / "turned.h5", tmp_path / "turned.json")):
        page = page_of(report, tmp_path, file, "-landmarks", places)
        assert "along the axes of the head by its condyles, nasion and upper incisors" in page.text["p"]
        rows.append(page.rows)
    assert rows[0]["mandible"] == rows[1]["mandible"]
    marks = [name for name in rows[0] if name in ("pogonion soft", "lower lip", "upper lip", "pogonion bone")]
    assert len(marks) == 4
    for name in marks:
        assert rows[0][name][0] == rows[1][name][0]
        assert np.allclose(*([float(cell.replace("−", "-")) for cell in row[name][1:]] for row in rows), atol=0.11)


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


def test_the_page_warns_of_what_the_summary_warns_of(report, run, tmp_path):
    done = run("repose-solve", PROJECT / "meshes/head_split.yaml", "-output", "split")
    assert done.returncode == 0
    with h5py.File(tmp_path / "split.h5") as h5:
        rows = [row.decode() for row in h5["summary"][:]]
    assert done.stdout.endswith("\n".join(rows) + "\n")
    (overlap,) = re.search(r"warning +(bones '\w+' and '\w+' end \S+ mm inside one another)", done.stdout).groups()
    (apart,) = re.search(r"other rest position +(the skin is up to \S+ mm away there)", done.stdout).groups()
    page = page_of(report, tmp_path, tmp_path / "split.h5").text["p"]
    assert overlap[1:] in page and re.search(f"Other rest position: {apart}, most (at|under) the ", page)
    for words in ("not stable", "Pierced by bone", "Exact penetration", "Self-contact"):
        assert words not in page
    told = {"pierced by bone": "4 columns, up to 1.9 mm deep, the deepest by skull at (0.1, -80.0, 20.5) mm; move less",
            "self-contact": "SKIN PASSES THROUGH SKIN: 3 of its triangles, one at (1.0, 2.0, 3.0) mm; distrust",
            "exact penetration": "0.08 mm at most, into the bodies' own triangles",
            "path": "verified: in 2 load steps in place of 1 the same rest position"}
    with h5py.File(tmp_path / "split.h5", "r+") as h5:
        rows += [f"  {name:<22} {words}" for name, words in told.items()]
        del h5["summary"]
        h5["summary"] = rows
        h5["step"][sorted(h5["step"])[-1]].attrs["smallest_eigenvalue"] = -0.01
    page = page_of(report, tmp_path, tmp_path / "split.h5").text["p"]
    assert "The rest position is not stable" in page and "Self-contact: SKIN PASSES THROUGH SKIN" in page
    assert re.search(r"Pierced by bone: 4 columns, up to 1.9 mm deep, the deepest by skull .*[a-z]; move less\.", page)
    assert "own triangles" not in page and "same rest position" not in page


def test_the_page_and_the_summary_name_the_same_points_by_landmarks(report, run, tmp_path):
    scene = PROJECT / "meshes/head_solid.yaml"
    done = run("repose-solve", scene, "-output", "solid")
    down, back = re.search(r"^Chin (\S+) mm down, (\S+) back;", done.stdout, re.M).groups()
    page_of(report, tmp_path, tmp_path / "solid.h5", "-scene", scene)
    text = (tmp_path / "page.html").read_text()
    assert f"<h3>Chin</h3><b>{down}<small> mm down</small></b><p>{back} mm back</p>" in text
    assert "by the teeth: its numbers differ" not in text
    stated = re.search(r"of this head.* ([\d.]+) mm down and ([\d.]+) back", (PROJECT / "docs/guide/report.md").read_text())
    assert stated.groups() == (down, back)
    assert "by the teeth: its numbers differ" in page_of(report, tmp_path, tmp_path / "solid.h5").text["p"]


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


@pytest.mark.quick
def test_the_page_stands_alone(report, opened, tmp_path):
    page = page_of(report, tmp_path, opened)
    assert page.links == ["data:,"], "an icon that is none"
    for word in ("import(", "fetch("):
        assert word not in "".join((PROJECT / "drivers/web" / name).read_text()
                                   for name in ("viewer.js", "sheet.js"))
    text = (tmp_path / "page.html").read_text()
    for name in ("three.js", "viewer.js", "sheet.js", "viewer.css", "sheet.css"):
        assert (PROJECT / "drivers/web" / name).read_text() in text
    assert "Permission is hereby granted" in text, "the license of three.js"


class View:
    """Drawn data of a page, as sheet.js unpacks it."""

    def __init__(self, file):
        text = file.read_text(encoding="utf-8")
        self.told = json.loads(re.search(r'id="described">(.*?)</script>', text, re.S)[1])
        packed = re.search(r'id="packed">(.*?)</script>', text, re.S)[1]
        self.bytes = np.frombuffer(zlib.decompress(base64.b64decode(packed)), "u1")

    def array(self, stored):
        rows, columns, size = stored["rows"], stored["columns"], stored["bits"] // 8
        part = self.bytes[stored["at"]:stored["at"] + rows * columns * size].reshape(size, -1)
        steps = sum(part[b].astype(np.int64) << 8 * b for b in range(size)).reshape(columns, rows)
        whole = steps.cumsum(axis=1).T % (1 << stored["bits"])
        return stored.get("low", 0) + stored.get("step", 1) * whole

    def surface(self, name):
        (one,) = (s for s in self.told["surfaces"] if s["name"] == name)
        states = [self.array(state) for state in one["states"]]
        return self.array(one["triangles"]), states[0], *(states[0] + s for s in states[1:])


def test_the_view_holds_the_head(report, opened, tmp_path):
    page_of(report, tmp_path, opened)
    view, step, model = View(tmp_path / "page.html"), last(opened), model_of(opened)
    skin, corners = np.unique(model["skin/points"], return_inverse=True)
    triangles, before, after = view.surface("skin")
    assert np.abs(before - model["point/position"][skin]).max() < 0.005
    assert np.abs(after - step["point/position"][skin]).max() < 0.01
    assert np.array_equal(triangles.ravel(), corners.ravel())
    moved = np.concatenate([view.surface(name)[2] for name in ("skull", "mandible")])
    assert np.abs(moved - step["bone_surface/points"]).max() < 0.01


def test_the_view_works_in_a_browser(report, opened, tmp_path):
    """Faces are drawn, the two sides of the split differ, the pointer reads movements, two clicks
    measure, and nothing is loaded."""
    needs_browser()
    page_of(report, tmp_path, opened, "-landmarks", MARKS)
    found = evaluate(tmp_path / "page.html", """
      const {viewer} = sheet, gl = viewer.three.renderer.getContext(), box =
        viewer.element.getBoundingClientRect();
      const columns = states => {
        viewer.show({mode: "split", states, split: 0.5});
        const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
        gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA,
                      gl.UNSIGNED_BYTE, pixels);
        return pixels;
      };
      viewer.look("front");
      const same = columns([0, 0]), split = columns([0, 1]), wide = gl.drawingBufferWidth;
      const changed = [0, 0];
      let drawn = 0;
      for (let i = 0; i < same.length; i += 4) {
        drawn += same[i + 3] > 0;
        changed[(i / 4) % wide < wide / 2 ? 0 : 1] += same[i] !== split[i];
      }
      const chin = viewer.surfaces[0].positions[0].length;
      const at = (x, y) => ({clientX: box.left + x * box.width, clientY: box.top + y * box.height});
      viewer.show({mode: "single", states: [1]});
      const hit = viewer.pick(at(0.6, 0.75));
      const after = viewer.surfaces[0].positions[1], before = viewer.surfaces[0].positions[0];
      const moved = hit.at(after, 3).map((v, k) => v - hit.at(before, 3)[k]);
      document.getElementById("measure").click();
      sheet.measure(viewer.pick(at(0.45, 0.5)));
      sheet.measure(viewer.pick(at(0.55, 0.5)));
      const ends = sheet.measured.map(one => one.point);
      const distance = document.getElementById("distance").textContent;
      sheet.color("movement");
      const canvas = viewer.three.renderer.domElement, finger = {
        bubbles: true, pointerId: 1, pointerType: "touch", ...at(0.6, 0.75)};
      canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
      for (const type of ["pointerdown", "pointerup", "pointerleave"])
        canvas.dispatchEvent(new PointerEvent(type, finger));
      const tip = document.getElementById("tip");
      return {tapped: tip.hidden ? "hidden" : tip.textContent,
        drawn: drawn / (same.length / 4), changed, sentence: sheet.sentence(hit), moved,
        point: hit.point, on: hit.surface.name, inside: hit.at(after, 3),
        distance, apart: Math.hypot(...ends[0].map((v, k) => v - ends[1][k])),
        bar: document.getElementById("bar").textContent,
        loaded: performance.getEntriesByType("resource").map(one => one.name)
          .filter(name => !name.startsWith("data:") && !name.startsWith("blob:"))};
    """)
    assert "error" not in found, found
    assert re.search(r"moves \d", found["tapped"]), found["tapped"]
    assert found["loaded"] == [] and found["drawn"] > 0.15
    assert found["changed"][0] == 0 < found["changed"][1]
    far = math.hypot(*found["moved"])
    assert far > 1 and f"moves {far:.1f} mm" in found["sentence"] and "down" in found["sentence"]
    assert np.allclose(found["point"], found["inside"], atol=1e-3)
    assert f"after {found['apart']:.1f} mm" in found["distance"]
    assert found["bar"].startswith("movement, mm0")


@pytest.mark.long
def test_it_prints_on_two_pages(report, opened, tmp_path):
    needs_browser()
    page_of(report, tmp_path, opened, "-landmarks", MARKS)
    browse(tmp_path / "page.html", "--virtual-time-budget=20000",
           f"--print-to-pdf={tmp_path / 'page.pdf'}")
    pages = re.findall(rb"/Type\s*/Page\b(?!s)", (tmp_path / "page.pdf").read_bytes())
    assert len(pages) == 2


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
    page_of(report, tmp_path, tmp_path / "fine.h5")
    assert (tmp_path / "page.html").stat().st_size < 5e6
    corners, places, _ = View(tmp_path / "page.html").surface("skull")
    assert 20_000 < len(corners) <= 80_000 and corners.max() < len(places)
    assert np.abs(np.linalg.norm(places - (0, 20, 10), axis=1) - 60).max() < 0.1
    a, b, c = (places[corners.astype(int)[:, k]] - (0, 20, 10) for k in range(3))
    outward = (np.cross(b - a, c - a) * (a + b + c)).sum(1)
    assert (outward * np.sign(np.median(outward)) > -1e-3).all(), "no triangle is turned round"


def test_landmarks_beyond_the_solved_skin_are_kept(report, run, tmp_path):
    """On the given skin: those that it solves move, those far from it stay."""
    (tmp_path / "part.yaml").write_text(shipped("head_jaw_opening.yaml", layers=3, edge=8))
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


def tenths(*values):
    return [f"{value:.1f}".replace("-", "−") for value in values]


def corner(one, middle, other):
    a, b = one - middle, other - middle
    return math.degrees(math.acos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)))


@pytest.mark.quick
def test_landmarks_and_angles_are_right(report, opened, tmp_path):
    marks = bent(opened, tmp_path / "bent.h5")
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    page = page_of(report, tmp_path, tmp_path / "bent.h5", "-landmarks", tmp_path / "marks.json")
    here = {name: np.array(place) for name, place in marks.items()}
    sides = [here, {name: BENT @ place for name, place in here.items()}]
    for name in marks:
        x, y, z = sides[1][name] - here[name]
        expected = ["skin", *(f"{v:.2f}" for v in (-y, x, z, math.hypot(x, y, z)))]
        assert page.rows[name.replace("_", " ")] == expected
    profiles = [{name: place * (0, 1, 1) for name, place in p.items()} for p in sides]
    convexity = [180 - corner(p["glabella_soft"], p["subnasale"], p["pogonion_soft"]) for p in profiles]
    assert page.rows["facial convexity"] == [
        "180° − angle glabella–subnasale–pogonion", "°",
        *tenths(*convexity, convexity[1] - convexity[0]), "13.6 ± 4.2 [1]; 14.7 ± 5.1 [2]"]
    lips = [np.linalg.norm(p["upper_lip"] - p["lower_lip"]) for p in sides]
    assert page.rows["upper lip to lower lip"][2:4] == tenths(*lips)
    for lip in ("upper", "lower"):
        off = []
        for p in profiles:
            line = p["pogonion_soft"] - p["pronasale"]
            away = np.cross(p[f"{lip}_lip"] - p["pronasale"], line / np.linalg.norm(line))
            off.append(-np.linalg.norm(away))  # both lips are behind the line
        assert page.rows[f"{lip} lip in front of the E-line"][2:4] == tenths(*off)
    assert page.rows["nasolabial angle by the tip"][0] == "pronasale–subnasale–upper lip"
    assert page.rows["mentolabial angle"][0] == "lower lip–sublabiale–pogonion"


def test_bones_landmarks_go_with_the_bone(report, opened, tmp_path):
    marks = json.loads((PROJECT / "meshes/paper_landmarks.json").read_text())
    (tmp_path / "marks.json").write_text(json.dumps(marks | {"stray": [0, -200, 0]}))
    page = page_of(report, tmp_path, opened, "-landmarks", tmp_path / "marks.json")
    at = np.array(marks["pogonion_bone"])
    way = to_head(opened_jaw(at) - at)
    assert page.rows["pogonion bone"] == ["mandible", f"{-way[1]:.2f}", "0.00", f"{way[2]:.2f}",
                                          f"{np.linalg.norm(way):.2f}"]
    assert page.rows["nasion bone"][0] == "skull"
    assert page.rows["condyle right center"][0] == "mandible"
    assert "stray" in page.text["p"]


@pytest.mark.parametrize("change, part", [
    (lambda name, at: at * (-1, -1, 1), "x = 50.0 mm and condyle_left_center at x = -50.0 mm, but +x is the patient's"),
    (lambda name, at: at * (1, -1, 1), "13 of 15 landmarks on skin and bones lie farther than 5 mm from them, pronasale"),
    (lambda name, at: at * 1000, "15 of 15 landmarks on skin and bones"),
    (lambda name, at: at - (0, 99 * (name == "nasion_bone"), 0), "nasion_bone lies 82 mm from skin and bones, allowed")],
    ids=["RAS", "back to front", "µm", "nasion"])
def test_landmarks_off_the_head_are_refused(report, opened, tmp_path, change, part):
    marks = json.loads(MARKS.read_text())
    for point in marks["markups"][0]["controlPoints"]:
        point["position"] = change(point["label"], np.array(point["position"])).tolist()
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    refused = report(opened, "-landmarks", "marks.json")
    assert (refused.returncode, refused.stdout, len(refused.stderr.splitlines())) == (1, "", 1), refused.stderr
    assert refused.stderr.startswith("report.py: marks.json: ") and part in refused.stderr


def test_landmarks_that_are_all_left_out_are_named(report, opened, tmp_path):
    (tmp_path / "marks.json").write_text('{"in the air": [0, -400, 0]}')
    page = page_of(report, tmp_path, opened, "-landmarks", tmp_path / "marks.json")
    assert "Farther than 5 mm from skin and bones: in the air." in page.text["p"]
    assert "None are given." not in page.text["p"]


def test_landmarks_in_other_spellings_make_the_same_page(report, opened, tmp_path):
    marks = json.loads(MARKS.read_text())
    for point in marks["markups"][0]["controlPoints"]:
        point["label"] = {"lower_incisor_edge": "L1", "pogonion_soft": "Pog\u2032"}.get(
            point["label"], point["label"].replace("_", " ").title())
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    standard, spelled = (page_of(report, tmp_path, opened, "-landmarks", file)
                         for file in (MARKS, tmp_path / "marks.json"))
    assert "axes of the head by its condyles, nasion and upper incisors" in spelled.text["p"]
    shared = ("mandible", "Chin", "pogonion soft", "lower incisor edge", "facial convexity")
    assert [spelled.rows[row] for row in shared] == [standard.rows[row] for row in shared]


def test_the_scene_is_shown_and_names_the_landmarks(report, opened, tmp_path):
    scene = SCENE.read_text() + f"landmarks: {MARKS}\n# <b>\n"
    (tmp_path / "plan.yaml").write_text(scene)
    page = page_of(report, tmp_path, opened, "-scene", tmp_path / "plan.yaml")
    assert page.text["pre"] == scene and "pogonion bone" in page.rows


def test_the_scene_of_another_plan_is_refused(report, opened, tmp_path):
    other = PROJECT / "meshes/head_genioplasty.yaml"
    refused = report(opened, "-scene", other)
    assert refused.returncode == 1 and len(refused.stderr.splitlines()) == 1, refused
    assert (f"{other}: another plan's scene: its bones and pieces are chin, mandible, skull; those of {opened}: "
            "mandible, skull; give the scene that was solved") in refused.stderr
    shutil.copy(opened, tmp_path / "chin.h5")
    with h5py.File(tmp_path / "chin.h5", "r+") as h5:
        del h5["model/bone"]
        h5["model/bone"] = ["skull", "mandible", "chin"]
    page = page_of(report, tmp_path, opened, tmp_path / "chin.h5", "-scene", other)
    assert page.text["pre"] == other.read_text(), "in the fold of its own result alone"


def test_a_bad_end_is_warned_of(report, run, tmp_path):
    assert run("repose-solve", SCENE, "-time_limit", 0, "-output", "cut").returncode == 2
    page = page_of(report, tmp_path, tmp_path / "cut.h5")
    assert "NOT FINISHED" in page.text["b"] and "did not reach its accuracy" in page.text["p"]


def test_a_rest_position_on_the_way_is_no_answer_of_the_model(report, opened, tmp_path):
    shutil.copy(opened, tmp_path / "part.h5")
    with h5py.File(tmp_path / "part.h5", "r+") as h5:
        h5["step"][sorted(h5["step"])[-1]].attrs["load"] = 0.004
    page = page_of(report, tmp_path, tmp_path / "part.h5")
    assert re.search(r"NOT FINISHED: the face shown is at 0.4 % of the planned motion, within \S+ mm of rest there",
                     page.text["b"])
    assert "answer of the model" not in page.text["b"] and "its accuracy" not in page.text["p"]


def test_an_unfinished_face_is_shown_with_the_whole_plan(report, opened, tmp_path):
    shutil.copy(opened, tmp_path / "part.h5")
    with h5py.File(tmp_path / "part.h5", "r+") as h5:
        step = h5["step"][sorted(h5["step"])[-1]]
        step.attrs["load"] = 0.0
        step["bone_surface/points"][...] = h5["model/bone_surfaces/points"]
    page = page_of(report, tmp_path, tmp_path / "part.h5", "-landmarks", MARKS)
    whole = page_of(report, tmp_path, opened, "-landmarks", MARKS)
    assert page.rows["mandible"] == whole.rows["mandible"]
    assert "The face of part and its numbers are at 0 % of its plan." in page.text["p"]
    assert "at 0 %" not in whole.text["p"] and "No bone moves" not in page.text["p"]


def test_mistakes_are_one_line(report, opened, tmp_path):
    (tmp_path / "bad.json").write_text("{")
    (tmp_path / "none.h5").write_bytes(b"")
    (tmp_path / "head.yaml").write_text("skin: face.ply\n")
    for arguments, part in ((["missing"], "missing.h5: no such file; give what repose-solve writes"),
                            (["missing.H5"], "missing.h5: no such file; give what repose-solve writes"),
                            (["head.yaml"], "head.yaml: is a scene; solve it, and give its result"),
                            ([opened, "-landmarks", "bad.json"], "bad.json: damaged, or not landmarks"),
                            ([opened, "-output", "no/page.html"], "no/page.html: cannot be written: there is no folder no; make it first"),
                            ([opened, "-outptu", "x"], "-outptu"),
                            (["none.h5"], "none.h5: cannot be read")):
        result = report(*arguments)
        assert result.returncode == 1 and len(result.stderr.splitlines()) == 1, result.stderr
        assert result.stderr.startswith("report.py: ") and part in result.stderr
    assert not [f for f in pathlib.Path(tmp_path).iterdir() if f.suffix in (".html", ".part")]


@pytest.fixture
def other_plan(opened, tmp_path):
    """The face moved half as far, as by a second plan."""
    shutil.copy(opened, tmp_path / "half.h5")
    with h5py.File(tmp_path / "half.h5", "r+") as h5:
        step = h5["step"][sorted(h5["step"])[-1]]
        before = h5["model/point/position"][:]
        step["point/position"][...] = before + 0.5 * (step["point/position"][:] - before)
        bones = h5["model/bone_surfaces/points"][:]
        step["bone_surface/points"][...] = bones + 0.5 * (step["bone_surface/points"][:] - bones)
    return tmp_path / "half.h5"


def test_each_plan_has_its_own_uncertainty(report, opened, other_plan, tmp_path):
    def state_of(*plans):
        page_of(report, tmp_path, *plans, "-landmarks", MARKS)
        field, = [field for field in View(tmp_path / "page.html").told["fields"] if field["name"] == "uncertainty"]
        return [state is not None for state in field["states"]]

    shutil.copy(opened, tmp_path / "sure.h5")
    with h5py.File(tmp_path / "sure.h5", "r+") as h5:
        step = h5["step"][sorted(h5["step"])[-1]]
        step["point/discretisation_error"] = np.full(len(step["point/position"]), 0.4)
    assert state_of(tmp_path / "sure.h5", other_plan) == [True, True, False]
    assert state_of(other_plan, tmp_path / "sure.h5") == [False, False, True]


@pytest.mark.quick
def test_two_plans_are_compared(report, opened, other_plan, tmp_path):
    page = page_of(report, tmp_path, opened, other_plan, "-landmarks", MARKS)
    view, step, model = View(tmp_path / "page.html"), last(opened), model_of(opened)
    skin = np.unique(model["skin/points"])
    _, before, after, half = view.surface("skin")
    assert np.abs(after - to_head(step["point/position"][skin])).max() < 0.01
    assert np.abs(half - before - 0.5 * (after - before)).max() < 0.01
    assert view.told["states"] == ["before", "0", "half"]
    mean, mean_of_half, *apart = (float(cell) for cell in page.rows["Chin"])
    assert mean > 2 and mean_of_half == pytest.approx(mean / 2, abs=0.06)
    assert apart[0] == pytest.approx(mean / 2, abs=0.06) and apart[0] <= apart[1] <= apart[2]
    assert len(page.rows["lower face"]) == 6


def test_the_slider_and_the_pointer_name_the_states_of_the_pair(report, opened, other_plan, tmp_path):
    needs_browser()
    page_of(report, tmp_path, opened, other_plan, "-landmarks", MARKS)
    found = evaluate(tmp_path / "page.html", """
      const text = id => document.getElementById(id).textContent, weights = values => [...values.slice(0, 3)];
      const set = (id, value, kind) => {
        const element = document.getElementById(id);
        element.value = value;
        element.dispatchEvent(new Event(kind));
      };
      const found = {};
      sheet.setMode("single");
      for (const pair of ["1 2", "0 1", "0 2"]) {
        set("pair", pair, "change");
        found[pair] = [0, 0.02, 0.5, 0.98, 1].map(share => {
          set("share", share, "input");
          return sheet.sentence({surface: sheet.skin, state: sheet.viewer.shown.states[0], at: weights})
            .split(":")[0];
        });
        found[pair].push(text("share-label").trim().split(/\\s{2,}/));
      }
      const jaw = sheet.viewer.surfaces.find(one => one.name === "mandible" && one.positions[1]);
      set("share", 0.5, "input");
      set("pair", "0 1", "change");
      found.jaw = Boolean(jaw.object(FaceViewer.MIXED));
      set("pair", "0 2", "change");
      found.left = Boolean(jaw.object(FaceViewer.MIXED));
      return found;
    """)
    assert found["1 2"] == ["0", *["half"] * 4, ["0", "half"]]
    assert found["0 1"] == [*["0"] * 5, ["before", "0"]]
    assert found["0 2"] == [*["half"] * 5, ["before", "half"]]
    assert found["jaw"] and not found["left"], "a bone of one plan is not drawn with the other"


def test_a_table_that_is_wider_than_a_phone_shows_that_it_scrolls(report, opened, other_plan, tmp_path):
    needs_browser()
    page_of(report, tmp_path, opened, other_plan, "-landmarks", MARKS)
    found = evaluate(tmp_path / "page.html", """
      document.documentElement.style.width = "390px";
      return [...document.querySelectorAll("section .wide")].map(box => [box.querySelector("th").textContent,
        box.scrollWidth > box.clientWidth, getComputedStyle(box).backgroundAttachment]);
    """)
    assert [head for head, wider, _ in found if wider] == ["plan"], found
    assert all(attachment == "local, local, scroll, scroll" for _, _, attachment in found), found


def test_another_patient_is_refused(report, opened, other_plan):
    with h5py.File(other_plan, "r+") as h5:
        h5["model/point/position"][...] += 20
    result = report(opened, other_plan, "-output", "page.html")
    assert result.returncode == 1 and "two plans of one patient" in result.stderr


def write_ply(file, points, colors):
    rows = [f"{x} {y} {z} {r} {g} {b}" for (x, y, z), (r, g, b) in zip(points, colors)]
    properties = [f"property {kind} {name}" for kind, names in (
        ("float", ("x", "y", "z")), ("uchar", ("red", "green", "blue"))) for name in names]
    file.write_text("\n".join(["ply", "format ascii 1.0", f"element vertex {len(rows)}", *properties,
                               "end_header", *rows, ""]))


def test_colors_and_photographs_of_a_skin_are_kept(report, opened, tmp_path):
    model = model_of(opened)
    rows, corners = np.unique(model["skin/points"], return_inverse=True)
    points, corners = model["point/position"][rows], corners.reshape(-1, 3)
    colors = np.stack([np.arange(len(points)) % 256] * 3, 1) // (1, 2, 3)
    write_ply(tmp_path / "face.ply", points, colors)
    page_of(report, tmp_path, opened, "-skin", tmp_path / "face.ply")
    view = View(tmp_path / "page.html")
    assert np.array_equal(view.array(view.told["surfaces"][0]["colors"]), colors)
    (tmp_path / "scene.yaml").write_text("skin: face.ply\r\n", encoding="utf-8-sig", newline="")
    page_of(report, tmp_path, opened, "-scene", tmp_path / "scene.yaml")
    view = View(tmp_path / "page.html")
    assert np.array_equal(view.array(view.told["surfaces"][0]["colors"]), colors), "as Windows saves it"
    (tmp_path / "photo.png").write_bytes(b"\x89PNG a photograph")
    (tmp_path / "face.mtl").write_text("newmtl face\nmap_Kd photo.png\n")
    (tmp_path / "face.obj").write_text("mtllib face.mtl\n" + "".join(
        [f"v {x} {y} {z}\n" for x, y, z in points] +
        [f"vt {x / 200 + 0.5} {z / 300 + 0.5}\n" for x, _, z in points] +
        ["f " + " ".join(f"{c}/{c}" for c in face) + "\n" for face in corners + 1]))
    page_of(report, tmp_path, opened, "-skin", tmp_path / "face.obj")
    view = View(tmp_path / "page.html")
    shown = view.told["surfaces"][0]
    assert base64.b64decode(shown["image"].split(",")[1]) == b"\x89PNG a photograph"
    _, before, after = view.surface("skin")
    assert np.abs(view.array(shown["uv"]) - before[:, [0, 2]] / (200, 300) - 0.5).max() < 1e-3
    assert np.abs(after - last(opened)["point/position"][rows]).max() < 0.02


@pytest.mark.parametrize("change", [lambda at: at * (-1, -1, 1), lambda at: at / 1000, lambda at: at + (300, 0, 0)],
                         ids=["RAS", "m", "elsewhere"])
@pytest.mark.parametrize("name", ["colors.ply", "colors.obj", "photo.obj"])
def test_a_mesh_off_the_skin_is_refused(report, opened, tmp_path, name, change):
    model = model_of(opened)
    rows, corners = np.unique(model["skin/points"], return_inverse=True)
    points = change(model["point/position"][rows])
    write_ply(tmp_path / "colors.ply", points, np.full(points.shape, 9))
    places = [f"v {x} {y} {z}" for x, y, z in points]
    (tmp_path / "colors.obj").write_text("\n".join(place + " 1 0 0" for place in places))
    (tmp_path / "photo.png").write_bytes(b"\x89PNG a photograph")
    (tmp_path / "face.mtl").write_text("map_Kd photo.png\n")
    faces = ["f " + " ".join(f"{c}/1" for c in face) for face in corners.reshape(-1, 3) + 1]
    (tmp_path / "photo.obj").write_text("\n".join(["mtllib face.mtl", *places, "vt 0 0", *faces]))
    refused = report(opened, "-skin", name)
    assert (refused.returncode, len(refused.stderr.splitlines())) == (1, 1), refused.stderr
    assert refused.stderr.startswith(f"report.py: {name}: lies ") and "allowed are 5 mm" in refused.stderr


@pytest.mark.parametrize("name, text", [
    ("plain.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                  "end_header\n0 0 0\n"),
    ("plain.obj", "v 0 0 0\n"), ("plain.stl", "solid\nendsolid\n")])
def test_a_skin_without_colors_is_refused(report, opened, tmp_path, name, text):
    (tmp_path / name).write_text(text)
    refused = report(opened, "-skin", name)
    assert refused.returncode == 1 and len(refused.stderr.splitlines()) == 1
    assert f"{name}: has neither colors nor a texture" in refused.stderr


def test_norms_of_ones_own(report, opened, tmp_path):
    norms = [{"source": "of ours 2020", "population": "12 adults", "norms": {"facial convexity": [9, 2]}}]
    (tmp_path / "norms.json").write_text(json.dumps(norms))
    page = page_of(report, tmp_path, opened, "-landmarks", MARKS, "-norms", tmp_path / "norms.json")
    assert page.rows["facial convexity"][-1] == "9 ± 2 [1]" and "12 adults" in page.text["p"]
    (tmp_path / "norms.json").write_text('[{"norms": {"beauty": [1, 1]}}]')
    refused = report(opened, "-norms", "norms.json")
    assert refused.returncode == 1 and "norms.json" in refused.stderr and "beauty" in refused.stderr


def test_landmarks_are_found_by_shape_and_said_to_be(report, solved, tmp_path):
    face = solved("head_solid.yaml")
    page = page_of(report, tmp_path, face)
    assert "found by the shape of the profile" in page.text["p"]
    given = page_of(report, tmp_path, face, "-landmarks", PROJECT / "meshes/head.mrk.json")
    assert "found by the shape" not in given.text["p"]
    for name in ("upper lip in front of the E-line", "lower lip in front of the E-line"):
        ours, right = (float(p.rows[name][2].replace("−", "-")) for p in (page, given))
        assert abs(ours - right) < 1
    assert page.rows["Chin"] and page.rows["Lower lip"]
