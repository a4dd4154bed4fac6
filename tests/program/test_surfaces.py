"""repose-decimate and repose-register from outside: what they print, write and refuse."""

import json
import re
import shutil

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import PROJECT, expect_refusal, programs

RANGE = PROJECT.parent / "shared/data/range"
SKULL = PROJECT / "meshes/paper_skull.ply"
NAMES = ["nasion", "chin", "left", "right", "crown"]


def figure(text, before):
    """The number that follows a word of the output."""
    return float(re.search(before + r"\s+([0-9.e+-]+)", text).group(1))


def markups(points, frame="LPS", names=NAMES):
    signs = np.array([-1, -1, 1]) if frame == "RAS" else np.ones(3)
    return json.dumps({"markups": [{
        "type": "Fiducial", "coordinateSystem": frame, "coordinateUnits": "mm",
        "controlPoints": [{"label": name, "position": list(map(float, signs * point))}
                          for name, point in zip(names, points)]}]})


class Pair:
    """A folder with the skull, a moved copy, and landmarks of both."""

    def __init__(self, folder):
        self.folder = folder
        shutil.copy(SKULL, folder / "fixed.ply")
        self.fixed = meshio.read(SKULL)
        self.rotation = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
        self.translation = np.array([10.0, -20.0, 30.0])
        self.write("moving.ply", self.back(self.fixed.points))
        spread = np.linspace(0, len(self.fixed.points) - 1, 5).astype(int)
        self.landmarks = self.fixed.points[spread].astype(float)
        (folder / "moving.mrk.json").write_text(markups(self.back(self.landmarks)))
        (folder / "fixed.mrk.json").write_text(markups(self.landmarks, "RAS"))

    def back(self, points):
        return (points - self.translation) @ self.rotation

    def write(self, name, points):
        meshio.Mesh(points.astype(float), [("triangle", self.fixed.cells_dict["triangle"].astype(
            np.int32))]).write(self.folder / name, binary=False)


@pytest.fixture
def pair(tmp_path):
    return Pair(tmp_path)


REGISTER = ["repose-register", "moving.ply", "fixed.ply", "-landmarks", "moving.mrk.json",
            "fixed.mrk.json"]


@pytest.mark.quick
def test_decimation_prints_and_keeps_its_bound(run, tmp_path):
    result = run("repose-decimate", SKULL, "-distance", "0.7", "-output", "coarse.ply")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert figure(result.stdout, "bound asked") == 0.7
    assert 0 < figure(result.stdout, "bound proven") <= 0.7
    before, after = (figure(result.stdout, word) for word in ("input", "result"))
    mesh = meshio.read(tmp_path / "coarse.ply")
    assert len(mesh.cells_dict["triangle"]) == after < 0.7 * before


@pytest.mark.long
def test_decimation_to_a_count_prints_its_distance(run, tmp_path):
    result = run("repose-decimate", SKULL, "-triangles", "300", "-output", "coarse.ply")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert len(meshio.read(tmp_path / "coarse.ply").cells_dict["triangle"]) == 300
    assert figure(result.stdout, "bound proven") > 0.5


@pytest.mark.quick
def test_registration_brings_the_mesh_to_its_place_and_back_from_the_file(run, pair):
    result = run(*REGISTER, "-output", "found")
    assert (result.returncode, result.stderr) == (0, ""), result
    found = meshio.read(pair.folder / "found.ply")
    assert np.abs(found.points - pair.fixed.points).max() < 1e-4
    numbers = re.search("Parameters: (.*)", (pair.folder / "found.tfm").read_text()).group(1)
    numbers = np.array(numbers.split(), float)
    stored = pair.fixed.points @ numbers[:9].reshape(3, 3).T + numbers[9:]  # from fixed to moving
    assert np.abs(stored - pair.back(pair.fixed.points)).max() < 1e-4


def test_exchanged_names_of_landmarks_are_noted(run, pair):
    assert "note: rms" not in run(*REGISTER, "-output", "found").stdout
    names = [NAMES[1], NAMES[0], *NAMES[2:]]
    (pair.folder / "fixed.mrk.json").write_text(markups(pair.landmarks, names=names))
    result = run(*REGISTER, "-output", "found")
    assert (result.returncode, result.stderr) == (0, ""), result
    residuals = {name: float(mm) for name, mm in re.findall(r"^  (\w+) +([\d.]+) mm", result.stdout, re.M)}
    noted = re.search(r"note: rms \S+ mm, expected at most 5 mm; (\w+) is farthest off, by (\S+) mm", result.stdout)
    assert residuals[noted[1]] == max(residuals.values()) == pytest.approx(float(noted[2]), rel=0.01)


def test_a_bad_landmark_is_named_and_icp_mends_the_rest(run, pair):
    rng = np.random.default_rng(1)
    noisy = pair.landmarks + rng.normal(0, 0.8, (5, 3))
    more = pair.fixed.points[[7, 70, 300]] + rng.normal(0, 0.8, (3, 3))
    names = NAMES + ["a", "b", "c"]
    moving = pair.back(np.concatenate([pair.landmarks, pair.fixed.points[[7, 70, 300]]]))
    fixed = np.concatenate([noisy, more])
    fixed[1] += [0, 0, 40]
    (pair.folder / "moving.mrk.json").write_text(markups(moving, "RAS", names))
    (pair.folder / "fixed.mrk.json").write_text(markups(fixed, "LPS", names))
    result = run(*REGISTER, "-icp", "-trim", "1", "-output", "found")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert re.search("chin .* left out", result.stdout) and result.stdout.count("left out") == 2
    assert "ICP converged" in result.stdout
    found = meshio.read(pair.folder / "found.ply")
    assert np.abs(found.points - pair.fixed.points).max() < 0.01


OFF = {
    "RAS numbers in a file that states LPS": lambda p: {"moving": p.back(p.landmarks) * [-1, -1, 1]},
    "landmarks of both in cm": lambda p: {"moving": p.back(p.landmarks) / 10, "fixed": p.landmarks / 10},
}


@pytest.mark.parametrize("case", OFF)
def test_landmarks_off_their_mesh_get_a_note(run, pair, case):
    assert "note: landmark" not in run(*REGISTER).stdout
    for name, points in OFF[case](pair).items():
        (pair.folder / f"{name}.mrk.json").write_text(markups(points))
    result = run(*REGISTER)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert len(re.findall(r"note: landmark \w+ lies [\d.]+ mm from moving.ply", result.stdout)) == 1, result


def in_meters(pair):
    pair.write("moving.ply", pair.back(pair.fixed.points) / 1000)
    (pair.folder / "moving.mrk.json").write_text(markups(pair.back(pair.landmarks) / 1000))


def test_a_scan_in_meters_needs_a_scale(run, pair):
    in_meters(pair)
    result = run(*REGISTER, "-similarity", "-output", "found")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert figure(result.stdout, "scale") == pytest.approx(1000) and "note" not in result.stdout
    assert np.abs(meshio.read(pair.folder / "found.ply").points - pair.fixed.points).max() < 0.01


def fins(folder):
    points = np.array([[0, 0, 0], [50, 0, 0], [0, 50, 0], [0, -50, 0], [0, 0, 50]], float)
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32)
    meshio.Mesh(points, [("triangle", faces)]).write(folder / "fins.ply", binary=False)


def spoil(pair, points, names=NAMES):
    for name in ("moving", "fixed"):
        (pair.folder / f"{name}.mrk.json").write_text(markups(points, names=names))


def no_frame(pair):
    text = (pair.folder / "fixed.mrk.json").read_text()
    (pair.folder / "fixed.mrk.json").write_text(text.replace('"coordinateSystem": "RAS", ', ""))


# What is done to the input, the command, and words that the message must hold.
CASES = {
    "non-manifold mesh": (
        lambda p: fins(p.folder), ["repose-decimate", "fins.ply", "-distance", "1"],
        ["fins.ply", "non-manifold edge", "repair"]),
    "neither distance nor count": (
        lambda p: None, ["repose-decimate", "fixed.ply"], ["-distance", "-triangles"]),
    "output that is no PLY": (
        lambda p: None, ["repose-decimate", "fixed.ply", "-distance", "1", "-output", "a.stl"],
        ["a.stl", ".ply"]),
    "distance zero": (
        lambda p: None, ["repose-decimate", "fixed.ply", "-distance", "0"], ["-distance", "> 0"]),
    "distance below rounding": (
        lambda p: None, ["repose-decimate", "fixed.ply", "-distance", "1e-12"], ["fixed.ply: -distance", "or more", "1e-12 mm"]),
    "two landmarks only": (
        lambda p: spoil(p, p.landmarks[:2]), REGISTER, ["2 landmark", "three"]),
    "landmarks on a line": (
        lambda p: spoil(p, np.outer(range(5), [1, 2, 3])), REGISTER, ["on a line", "beside"]),
    "scan in meters": (in_meters, [*REGISTER, "-icp"], ["1000 times", "0.2 to 5", "mm", "-similarity"]),
    "frame not said": (
        no_frame, REGISTER, ["fixed.mrk.json:1:", "coordinateSystem", "LPS", "RAS"]),
    "no name in common": (
        lambda p: (p.folder / "fixed.mrk.json").write_text(markups(p.landmarks, names="vwxyz")),
        REGISTER, ["0 landmark", "-match order"]),
    "a name twice": (
        lambda p: spoil(p, p.landmarks, ["chin"] * 5), REGISTER, ["moving.mrk.json", "'chin'"]),
    "lists of different length": (
        lambda p: (p.folder / "fixed.mrk.json").write_text(markups(p.landmarks[:4])),
        [*REGISTER, "-match", "order"], ["5", "4", "-match order"]),
    "no landmarks": (
        lambda p: None, REGISTER[:3], ["-landmarks"]),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_refused(run, pair, case):
    change, command, words = CASES[case]
    change(pair)
    expect_refusal(run, pair.folder, words, *command)


@pytest.mark.skipif(not RANGE.is_dir(), reason=f"no range scans: {RANGE} is missing")
def test_two_scans_of_the_bunny_come_together(run, tmp_path):
    if not (programs() / "repose-scan").exists():
        pytest.skip("repose-scan is not built")
    for scan in ("bun000", "bun090"):
        made = run("repose-scan", RANGE / f"{scan}.ply", "-output", f"{scan}_mesh.ply")
        assert made.returncode == 0, made
    moving, fixed = (meshio.read(tmp_path / f"{s}_mesh.ply") for s in ("bun090", "bun000"))
    unit = 1000 if np.ptp(fixed.points) < 1 else 1  # of the scans: m
    turn = Rotation.from_quat([0.000335889, -0.708202, 0.000602459, 0.706009]).inv()
    shift = np.array([2.20761e-05, -3.34606e-05, -7.20881e-05]) * 1000 / unit
    truth = turn.apply(moving.points) + shift  # bun.conf
    rows = np.argsort(truth @ [1, 2, 3])[::len(truth) // 6][:6]
    noise = np.random.default_rng(2).normal(0, 1.0 / unit, (6, 3))
    names = list("abcdef")
    (tmp_path / "m.mrk.json").write_text(markups(moving.points[rows], names=names))
    (tmp_path / "f.mrk.json").write_text(markups(truth[rows] + noise, "RAS", names))
    result = run("repose-register", "bun090_mesh.ply", "bun000_mesh.ply", "-landmarks",
                 "m.mrk.json", "f.mrk.json", "-icp", "-trim", "0.7", "-output", "found")
    assert result.returncode == 0, result
    found = meshio.read(tmp_path / "found.ply").points
    assert np.sqrt(((found - truth) ** 2).sum(axis=1).mean()) * unit < 0.5  # mm
