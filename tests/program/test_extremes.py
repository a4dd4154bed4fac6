"""Scenes and models at the edge of what is asked: each ends with a right answer, one clear line or a
loud "not converged" with a valid result; where physics says what must come out, that comes out."""

import re

import meshio
import numpy as np
import pytest

from conftest import PROJECT
from tissue import apart, last, model_of, steps, write_model

ADVANCE, OPENING = "paper_jaw_advance.yaml", "paper_jaw_opening.yaml"
MESHES = PROJECT / "meshes"


@pytest.fixture
def solve(run, tmp_path):
    """solve(shipped scene, (old, new) text to exchange…, options, statuses, meshes: their folder) → the
    last step of a result that repose-check agrees with."""

    def solve_scene(shipped, *changes, options=(), statuses=(0,), meshes=MESHES):
        text = (MESHES / shipped).read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "scene.yaml").write_text(text.replace(": paper_", f": {meshes}/paper_"))
        return finished(run, tmp_path, "scene.yaml", options, statuses)

    return solve_scene


def finished(run, folder, given, options=(), statuses=(0,)):
    """The last step of a run that ended with one of the statuses and left a valid result."""
    result = run("repose-solve", given, *options, "-allow_folded", "-output", "out")
    assert result.returncode in statuses and result.stderr == "", result
    assert run("repose-check", "out.h5").returncode == 0
    step = last(folder / "out.h5")
    assert step["converged"] == (result.returncode == 0)
    assert ("NOT CONVERGED" in result.stdout) == (result.returncode == 2)
    assert np.isfinite(step["point/position"]).all()
    assert ("TISSUE IS FOLDED" in result.stdout) == (step["inverted_prisms"] > 0)
    return step


SET = "default: {stiffness: 1.0, law: quartic, reference: 1.0}"
LAYERS, FORM, JAW = "layers: 4", "form: penalty", "-6, 0]"
TWO = (LAYERS, "layers: 2")
TERM = f"{FORM}, poisson: 0.4967"

TAME = {
    "linear": [("law: quartic", "law: linear")],
    "quadratic": [("law: quartic", "law: quadratic")],
    "strain": [("reference: 1.0", "reference: initial")],
    "modulus": [("stiffness: 1.0", "modulus: 0.02")],
    "as shipped": [],
    "stiff skin": [(SET, SET + '\n    "layer 0": {stiffness: 1000}')],
    "soft skin, stiff tissue": [(SET, SET + '\n    "layer 0": {stiffness: 1.0e-6}'
                                 '\n    diagonal: {stiffness: 1.0e+6}')],
    "paper": [(TERM, "form: paper")],
    "none": [(TERM, "form: none")],
    "lambda 1": [(TERM, "form: paper"), ("solve:", "solve:\n  lambda: 1")],
    "hardly moved": [(JAW, "-1.0e-9, 0]")],
}


@pytest.mark.parametrize("case", TAME)
def test_a_tame_extreme_converges(solve, case):
    step = solve(ADVANCE, TWO, *TAME[case])
    assert step["load"] == 1


def test_the_volume_is_kept_the_better_the_larger_kappa(solve):
    changes = [solve(ADVANCE, TWO, (FORM, f"{FORM}, bulk_modulus: {kappa}"))["f_v"]
               for kappa in ("1.0e-6", "1.0e-3", "1", "1000")]
    assert all(less > more for less, more in zip(changes, changes[1:]))


def test_a_bone_that_stays_moves_nothing(solve):
    step = solve(ADVANCE, (JAW, "0, 0]"))
    assert step["load"] == 1 and np.abs(step["point/displacement"]).max() == 0


# Scene, changes, options and the exit statuses that may come of them.
WILD = {
    "40 mm": (ADVANCE, [TWO, (JAW, "-40, 0]")], ["-accuracy", 1], [0, 2]),
    "45°": (OPENING, [TWO, ("angle: 8", "angle: 45")], ["-accuracy", 1, "-load_steps", 1], [0, 2]),
    "45° with few iterations": (OPENING, [TWO, ("angle: 8", "angle: 45")],
                                ["-accuracy", 1, "-tao_max_it", 5], [2]),
    "6 m": (ADVANCE, [(JAW, "-6000, 0]")], ["-load_steps", 1, "-tao_max_it", 20], [0, 2]),
    "stiffness 1e-6 … 1e6": (ADVANCE, [(SET, SET + '\n    "layer 0": {stiffness: 1.0e+6}'
                                        "\n    connecting: {stiffness: 1.0e-6}")],
                             ["-tao_max_it", 5, "-load_steps", 1], [2]),
    "stiffness 1e-9 … 1e12": (ADVANCE, [(SET, "default: {stiffness: 1.0e-9}"
                                         '\n    "layer 0": {stiffness: 1.0e+12}')],
                              ["-tao_max_it", 5, "-load_steps", 1], [2]),
    "16 layers": (ADVANCE, [(LAYERS, "layers: 16"), (JAW, "-2, 0]")], [], [0]),
}


@pytest.mark.parametrize("case", WILD)
def test_a_wild_extreme_ends_with_a_valid_result(solve, case):
    scene, changes, options, statuses = WILD[case]
    solve(scene, *changes, options=options, statuses=statuses)


def test_folded_tissue_is_no_success_unless_allowed(solve, run, tmp_path):
    """The jaw comes 40 mm forward: the tissue beside it is turned inside out."""
    folded = solve(ADVANCE, TWO, (JAW, "-40, 0]"), options=["-accuracy", 1])
    assert folded["inverted_prisms"] > 0 and folded["converged"]
    result = run("repose-solve", "scene.yaml", "-accuracy", 1, "-output", "out")
    assert result.returncode == 2 and result.stderr == ""
    line = next(line for line in result.stdout.splitlines() if line.startswith("FOLDED"))
    assert f"{folded['inverted_prisms']} prisms" in line and "-allow_folded" in line
    model, step = model_of(tmp_path / "out.h5"), last(tmp_path / "out.h5")
    worst = model["prism/points"][np.argmin(step["prism/volume_ratio"])][0]
    place = [float(x) for x in re.search(r"about \((.*?)\) mm", line)[1].split(",")]
    assert np.abs(model["point/position"][worst] - place).max() <= 0.051
    assert "a hard way: tissue folds on it; move the bones less" in result.stdout
    assert last(tmp_path / "out.h5")["inverted_prisms"] == folded["inverted_prisms"]


def test_coordinates_far_from_the_origin(solve, solved, tmp_path):
    away = np.array([1e6, -1e6, 1e6])
    for part in ("skin", "skull", "mandible"):
        mesh = meshio.read(MESHES / f"paper_{part}.ply")
        meshio.Mesh(mesh.points.astype(float) + away, mesh.cells).write(
            tmp_path / f"paper_{part}.ply")
    far = solve(ADVANCE, options=["-accuracy", 1e-6], meshes=tmp_path)
    near = last(solved(ADVANCE, "-accuracy", 1e-6))
    assert np.abs(far["point/displacement"] - near["point/displacement"]).max() < 1e-5


def test_units_scale(run, solved, tmp_path):
    """A model ten times as large, with moduli for stiffness, has the same face ten times as large."""
    model = model_of(solved(ADVANCE, "-accuracy", 1e-6))
    del model["bone_transform"]
    for name, power in (("point/position", 1), ("point/target", 1), ("spring/rest_length", 1),
                        ("spring/reference", 1), ("spring/stiffness", 1), ("prism/rest_volume", 3)):
        model[name] = model[name] * 10.0**power
    write_model(tmp_path / "model.h5", model)
    small = last(solved(ADVANCE, "-accuracy", 1e-6))
    large = finished(run, tmp_path, "model.h5",
                     ["-accuracy", 1e-5, "-bulk_modulus", repr(float(small["bulk_modulus"]))])
    assert large["objective"] == pytest.approx(1e3 * small["objective"], rel=1e-11)
    assert np.abs(large["point/position"] / 10 - small["point/position"]).max() < 2e-6


def test_the_same_motion_of_everything_strains_nothing(run, solved, tmp_path):
    """All fixed points turned by 30° together: the tissue is carried along."""
    model = model_of(solved(ADVANCE, "-accuracy", 1e-6))
    del model["bone_transform"], model["bone"]
    turn = np.array([[0.75**0.5, -0.5, 0], [0.5, 0.75**0.5, 0], [0, 0, 1]])
    fixed = model["point/set"] != 0
    model["point/bone"] = np.where(fixed, 0, -1).astype("i4")
    model["point/set"] = np.where(fixed, 2, 0).astype("i1")
    model["bone"] = np.array([b"all"])
    model = {name: values for name, values in model.items() if not name.startswith("bone_surface")}
    model["point/target"] = np.where(fixed[:, None], model["point/position"] @ turn.T,
                                     model["point/position"])
    write_model(tmp_path / "model.h5", model)
    step = finished(run, tmp_path, "model.h5", ["-accuracy", 1e-6])
    assert np.abs(step["point/position"] - model["point/position"] @ turn.T).max() < 2e-6
    assert step["objective"] < 1e-6


def test_no_free_point_is_refused(run, solved, tmp_path):
    model = model_of(solved(ADVANCE, "-accuracy", 1e-6))
    model["point/set"] = np.where(model["point/set"] == 0, 1, model["point/set"]).astype("i1")
    write_model(tmp_path / "model.h5", model)
    result = run("repose-solve", "model.h5", "-output", "out")
    assert result.returncode == 1 and "soft-tissue" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["model.h5"]


def without(model, kind, gone):
    """The model without some of its springs or prisms."""
    return {name: values[~gone] if name.startswith(kind + "/") else values
            for name, values in model.items()}


def test_a_point_without_a_spring_is_refused(run, solved, tmp_path):
    model = model_of(solved(ADVANCE, "-accuracy", 1e-6))
    lone = int(np.flatnonzero((model["point/set"] == 0) & (model["point/layer"] == 0))[7])
    model = without(model, "spring", (model["spring/points"] == lone).any(1))
    model = without(model, "prism", (model["prism/points"] == lone).any(1))
    write_model(tmp_path / "model.h5", model)
    result = run("repose-solve", "model.h5", "-output", "out")
    assert result.returncode == 1 and len(result.stderr.splitlines()) == 1
    assert f"row {lone} is soft tissue and no spring or edge holds it" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["model.h5"]


def test_a_pendulum_of_one_spring_hangs_down(run, tmp_path):
    """One point of 1 kg on one linear spring of 1 N/mm below a point held fixed."""
    position = np.array([[0.0, 0, 0], [10, 0, 0]])
    write_model(tmp_path / "model.h5", {
        "gravity": np.array([0, 0, -9.80665]), "point/position": position,
        "point/set": np.array([1, 0], "i1"), "point/target": position,
        "point/layer": np.zeros(2, "i4"), "point/column": np.arange(2),
        "point/bone": np.full(2, -1, "i4"), "point/mass": np.array([0.0, 1]),
        "point/external_force": np.zeros((2, 3)), "spring/points": np.array([[0, 1]]),
        "spring/set": np.zeros(1, "i4"), "spring/rest_length": np.array([10.0]),
        "spring/stiffness": np.ones(1), "spring/exponent": np.zeros(1, "i1"),
        "spring/reference": np.ones(1), "prism/points": np.zeros((0, 6), "i8"),
        "prism/rest_volume": np.zeros(0), "spring_set": np.array([b"all"]),
        "bone": np.zeros(0, "S1")})
    step = finished(run, tmp_path, "model.h5", ["-accuracy", 1e-6])
    assert step["point/position"][1] == pytest.approx([0, 0, -19.80665], abs=1e-6)


def test_steps_of_an_extreme_are_one_path(solve, tmp_path):
    solve(ADVANCE, (JAW, "-15, 0]"), TWO)
    path = steps(tmp_path / "out.h5")
    assert all(a["load"] < b["load"] for a, b in zip(path, path[1:]))
    assert all(apart(a, b) < 15 for a, b in zip(path, path[1:]))


def chain(points, seed):
    """Springs without length, linear, from end to end along x: of stiffnesses over twelve orders of
    magnitude; forces on their joints; and where it comes to rest."""
    random = np.random.default_rng(seed)
    count = points - 1
    stiffness = 10**random.uniform(-6, 6, count)
    force = np.zeros((points, 3))
    force[1:-1, 0] = random.uniform(-3, 3, points - 2)
    position = np.zeros((points, 3))
    position[:, 0] = np.arange(points)
    sets = np.zeros(points, "i1")
    sets[[0, -1]] = 1
    below = np.concatenate([[0], np.cumsum(force[1:-1, 0])])
    tension = (count + (below / stiffness).sum()) / (1 / stiffness).sum() - below
    rest = np.zeros((points, 3))
    rest[1:, 0] = np.cumsum(tension / stiffness)
    return {
        "gravity": np.zeros(3), "point/position": position, "point/set": sets,
        "point/target": position, "point/layer": np.zeros(points, "i4"),
        "point/column": np.arange(points), "point/bone": np.full(points, -1, "i4"),
        "point/mass": np.zeros(points), "point/external_force": force,
        "spring/points": np.stack([np.arange(count), np.arange(1, points)], 1),
        "spring/set": np.zeros(count, "i4"), "spring/rest_length": np.zeros(count),
        "spring/stiffness": stiffness, "spring/exponent": np.zeros(count, "i1"),
        "spring/reference": np.ones(count), "spring_set": np.array([b"all"])}, rest


@pytest.mark.parametrize("points, seed", [(11, 1), (11, 3), (41, 1), (41, 2)])
@pytest.mark.parametrize("accuracy", [0.1, 1e-3])
def test_the_estimate_holds_where_stiffnesses_lie_far_apart(run, tmp_path, points, seed, accuracy):
    model, rest = chain(points, seed)
    write_model(tmp_path / "chain.h5", model)
    result = run("repose-solve", "chain.h5", "-volume", "none", "-accuracy", accuracy, "-output",
                 "out")
    step = last(tmp_path / "out.h5")
    assert result.returncode == (0 if step["converged"] else 2)
    error = np.linalg.norm(step["point/position"] - rest, axis=1).max()
    assert error <= step["displacement_error"] + 1e-7, (error, step["displacement_error"])
