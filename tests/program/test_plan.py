"""The scene key plan: the face as a continuous function of the plan, and its derivatives."""

import re

import h5py
import numpy as np
import pytest
from conftest import PROJECT, shipped

PLAN = "plan:\n  pieces: [mandible, chin]\n  box: {translate: [0, 8, 0], rotate: [2, 0, 0]}\n"
JAWS = "moves:\n  - {bone: mandible, translate: [0, -5, 0]}\n  - {bone: chin, translate: [0, %g, 0]}\n"


@pytest.fixture
def scene(tmp_path):
    """scene(moves, plan) → a genioplasty of a coarse head with these moves."""
    text = shipped("head_genioplasty.yaml", layers=3, edge=8).split("moves:")[0]

    def write(moves, plan=PLAN):
        path = tmp_path / "scene.yaml"
        path.write_text(text + moves + plan)
        return path
    return write


def skin(file):
    with h5py.File(file) as result:
        assert result["step/0000"].attrs["load"] in (0, 1)
        last = result["step"][sorted(result["step"])[-1]]
        layer = result["model/point/layer"][:]
        return last["point/position"][:][layer == 0]


def test_a_sweep_through_equal_moves_is_continuous(run, scene, tmp_path):
    faces = []
    for move in (-4.95, -5, -5.001, -5.05):
        name = tmp_path / f"at{move:g}"
        result = run("repose-solve", scene(JAWS % move), "-output", name, "-accuracy", "0.01")
        assert result.returncode == 0, result
        faces.append(skin(f"{name}.h5"))
    steps = [np.linalg.norm(b - a, axis=1).max() for a, b in zip(faces, faces[1:])]
    assert steps[1] < 0.02, "a thousandth of a millimeter more, where pieces move alike"
    assert max(steps) < 0.1


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.long), 2])
def test_tangents_are_differences_of_faces(run, scene, tmp_path, ranks):
    def solve(move, *options):
        name = tmp_path / "face"
        result = run("repose-solve", scene(JAWS % move), "-output", name, "-accuracy", "1e-4",
                     *options, ranks=ranks)
        assert result.returncode == 0, result
        return result.stdout, f"{name}.h5"
    message, file = solve(-4, "-tangents")
    assert "13 of 13 derivatives" in message, "by two pieces and one stratum"
    assert run("repose-check", file).returncode == 0
    with h5py.File(file) as result:
        last = result["step"][sorted(result["step"])[-1]]["point"]
        names = [name.decode() for name in result["model/bone"]]
        column = last[f"tangent_{names.index('chin')}_ty"]
        assert column.attrs["unit"].decode() == "mm/mm"
        assert column.attrs["finished"] == column.attrs["convex"] == 1
        tangent = column[:][result["model/point/layer"][:] == 0]
        assert last["tangent_young_0"].attrs["unit"].decode() == "mm"
        assert np.abs(last["tangent_young_0"][:]).max() < 0.01, "stiffer all over, nothing changes"
    step = 0.05
    faces = [skin(solve(-4 + shift)[1]) for shift in (-step, step)]
    difference = (faces[1] - faces[0]) / (2 * step)
    error = np.linalg.norm(tangent - difference, axis=1)
    assert np.linalg.norm(difference, axis=1).max() > 0.5
    assert np.percentile(error, 95) < 0.01 and error.max() < 0.1


def test_tangents_of_springs_are_solved_as_far_as_those_of_a_solid(run, tmp_path):
    fields = []
    for options in ((), ("-ksp_rtol", 1e-9)):
        result = run("repose-solve", PROJECT / "meshes/head_springs_advance.yaml", "-tangents", "-accuracy", 1e-3,
                     "-output", tmp_path / "face", *options)
        assert result.returncode == 0, result
        with h5py.File(tmp_path / "face.h5") as file:
            point = file["step"][sorted(file["step"])[-1]]["point"]
            fields.append({name: point[name][:] for name in point if name.startswith("tangent_")})
    assert len(fields[0]) >= 6
    for name, exact in fields[1].items():
        largest = np.linalg.norm(exact, axis=1).max()
        assert np.linalg.norm(fields[0][name] - exact, axis=1).max() <= 1e-3 * largest, name


@pytest.mark.parametrize("change", [
    ("preset: face", "preset: face, dilatation: nodal"), ("  release: 5 ", "  density: 1.0e-6\n  release: 5 "), ()],
    ids=["nodal dilatation", "gravity that opens an incision", "neither"])
def test_tangents_by_stiffnesses_are_left_out_with_the_reason(run, scene, tmp_path, change):
    path = scene(JAWS % -2)
    text = path.read_text().replace(*change) if change else path.read_text()
    if "density" in text:
        text += ("gravity: [0, 0, -9.8]\nincisions:\n"
                 "  - {path: [[47, -80, 8], [49, -75, -8], [46.5, -70, -24]], layers: 2}\n")
    path.write_text(text)
    result = run("repose-solve", path, "-tangents", "-output", "face")
    assert result.returncode == 0, result
    none = bool(change)
    row = re.search(r"tangents +(\d+) of \d+ .*", result.stdout)
    assert row[1] == ("12" if none else "13")
    reason = "none by stiffnesses, which need a scene with tissue.material, without turgor, gravity and"
    assert (reason in row[0]) == none
    with h5py.File(tmp_path / "face.h5") as file:
        last = file["step"][sorted(file["step"])[-1]]["point"]
        assert any("young" in name for name in last) != none


@pytest.mark.quick
def test_moves_outside_the_plan_are_refused(run, scene):
    for moves, plan, words in (
            (JAWS % -9, PLAN, "plan.box: 'chin' moves out of it: translation -9 mm along y"),
            (JAWS % -5, "plan: {pieces: chin}\n", "lacks 'mandible', which moves")):
        result = run("repose-solve", scene(moves, plan))
        assert result.returncode == 1 and words in result.stderr
        assert result.stderr.count("\n") == 1
    result = run("repose-solve", scene("", ""), "-tangents")
    assert result.returncode == 1 and "no bone moves" in result.stderr
