"""Types of PETSc's objects: those of the table in docs/guide/solver.md end in the same rest position
on a solid and on springs; every other one that PETSc registers is refused before the solve."""

import re

import h5py
import numpy as np
import pytest

from conftest import PROJECT

ACCURACY = 1e-3  # mm
TISSUES = {
    "solid": "material: {preset: face}",
    "springs": "springs: {default: {stiffness: 1.0, law: quartic, reference: 1.0}}",
}
SCENE = """skin: {0}/paper_skin.ply
bones:
  - {{name: skull, file: {0}/paper_skull.ply}}
  - {{name: mandible, file: {0}/paper_mandible.ply}}
tissue:
  layers: 2
  {1}
moves:
  - {{bone: mandible, translate: [0, -2, 0]}}
"""


def table():
    """{option: allowed values} of the page."""
    page = (PROJECT / "docs/guide/solver.md").read_text()
    rows = re.findall(r"^\| `-(\S*_type)` \| ((?:`[^`]+`(?:, )?)+) \|", page, re.M)
    return {option: re.findall(r"`([^`]+)`", values) for option, values in rows}


def options(option, value):
    if option == "tao_ls_type":
        return "-tao_type", "bnls", "-tao_ls_type", value
    if option == "tao_*_ksp_type":
        return "-tao_type", "ntr", "-tao_ntr_ksp_type", value
    if option == "tao_*_mat_type":
        return "-tao_type", "lmvm", "-tao_lmvm_mat_type", value
    return f"-{option}", value


WORKING = [(option, value) for option, values in table().items() for value in values]


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    for tissue, text in TISSUES.items():
        (folder / f"{tissue}.yaml").write_text(SCENE.format(PROJECT / "meshes", text))
    return folder


def positions(file):
    with h5py.File(file) as opened:
        return opened["step"][sorted(opened["step"])[-1]]["point/position"][()]


@pytest.fixture(scope="module")
def expected():
    return {}


@pytest.mark.parametrize("option, value, ranks", [
    pytest.param(*case, ranks, marks=[] if k % 2 == 0 and ranks == 1 + k // 4 % 2 else pytest.mark.long)
    for k, case in enumerate(WORKING) for ranks in (1, 2)])
def test_a_type_of_the_table_works(run, scenes, tmp_path, expected, option, value, ranks):
    tissue = list(TISSUES)[(WORKING.index((option, value)) + ranks) % 2]  # the other on other ranks

    def solve(name, ranks, *more):
        result = run("repose-solve", scenes / f"{tissue}.yaml", "-accuracy", ACCURACY, "-output", name,
                     *more, ranks=ranks)
        if "missing package" in result.stderr:
            pytest.skip(f"this PETSc has no {value}")
        assert (result.returncode, result.stderr) == (0, ""), result
        return positions(tmp_path / f"{name}.h5")

    if tissue not in expected:
        expected[tissue] = solve("default", 1)
    apart = solve("other", ranks, *options(option, value)) - expected[tissue]
    rough = 2 if value == "preonly" else 1  # the estimate is the preconditioner's, nothing checks it
    assert np.linalg.norm(apart, axis=1).max() <= 2 * rough * ACCURACY


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("option, value", [
    ("tao_type", "nm"), ("tao_type", "pounders"), ("tao_type", "tron"), ("tao_type", "almm"),
    ("tao_type", "fast"), ("ksp_type", "gmres"), ("pc_type", "lmvm"), ("tao_*_ksp_type", "gltr"),
    ("tao_ls_type", "owarmijo"), ("tao_*_mat_type", "dense"), ("ksp_norm_type", "none")], ids=lambda word: word)
def test_any_other_type_is_refused(run, scenes, option, value, ranks):
    result = run("repose-solve", scenes / "springs.yaml", *options(option, value), ranks=ranks)
    assert (result.returncode, result.stdout) == (1, ""), result
    lines = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
    assert len(lines) == 1 and ", ".join(table()[option]) in lines[0], result.stderr


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("words", [
    ["-options_file", "missing"], ["-options_file"], ["-options_file", "."],
    ["-options_file_yaml", "missing"], ["-options_string_yaml", "x"], ["-device_enable", "x"],
    ["-log_view", ":/no/such/folder/log"], ["-log_view", "paper:log"],
    ["-ksp_view", "ascii:/no/such/folder/log"], ["-pc_renewal_price", "cheap"]], ids=" ".join)
def test_options_that_petsc_cannot_follow_are_refused(run, scenes, words, ranks):
    result = run("repose-solve", scenes / "springs.yaml", *words, ranks=ranks)
    assert result.returncode == 1, result
    assert result.stderr.startswith("error: "), result.stderr
    assert not any(text in result.stderr for text in ("PETSC ERROR", "unknown error")), result.stderr


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("words", [
    ["-ksp_pc_side", "right"], ["-ksp_diagonal_scale"], ["-ksp_converged_reason", "paper"],
    ["-tao_view", "ascii:log:paper"], ["-pc_type", "gamg", "-mg_levels_ksp_type", "fast"],
    ["-pc_type", "gamg", "-pc_mg_cycle_type", "z"], ["-pc_type", "hypre", "-pc_hypre_type", "ams"],
    ["-pc_type", "cholesky", "-pc_factor_mat_solver_type", "fast"],
    ["-stability", "-eps_tol", "-5"], ["-stability", "-st_pc_type", "fast"]], ids=" ".join)
def test_options_at_which_petsc_fails_during_the_solve_are_named(run, scenes, tmp_path, words, ranks):
    result = run("repose-solve", scenes / "springs.yaml", *words, ranks=ranks)
    assert result.returncode == 1, result
    lines = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
    named = " ".join(words[-2:]), f"viewer {words[-1]} "  # by PETSc 3.18 and 3.22
    assert len(lines) == 1 and any(name in lines[0] for name in named), result.stderr
    assert not list(tmp_path.glob("springs*"))


@pytest.mark.parametrize("words", [
    ["-log_view"], ["-log_view", ":log.txt"], ["-options_left"], ["-options_view"],
    ["-malloc_debug", "-malloc_dump", "-malloc_view"], ["-malloc_test"], ["-memory_view"],
    ["-objects_dump"], ["-tao_view"], ["-fp_trap"]], ids=" ".join)
def test_ordinary_options_of_petsc_do_no_harm(run, scenes, words):
    result = run("repose-solve", scenes / "solid.yaml", *words)
    assert (result.returncode, result.stderr) == (0, ""), result


@pytest.mark.quick
def test_a_search_that_an_option_stops_short_names_it(run):
    result = run("repose-solve", PROJECT / "meshes/head_springs_advance.yaml", "-ksp_max_it", 1)
    assert result.returncode == 2 and "). Leave out -ksp_max_it 1 first" in result.stdout, result
