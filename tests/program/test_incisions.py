"""Incisions: the stressed skin opens them, and what comes out is a model like any other."""

import meshio
import numpy as np
import pytest

from conftest import PROJECT, shipped
from heads import read_vtp
from tissue import apart, last, model_of, same_face

PATH = "[[47, -80, 8], [49, -75, -8], [46.5, -70, -24]]"
# The shipped scene on the coarser head.
SCENE = (PROJECT / "meshes/head_springs_incision.yaml").read_text().replace("head_", "paper_")
BALL = """instruments:
  - {sphere: {center: [57, -90, -10], radius: 20}, push: [-9, 12, 0]}
"""
TURGOR = (0.02, 0.05, 0.1, 0.2)


def cut(run, folder, name="cut", scene=SCENE, ranks=1, accuracy=1e-3):
    (folder / "cut.yaml").write_text(scene)
    result = run("repose-solve", "cut.yaml", "-accuracy", accuracy, "-output", name, ranks=ranks,
                 cwd=folder)
    assert (result.returncode, result.stderr) == (0, ""), result
    return folder / f"{name}.h5"


def doubled(model):
    """Rows of the doubled points and of their doubles."""
    layers = model["point/layer"].max() + 1
    columns = model["point/column"].max() + 1
    twin = np.arange(columns * layers, len(model["point/layer"]))
    return model["point/column"][twin] * layers + model["point/layer"][twin], twin


def gap(file):
    """Largest distance between two doubled points of the skin, mm."""
    model, x = model_of(file), last(file)["point/position"]
    row, twin = doubled(model)
    skin = model["point/layer"][row] == 0
    return np.linalg.norm(x[row] - x[twin], axis=1)[skin].max()


def with_turgor(turgor):
    assert "turgor: 0.1 " in SCENE
    return SCENE.replace("turgor: 0.1 ", f"turgor: {turgor} ")


def test_turgor_opens_the_same_cut_further(run, folder):
    gaps = [gap(cut(run, folder, f"turgor_{turgor}", with_turgor(turgor))) for turgor in TURGOR]
    assert gaps[0] > 0.05 and (np.diff(gaps) > 0).all(), gaps
    assert gaps[-1] > 4 * gaps[0]
    closed = cut(run, folder, "closed", with_turgor(0))
    assert gap(closed) < 1e-3, "without tension nothing opens it"


@pytest.mark.quick
def test_without_the_cut_nothing_moves_and_far_away_little_does(run, folder):
    file = cut(run, folder)
    moved = np.linalg.norm(last(file)["point/displacement"], axis=1)
    far = np.linalg.norm(model_of(file)["point/position"] - [48, -75, -8], axis=1) > 60
    assert moved.max() > 10 * moved[far].max()
    head, _, tail = SCENE.partition("incisions:")
    whole = cut(run, folder, "whole", head + tail[tail.index("solve:"):])
    assert last(whole)["point/displacement"] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("layers", [1, 4])
def test_parts_as_many_layers_as_asked_for_but_not_the_tips(run, folder, layers):
    model = model_of(cut(run, folder, scene=SCENE.replace("]], layers: 2", f"]], layers: {layers}")))
    row, twin = doubled(model)
    depth = model["point/layer"][row]
    assert (model["point/set"][row] == 0).all() and depth.max() < layers
    assert len(np.unique(model["point/column"][row])) == (depth == 0).sum() > 2
    assert (model["point/position"][row] == model["point/position"][twin]).all()


def test_result_passes_the_check_and_is_solved_again_the_same(run, folder):
    file = cut(run, folder, accuracy=1e-7)
    assert last(file)["inverted_prisms"] == 0
    assert run("repose-check", file).returncode == 0
    result = run("repose-solve", file, "-accuracy", 1e-7, "-output", "again", cwd=folder)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert apart(last(file), last(folder / "again.h5")) < 1e-6
    same_face(file, cut(run, folder, "two", ranks=2, accuracy=1e-7), 1e-6)
    assert (model_of(file)["spring/points"] == model_of(folder / "two.h5")["spring/points"]).all()


@pytest.mark.parametrize("path, message", [
    ("[[47, -80, 8], [60, -90, -8]]", "mm from the skin, allowed are 5 mm"),
    ("[[47, -80, 8], [47.5, -80, 7]]", "no longer than an edge of the skin"),
    ("[[47, -80, 8], [46.5, -70, -24], [55, -65, -24], [57, -67, -5], [38, -82, -5]]",
     "meets itself"),
    ("[[47, -80, 8]]", "must have two points at least"),
    ("missing.mrk.json", "missing.mrk.json"),
], ids=["off the skin", "short", "crossing", "one point", "no file"])
@pytest.mark.parametrize("ranks", [1, 3])
def test_bad_paths_are_refused_in_one_line(run, folder, path, message, ranks):
    assert PATH in SCENE
    (folder / "cut.yaml").write_text(SCENE.replace(PATH, path))
    result = run("repose-solve", "cut.yaml", ranks=ranks, cwd=folder)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result.stderr
    assert message in result.stderr and "incisions[0]" in result.stderr
    assert not list(folder.glob("cut*.h5*"))


def test_rim_depth_and_instruments_are_refused(run, folder):
    for scene, message in ((SCENE.replace("layers: 2", "layers: 5"), "1 … 4"),
                           (SCENE.replace(PATH, rim_path(folder)), "reaches the rim"),
                           (SCENE.replace("solve:", BALL + "solve:"), "an instrument holds")):
        (folder / "cut.yaml").write_text(scene)
        result = run("repose-solve", "cut.yaml", cwd=folder)
        assert result.returncode == 1 and message in result.stderr, result.stderr


def rim_path(folder):
    """Along the border of the skin: a few of its vertices in order."""
    mesh = meshio.read(folder / "paper_skin.ply")
    triangles = mesh.cells_dict["triangle"]
    sides = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = {(a, b) for a, b in sides.tolist()}
    border = {a: b for a, b in edges if (b, a) not in edges}
    vertex = next(iter(sorted(border)))
    points = []
    for _ in range(5):
        points.append(mesh.points[vertex].tolist())
        vertex = border[vertex]
    return str(points)


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_given_skin_parts_with_the_lips(run, tmp_path, ranks):
    """Remeshed and solved with parted lips; the given one goes along, each side with its own lip."""
    text = shipped("head_jaw_opening.yaml", layers=3, edge=8)
    text += "mouth: {path: [[-20, -92, -35], [0, -98, -35], [20, -92, -35]]}\n"
    file = cut(run, tmp_path, scene=text, ranks=ranks, accuracy=0.1)
    model, step = model_of(file), last(file)
    one, twin = (rows[model["point/layer"][rows] == 0] for rows in doubled(model))
    lips = np.concatenate([one, twin])
    opening = np.linalg.norm(step["point/position"][one] - step["point/position"][twin], axis=1)
    given = read_vtp(file.with_name("cut_given_skin.vtp"))
    found = []
    for row in (one[np.argmax(opening)], twin[np.argmax(opening)]):
        # the neighbors of the lip on its side, without the line itself
        faces = model["skin/points"][(model["skin/points"] == row).any(1)]
        middle = model["point/position"][np.setdiff1d(faces, lips)].mean(0)
        vertex = np.argmin(np.linalg.norm(given["Points"] - middle, axis=1))
        assert given["solved"][vertex] > 0.9, "near the border it is less than 1"
        found.append(given["displacement"][vertex])
    apart_by = np.linalg.norm(found[0] - found[1])
    assert opening.max() > 2 and apart_by > 0.5 * opening.max(), (opening.max(), apart_by)
