"""repose-landmarks from outside: what it writes, what it says of odd heads, and its measured error."""

import json
import re
import sys

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import PROJECT, RUNS_ALL, finish, programs, runner
from heads import DATA

MESHES = PROJECT / "meshes"
SURFACES = [MESHES / "head_skin.ply", "-skull", MESHES / "head_skull.ply", "-mandible",
            MESHES / "head_mandible.ply"]


def points(file):
    markup, = json.loads(file.read_text())["markups"]
    assert markup["coordinateSystem"] == "LPS"
    return {point["label"]: point["position"] for point in markup["controlPoints"]}


def test_writes_landmarks_and_a_picture(run, tmp_path):
    result = run("repose-landmarks", *SURFACES, "-output", "head.mrk.json")
    assert (result.returncode, result.stderr) == (0, ""), result
    found = points(tmp_path / "head.mrk.json")
    assert len(found) == 23
    assert found["mouth_left"][0] > 10 > -10 > found["mouth_right"][0]
    assert (tmp_path / "head.svg").read_text().startswith("<svg")
    assert "remark: the mouth is open in SKIN" in result.stdout


def turned(folder, head, change, shift=lambda points: 0):
    """Arguments with the surfaces of a head, each point multiplied by a matrix and shifted."""
    surfaces = []
    for part in ("skin", "skull", "mandible"):
        mesh = meshio.read(f"{head}{part}.ply")
        mesh.points = mesh.points @ change.T + shift(mesh.points)
        mesh.write(folder / f"{part}.ply")
        surfaces += [f"-{part}", f"{part}.ply"] if surfaces else [f"{part}.ply"]
    return surfaces


@pytest.fixture(scope="module")
def upright(tmp_path_factory, environment):
    """upright(head) → the landmarks of a head as it is given, which are searched once only."""
    found = {}

    def landmarks(head):
        if head not in found:
            folder = tmp_path_factory.mktemp("upright")
            surfaces = turned(folder, head, np.eye(3))
            done = runner(folder, environment)("repose-landmarks", *surfaces, "-output", "upright")
            assert done.returncode == 0, done
            found[head] = points(folder / "upright.mrk.json")
        return found[head]

    return landmarks


@pytest.mark.parametrize("head", [f"{MESHES}/head_", pytest.param(
    f"{DATA}/", marks=pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing"))])
@pytest.mark.parametrize("pitch, yaw, roll", [
    (-45, 0, 0), (30, -30, 0), *(pytest.param(*more, marks=pytest.mark.long) for more in ((45, 0, 0), (0, 30, -30)))])
def test_a_turned_scan_has_the_same_landmarks(run, tmp_path, upright, head, pitch, yaw, roll):
    turn = Rotation.from_euler("xyz", [pitch, roll, yaw], degrees=True).as_matrix()
    assert run("repose-landmarks", *turned(tmp_path, head, turn), "-output", "turned").returncode == 0
    given, found = upright(head), points(tmp_path / "turned.mrk.json")
    assert len(found) == len(given) == 23
    assert max(np.linalg.norm(turn.T @ place - given[name]) for name, place in found.items()) < 0.5


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")
@pytest.mark.long
def test_noise_moves_a_flat_nasion_little(run, tmp_path):
    random, found = np.random.default_rng(0), []
    for noise in (0, 0.1, 0.1, 0.1)[:None if RUNS_ALL else 2]:
        surfaces = turned(tmp_path, f"{DATA}/", np.eye(3), lambda points: random.normal(0, noise, points.shape))
        assert run("repose-landmarks", *surfaces).returncode == 0
        found.append(points(tmp_path / "landmarks.mrk.json")["nasion_bone"])
    assert np.linalg.norm(np.subtract(found[1:], found[0]), axis=1).max() < 1.5


@pytest.mark.parametrize("head", [f"{MESHES}/head_", pytest.param(
    f"{DATA}/", marks=pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing"))])
def test_a_mirrored_head_has_mirrored_landmarks(run, tmp_path, upright, head):
    mirror = np.array([-1, 1, 1])
    surfaces = turned(tmp_path, head, np.diag(mirror))
    assert run("repose-landmarks", *surfaces, "-output", "mirrored").returncode == 0
    given, mirrored = upright(head), points(tmp_path / "mirrored.mrk.json")
    other = {"left": "right", "right": "left"}
    for name, place in given.items():
        twin = mirrored["_".join(other.get(word, word) for word in name.split("_"))]
        assert np.linalg.norm(mirror * twin - place) < 0.3, name


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")
@pytest.mark.long
def test_a_small_head_has_the_same_landmarks(run, tmp_path):
    for name, scale in (("head", 1), ("small", 0.75)):
        assert run("repose-landmarks", *turned(tmp_path, f"{DATA}/", scale * np.eye(3)), "-output", name).returncode == 0
    large, small = (points(tmp_path / f"{name}.mrk.json") for name in ("head", "small"))
    assert max(np.linalg.norm(np.subtract(small[name], 0.75 * np.array(place))) for name, place in large.items()) < 2


OF_THE_CHIN = ("menton_bone", "pogonion_bone", "b_point", "menton_soft", "pogonion_soft", "b_soft")


@pytest.mark.parametrize("aside", [0, 2, -6, 8])
def test_a_chin_beside_the_midline_keeps_its_landmarks(run, tmp_path, aside):
    """The chin is moved sideways, bone and skin, by less and less towards mouth and condyles."""
    assert run("repose-landmarks", *SURFACES, "-output", "symmetric").returncode == 0
    symmetric = points(tmp_path / "symmetric.mrk.json")
    condyles = np.mean([symmetric[f"condyle_{side}_center"] for side in ("left", "right")], axis=0)
    chin, lip = symmetric["menton_bone"], symmetric["lower_lip"]

    def sideways(places):
        behind = (condyles[1] - places[:, 1]) / (condyles[1] - chin[1])
        below = (lip[2] - places[:, 2]) / 10
        return np.outer(aside * np.clip(behind, 0, 1) * np.clip(below, 0, 1), [1, 0, 0])

    result = run("repose-landmarks", *turned(tmp_path, f"{MESHES}/head_", np.eye(3), sideways))
    line = rf"the chin lies [5-8] mm {'left' if aside > 0 else 'right'} of the skull's midsagittal plane; "
    assert result.returncode == 0 and bool(re.search(line, result.stdout)) == (abs(aside) > 4), result.stdout
    found = points(tmp_path / "landmarks.mrk.json")
    for name, place in symmetric.items():
        x, *others = np.subtract(found[name], place)
        with_chin = name in OF_THE_CHIN and abs(aside) > 4
        in_midline = abs(place[0]) < 5 and not with_chin
        expected = 0 if in_midline else sideways(np.array([place]))[0, 0]
        assert x == pytest.approx(expected, abs=1.5 if with_chin else 0.5), name
        assert np.linalg.norm(others) < 1.5, name


@pytest.mark.parametrize("change, line", [
    (np.diag([-1, -1, 1]), "as in RAS"),
    (np.diag([-1, 1, -1]), "left, back, up lie along -x, +y, -z"),
    (np.diag([1, -1, 1]), "or of y alone if the scan is mirrored"),
    (10 * np.eye(3), "surfaces must be in mm"),
    (0.1 * np.eye(3), "surfaces must be in mm"),
])
def test_refuses_another_frame_or_unit(run, tmp_path, change, line):
    result = run("repose-landmarks", *turned(tmp_path, f"{MESHES}/head_", change))
    assert result.returncode == 1 and line in result.stderr and result.stderr.count("\n") == 1


def test_known_landmarks_are_kept(run, tmp_path):
    result = run("repose-landmarks", *SURFACES, "-landmarks", MESHES / "head_landmarks.json")
    assert result.returncode == 0, result
    known = json.loads((MESHES / "head_landmarks.json").read_text())
    assert points(tmp_path / "landmarks.mrk.json")["pronasale"] == pytest.approx(known["pronasale"])
    mean, most = re.search(r"of ([\d.]+) mm in the mean, ([\d.]+) mm at most", result.stdout).groups()
    assert float(mean) < 3 and float(most) < 6


@pytest.mark.quick
def test_a_misspelled_name_is_named(run, tmp_path):
    (tmp_path / "given.csv").write_text("# CoordinateSystem = LPS\npogonion_bonne, 0, -90, -60\nwart, 0, -91, -60\n")
    result = run("repose-landmarks", *SURFACES, "-landmarks", "given.csv")
    assert result.returncode == 0
    rows = {line.split()[0]: line for line in result.stdout.splitlines() if line.startswith("'")}
    assert rows["'pogonion_bonne'"].endswith("given, under no standard name; did you mean pogonion_bone?")
    assert rows["'wart'"].endswith("given")


def test_no_given_landmark_is_replaced_or_lost(run, tmp_path):
    assert run("repose-landmarks", *SURFACES, "-output", "proposed").returncode == 0
    given = {name: [x + 2, y + 1, z - 1] for name, (x, y, z) in points(tmp_path / "proposed.mrk.json").items()}
    given["implant 2"] = [1.0, -70.0, -20.0]
    del given["stomion"], given["b_point"]
    (tmp_path / "given.json").write_text(json.dumps(given))
    result = run("repose-landmarks", *SURFACES, "-landmarks", "given.json")
    assert result.returncode == 0 and "'implant 2'" in result.stdout, result
    found = points(tmp_path / "landmarks.mrk.json")
    assert found.keys() == given.keys() | {"stomion", "b_point"}
    assert all(found[name] == pytest.approx(place, abs=1e-4) for name, place in given.items())


@pytest.mark.parametrize("arguments, line", [
    ([SURFACES[0]], "-skull FILE is required: the surface of the skull"),
    ([SURFACES[0], "-skull", SURFACES[4], "-mandible", SURFACES[2]],
     "give the skull and the mandible in this order"),
])
def test_refuses_in_one_line(run, tmp_path, arguments, line):
    result = run("repose-landmarks", *arguments)
    assert result.returncode == 1 and line in result.stderr and result.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("change, line", [
    (lambda name, p: (name, [-p[0], -p[1], p[2]]), "mm from the bones; the landmarks are those of another head"),
    (lambda name, p: ({"mouth_left": "mouth_right", "mouth_right": "mouth_left"}.get(name, name), p),
     "to the patient's right of mouth_right: they are exchanged"),
])
def test_refuses_landmarks_of_another_frame_or_side(run, tmp_path, change, line):
    assert run("repose-landmarks", *SURFACES, "-output", "proposed").returncode == 0
    found = dict(change(name, place) for name, place in points(tmp_path / "proposed.mrk.json").items())
    (tmp_path / "given.json").write_text(json.dumps(found))
    result = run("repose-landmarks", *SURFACES, "-landmarks", "given.json")
    assert result.returncode == 1 and line in result.stderr and result.stderr.count("\n") == 1, result


@pytest.mark.long
def test_measures_its_error(environment, tmp_path):
    pytest.importorskip("scipy")
    page = tmp_path / "page.md"
    page.write_text("<!-- phantoms -->\n<!-- end of phantoms -->\n<!-- real head -->\n"
                    "<!-- end of real head -->\n<!-- noise -->\n<!-- end of noise -->\n")
    result = finish([sys.executable, str(PROJECT / "tests/benchmark/landmarks.py"), "-bin",
                     str(programs()), "-heads", "1", "-output", str(page)], tmp_path, environment, 120)
    assert (result.returncode, result.stderr) == (0, ""), result
    tables = re.findall(r"\*\*all\*\* \| \d+ \| ([\d.]+) \| ([\d.]+) \|", page.read_text())
    assert len(tables) in (1, 3)  # the real head is there or not
    for (mean, most), limits in zip(tables, ((4, 15), (6, 15), (1, 4))):
        assert float(mean) < limits[0] and float(most) < limits[1], tables


@pytest.mark.parametrize("jaws", [["upper"], ["lower"], ["upper", "lower"]])
def test_the_landmarks_of_a_jaw_without_teeth_are_found(run, tmp_path, jaws):
    """The crowns are cut off; the crest of the bone takes the place of the edges of the incisors."""
    cuts = {"upper": "{bone: skull, piece: upper, planes: [{point: [0, -85, -10.5], normal: [0, 0, -1]}, "
                     "{point: [0, -40, 0], normal: [0, -1, 0]}]}",
            "lower": "{bone: mandible, piece: lower, planes: [{point: [0, -85, -36], normal: [0, 0, 1]}, "
                     "{point: [0, -40, 0], normal: [0, -1, 0]}]}"}
    (tmp_path / "scene.yaml").write_text(
        f"skin: {SURFACES[0]}\nbones: [{{name: skull, file: {SURFACES[2]}}}, {{name: mandible, file: {SURFACES[4]}}}]\n"
        f"tissue: {{layers: 4, edge: 6}}\nosteotomies: [{', '.join(cuts[jaw] for jaw in jaws)}]\n")
    assert run("repose-osteotomy", "scene.yaml", "-output", "cut").returncode == 0
    assert run("repose-landmarks", *SURFACES, "-output", "whole").returncode == 0
    result = run("repose-landmarks", SURFACES[0], "-skull", "cut_skull.ply", "-mandible", "cut_mandible.ply",
                 "-output", "toothless")
    assert (result.returncode, result.stderr) == (0, ""), result
    whole, found = (points(tmp_path / f"{name}.mrk.json") for name in ("whole", "toothless"))
    assert len(found) == 23
    for name in ("nasal_spine", "nasion_bone", "pogonion_bone", "stomion", "pronasale", "mouth_left"):
        assert np.linalg.norm(np.subtract(found[name], whole[name])) < 2, name
