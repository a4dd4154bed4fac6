"""The force functional and exact volume: where they must meet the energy and the penalty, what the
result says of them, and what is refused."""

import shutil

import h5py
import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, eigsh

from conftest import PROJECT
from tissue import Tissue, apart, last, model_of, prism_volumes, steps, write_model

ADVANCE, OPENING = "paper_jaw_advance.yaml", "paper_jaw_opening.yaml"
SMALL = {ADVANCE: ("[0, -6, 0]", "[0, -1, 0]"), OPENING: ("angle: 8", "angle: 1")}
# tissue.release reaches as far as where bones move by 4 mm and more
RELEASED = ("  layers: 4 ", "  release: 40\n  layers: 4 ")
VOLUME_TOLERANCE = 1e-6  # of |v/v0 - 1| with volume exact


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """small(scene, weight) → the scene with a move so small that its rest position is unique, and
    with weight or without."""
    folder = tmp_path_factory.mktemp("small")

    def write(scene, weight):
        text = (PROJECT / "meshes" / scene).read_text().replace(*SMALL[scene])
        text = text.replace(*RELEASED)
        text = text.replace(": paper_", f": {PROJECT}/meshes/paper_")
        if weight:
            text = text.replace("  layers: 4 ", "  density: 1.0e-6   # kg/mm³\n  layers: 4 ")
            text += "gravity: [0, 0, -9.80665]\n"
        file = folder / f"{'heavy' if weight else 'light'}_{scene}"
        file.write_text(text)
        return file

    return write


@pytest.mark.parametrize("scene", [ADVANCE, OPENING])
@pytest.mark.parametrize("weight", [True, False], ids=["weight", "no weight"])
def test_force_and_energy_meet(solved, small, scene, weight):
    accuracy = 1e-7
    options = ["-volume", "none", "-accuracy", accuracy]
    energy = solved(small(scene, weight), *options)
    force = solved(small(scene, weight), *options, "-functional", "force")
    assert apart(last(energy), last(force)) <= 2 * accuracy
    assert last(force)["functional"] == b"force"
    assert last(force)["f_f"] < 1e-6 * np.abs(last(force)["spring/tension"]).max()
    assert np.linalg.norm(last(force)["point/displacement"], axis=1).max() > 0.9


def test_force_and_energy_meet_after_the_whole_move_of_the_finer_head(solved, tmp_path):
    """With weight and without volume term; the opening has many minima there, the advance one."""
    text = (PROJECT / "meshes/head_springs_advance.yaml").read_text()
    text = text.replace(": head_", f": {PROJECT}/meshes/head_")
    text = text.replace("  layers: 4 ", "  density: 1.0e-6\n  layers: 4 ")
    scene = tmp_path / "advance.yaml"
    scene.write_text(text + "gravity: [0, 0, -9.80665]\n")
    accuracy = 1e-4
    energy, force = (solved(scene, "-volume", "none", "-accuracy", accuracy, "-functional", which)
                     for which in ("energy", "force"))
    assert apart(last(energy), last(force)) <= 2 * accuracy
    assert np.linalg.norm(last(force)["point/displacement"], axis=1).max() > 5.9


@pytest.mark.parametrize("ranks", [1, 2])
def test_check_agrees_with_the_force_functional(run, solved, small, ranks):
    file = solved(small(ADVANCE, True), "-volume", "none", "-functional", "force", ranks=ranks)
    result = run("repose-check", file)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("tao", ["lmvm", "cg", "nls"])
def test_force_by_other_methods_is_right_or_says_it_is_not(run, solved, small, tmp_path, tao):
    accuracy = 1e-3
    scene, options = small(ADVANCE, True), ["-volume", "none", "-accuracy", accuracy]
    rest = last(solved(scene, "-volume", "none", "-accuracy", 1e-6))
    result = run("repose-solve", scene, *options, "-functional", "force", "-tao_type", tao,
                 "-output", "other")
    step = last(tmp_path / "other.h5")
    if result.returncode == 0:
        assert step["converged"] == 1 and step["load"] == 1
        assert apart(step, rest) <= step["displacement_error"] + 1e-6 <= accuracy + 1e-6
    else:
        assert result.returncode == 2 and step["converged"] == 0
        assert "NOT CONVERGED" in result.stdout and step["reason"].decode()


def test_first_order_force_that_runs_out_of_steps_says_so(run, tmp_path):
    result = run("repose-solve", PROJECT / "meshes" / ADVANCE, "-volume", "none",
                 "-functional", "force", "-tao_type", "lmvm", "-tao_max_it", 3, "-accuracy", 1e-6, "-output", "short")
    assert result.returncode == 2 and "NOT CONVERGED" in result.stdout
    assert last(tmp_path / "short.h5")["converged"] == 0


@pytest.mark.parametrize("volume", ["penalty", "exact"])
def test_force_takes_neither_penalty_nor_constraint(run, tmp_path, volume):
    result = run("repose-solve", PROJECT / "meshes" / ADVANCE, "-functional", "force",
                 "-volume", volume)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1 and f"not {volume}" in result.stderr
    assert not list(tmp_path.glob("*.h5*"))


@pytest.fixture(scope="module")
def exact(solved):
    """The jaw advance with exact volume."""
    return solved(ADVANCE, "-volume", "exact")


def test_exact_volume_keeps_every_prism(exact):
    step, model = last(exact), model_of(exact)
    prisms = model["prism/points"]
    within = (model["point/set"] == 0)[prisms].any(1)
    ratio = prism_volumes(step["point/position"], prisms)[0] / model["prism/rest_volume"]
    assert np.abs(ratio[within] - 1).max() <= VOLUME_TOLERANCE
    assert step["volume_error_max"] <= VOLUME_TOLERANCE and step["volume"] == b"exact"


def test_exact_volume_ends_where_a_path_of_smaller_steps_does(solved, exact):
    """A step that was refused leaves nothing behind that leads the next ones astray."""
    slowly = last(solved(ADVANCE, "-volume", "exact", "-load_steps", 12))
    assert apart(last(exact), slowly) <= last(exact)["displacement_error"] + 0.01


def test_pressures_balance_the_springs(exact):
    step, model = last(exact), model_of(exact)
    force = step["point/residual_force"].copy()
    slopes = prism_volumes(step["point/position"], model["prism/points"])[1]
    np.add.at(force, model["prism/points"], step["prism/pressure"][:, None, None] * slopes)
    soft = model["point/set"] == 0
    left = np.linalg.norm(force[soft], axis=1).max()
    largest = np.linalg.norm(step["point/residual_force"], axis=1).max()
    assert largest > 100
    assert left < 1e-8 * largest and step["gradient_max"] < 1e-8 * largest


def test_check_knows_pressures(run, exact, tmp_path):
    assert run("repose-check", exact).returncode == 0
    with h5py.File(shutil.copy(exact, tmp_path / "tampered.h5"), "r+") as h5:
        pressure = h5["step"][max(h5["step"])]["prism/pressure"]
        values = pressure[()]
        row = np.abs(values).argmax()
        values[row] *= 1 + 1e-6
        pressure[...] = values
    result = run("repose-check", tmp_path / "tampered.h5")
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1 and "gradient_max" in result.stderr


def test_stiffer_penalties_tend_to_exact_volume(solved, small):
    """Positions and volumes do as 1/κ, the pressures of a nearly locked mesh more slowly."""
    scene = small(ADVANCE, False)
    exact = last(solved(scene, "-volume", "exact", "-accuracy", 1e-5))
    errors = []
    for kappa in (1e4, 1e5, 1e6):
        step = last(solved(scene, "-bulk_modulus", kappa, "-accuracy", 1e-6))
        pressure = kappa * (1 - step["prism/volume_ratio"])
        off = np.linalg.norm(pressure - exact["prism/pressure"])
        errors.append((apart(step, exact), step["volume_error_max"],
                       off / np.linalg.norm(exact["prism/pressure"])))
    for before, after in zip(errors, errors[1:]):
        assert after[0] < 0.3 * before[0] and after[1] < 0.3 * before[1], errors
        assert after[2] < 0.7 * before[2], errors


def closed_box(file):
    """One free point within held ones, whose lid comes down: the volume has nowhere to go."""
    grid = [(i, j, a) for i in range(3) for j in range(3) for a in range(3)]
    row = {place: n for n, place in enumerate(grid)}
    x = np.array([(5.0 * i, 5.0 * j, -4.0 * a) for i, j, a in grid])
    centre = row[1, 1, 1]
    springs = np.array([(centre, p) for p in range(27) if p != centre])
    prisms = np.array([[row[k, m, a] for k, m in t] + [row[k, m, a + 1] for k, m in t]
                       for i in range(2) for j in range(2) for a in range(2)
                       for t in ([(i, j), (i, j + 1), (i + 1, j)],
                                 [(i + 1, j), (i, j + 1), (i + 1, j + 1)])])
    sets = np.full(27, 3, dtype="i1")
    sets[centre] = 0
    return write_model(file, {
        "gravity": np.zeros(3), "point/position": x, "point/set": sets,
        "point/target": np.where((sets == 3)[:, None], x * (1, 1, 0.9), x),
        "point/layer": np.array([a for _, _, a in grid], dtype="i4"),
        "point/column": np.array([3 * i + j for i, j, _ in grid]),
        "point/bone": np.full(27, -1, dtype="i4"),
        "spring/points": springs, "spring/set": np.zeros(26, dtype="i4"),
        "spring/rest_length": np.linalg.norm(x[springs[:, 1]] - x[centre], axis=1),
        "spring/stiffness": np.ones(26), "spring/exponent": np.full(26, 2, dtype="i1"),
        "spring/reference": np.ones(26), "spring_set": np.array([b"all"]),
        "prism/points": prisms, "prism/rest_volume": prism_volumes(x, prisms)[0]})


def test_a_squeeze_without_room_ends_in_words(run, tmp_path):
    result = run("repose-solve", closed_box(tmp_path / "box.h5"), "-volume", "exact",
                 "-output", "squeezed")
    assert result.returncode == 2, result
    assert "NOT CONVERGED" in result.stdout and "volume cannot be kept" in result.stdout
    step = last(tmp_path / "squeezed.h5")
    assert step["converged"] == 0 and b"volume cannot be kept" in step["reason"]


def test_stability_is_reported_when_asked_for(run, small, tmp_path):
    """At the start (an initial equilibrium) and at the end, where scipy finds the same."""
    scene, options = small(ADVANCE, True), ["-volume", "none", "-output", "steady"]
    result = run("repose-solve", scene, *options, "-stability")
    assert result.returncode == 0 and result.stderr == ""
    first, final = steps(tmp_path / "steady.h5")[::len(steps(tmp_path / "steady.h5")) - 1]
    for row, step in (("at the start", first), ("where it ended", final)):
        condition = step["largest_eigenvalue"] / step["smallest_eigenvalue"]
        assert f"{row:<22} stable: smallest eigenvalue {step['smallest_eigenvalue']:.4g} N/mm, " \
            f"condition number {condition:.2g}" in result.stdout
    tissue = Tissue(model_of(tmp_path / "steady.h5"), "none", 0)
    assert final["smallest_eigenvalue"] == pytest.approx(eigenvalue(tissue, final, "SA"), rel=1e-5)
    assert final["largest_eigenvalue"] == pytest.approx(eigenvalue(tissue, final, "LA"), rel=0.01)
    mode, value = final["point/stability_mode"][tissue.soft], final["smallest_eigenvalue"]
    assert np.linalg.norm(mode, axis=1).max() == pytest.approx(1)
    assert hessian(tissue, final) @ mode.ravel() == pytest.approx(value * mode.ravel(), abs=1e-5 * value)
    assert not final["point/stability_mode"][~tissue.soft].any()
    assert run("repose-check", "steady.h5").returncode == 0
    run("repose-solve", scene, *options)
    assert all("smallest_eigenvalue" not in step for step in steps(tmp_path / "steady.h5"))


def eigenvalue(tissue, step, which):
    """The smallest or largest by scipy."""
    return eigsh(hessian(tissue, step), k=1, which=which, tol=1e-7, return_eigenvectors=False)[0]


def hessian(tissue, step):
    """From difference quotients of numpy's gradient."""
    soft, x = tissue.soft, step["point/position"]

    def product(way):
        d = np.zeros_like(x)
        d[soft] = way.reshape(-1, 3)
        h = 1e-4 / np.abs(d).max()
        there, back = (tissue.value_and_gradient(x + sign * h * d)[1] for sign in (1, -1))
        return ((there - back) / (2 * h))[soft].ravel()

    size = 3 * soft.sum()
    return LinearOperator((size, size), product, dtype=float)
