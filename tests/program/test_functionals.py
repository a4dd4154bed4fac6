"""The force functional: where it must meet the energy, what the result holds, and what is refused."""

import re

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, eigsh

from conftest import PROJECT, shipped
from heads import box, write
from tissue import Tissue, apart, last, model_of, steps

ADVANCE, OPENING = "paper_jaw_advance.yaml", "paper_jaw_opening.yaml"
SMALL = {ADVANCE: ("[0, -6, 0]", "[0, -1, 0]"), OPENING: ("angle: 8", "angle: 1")}
# tissue.release reaches as far as where bones move by 4 mm and more
RELEASED = ("  layers: 4 ", "  release: 40\n  layers: 4 ")


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


@pytest.mark.long
def test_force_and_energy_meet_after_the_whole_move_of_the_finer_head(solved, tmp_path):
    """With weight and without volume term; the opening has many minima there, the advance one."""
    text = shipped("head_springs_advance.yaml").replace("  layers: 4 ", "  density: 1.0e-6\n  layers: 4 ")
    scene = tmp_path / "advance.yaml"
    scene.write_text(text + "gravity: [0, 0, -9.80665]\n")
    accuracy = 1e-4
    energy, force = (solved(scene, "-volume", "none", "-accuracy", accuracy, "-functional", which)
                     for which in ("energy", "force"))
    assert apart(last(energy), last(force)) <= 2 * accuracy
    assert np.linalg.norm(last(force)["point/displacement"], axis=1).max() > 5.9


@pytest.mark.quick
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


def test_an_accuracy_finer_than_rounding_allows_is_named_with_one_that_is_reached(run, tmp_path):
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(-12, 12, 5), np.linspace(-9, 9, 4)))
    corner = np.arange(20, dtype=np.int32).reshape(4, 5)[:-1, :-1].ravel()
    write(tmp_path / "skin.ply", np.column_stack([x, y, 8 + 0.02 * x**2 + 0.3 * np.sin(y)]),
          np.concatenate([np.column_stack([corner, corner + 1, corner + 6]),
                          np.column_stack([corner, corner + 6, corner + 5])]))
    below = box((-40.0, -35.0, -12.0), (40.0, 35.0, 0.0)).reshape(-1, 3)
    write(tmp_path / "bone.ply", below, np.arange(36, dtype=np.int32).reshape(-1, 3))
    (tmp_path / "sheet.yaml").write_text("""skin: skin.ply
bones: [{name: base, file: bone.ply}]
tissue:
  layers: 3
  edge: given
  attach_within: 200
  springs: {default: {stiffness: 0.5, law: quartic, reference: 1.0}}
boundary: {rim: free}
forces: [{at: [3, 2, 8], radius: 8, force: [0.4, 0.3, -0.05]}]
moves: [{bone: base, translate: [1.5, 0.2, 1.0]}]
solve: {functional: force, volume: {form: paper}}
""")
    solve = lambda accuracy: run("repose-solve", "sheet.yaml", "-accuracy", accuracy)
    result = solve(1e-6)
    assert result.returncode == 2 and "more -load_steps" not in result.stdout, result
    looser = re.search(r"than the estimate of this functional reaches: try -accuracy (\S+) or larger",
                       result.stdout)
    fine = last(tmp_path / "sheet.h5")
    assert looser and fine["displacement_error"] < float(looser[1]) < 1e-2, result
    assert solve(looser[1]).returncode == 0


def test_force_takes_no_penalty(run, tmp_path):
    result = run("repose-solve", PROJECT / "meshes" / ADVANCE, "-functional", "force",
                 "-volume", "penalty")
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1 and "not penalty" in result.stderr
    assert not list(tmp_path.glob("*.h5*"))


@pytest.mark.quick
def test_the_removed_volume_term_names_its_replacement(run, tmp_path):
    scene = tmp_path / "old.yaml"
    text = (PROJECT / "meshes" / ADVANCE).read_text().replace(": paper_", f": {PROJECT}/meshes/paper_")
    scene.write_text(text.replace("form: penalty", "form: exact"))
    for place, *options in ((PROJECT / "meshes" / ADVANCE, "-volume", "exact"), (scene,)):
        result = run("repose-solve", place, *options)
        assert result.returncode == 1 and len(result.stderr.splitlines()) == 1, result
        assert "no longer takes exact" in result.stderr and "poisson: 0.499" in result.stderr


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
