"""Tearing by force: what goes, where it stops, and that the result is a model like any other."""

import re

import numpy as np
import pytest

from conftest import PROJECT
from tissue import apart, last, model_of, same_face

FORCES = "forces:\n  - {at: [47, -80, 8], radius: 8, force: [0, -3, 0]}\n"
SCENE = (PROJECT / "meshes/paper_jaw_advance.yaml").read_text().partition("moves:")[0].replace(
    "{stiffness: 1.0,", "{modulus: 0.05,") + FORCES + "solve:\n  volume: {form: penalty}\n"
LIMIT = 0.5


def solve(run, folder, name, limit=None, *options, ranks=1, status=0):
    tearing = "" if limit is None else f"tearing: {{limit: {limit}}}\n"
    (folder / f"{name}.yaml").write_text(SCENE + tearing)
    result = run("repose-solve", f"{name}.yaml", "-accuracy", 1e-6, *options, ranks=ranks,
                 cwd=folder)
    assert result.returncode == status, result
    return result


def springs(model):
    return {tuple(sorted(pair)) for pair in model["spring/points"].tolist()}


def edges(cells, sides):
    """The sides of each cell, as sets of pairs of points."""
    return [{tuple(sorted((cell[i], cell[j]))) for i, j in sides} for cell in cells.tolist()]


PRISM = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]


@pytest.mark.quick
def test_what_is_torn_goes_with_its_prisms_and_skin(run, folder):
    solve(run, folder, "whole")
    printed = solve(run, folder, "torn", LIMIT).stdout
    whole, torn = model_of(folder / "whole.h5"), model_of(folder / "torn.h5")
    gone = springs(whole) - springs(torn)
    assert gone and springs(torn) < springs(whole)
    found = re.search(r"springs (\d+), with them prisms (\d+) and triangles of the skin (\d+);",
                      printed)
    counts = [len(whole[name]) - len(torn[name])
              for name in ("spring/points", "prism/points", "skin/points")]
    assert [int(found[i]) for i in (1, 2, 3)] == counts
    for name, sides in (("prism/points", PRISM), ("skin/points", [(0, 1), (1, 2), (2, 0)])):
        hit = [bool(cell & gone) for cell in edges(whole[name], sides)]
        assert (torn[name] == whole[name][~np.array(hit)]).all()
    loaded = np.linalg.norm(torn["point/external_force"], axis=1) > 0
    loaded[list({i for pair in gone for i in pair})] = True
    eligible = loaded[torn["spring/points"]].any(axis=1)
    assert last(folder / "torn.h5")["spring/tension"][eligible].max() <= LIMIT


def test_the_result_is_a_model_and_the_same_on_two_ranks(run, folder):
    solve(run, folder, "one", LIMIT)
    solve(run, folder, "two", LIMIT, ranks=2)
    one, two = folder / "one.h5", folder / "two.h5"
    assert (model_of(one)["spring/points"] == model_of(two)["spring/points"]).all()
    same_face(one, two, 1e-5)
    assert run("repose-check", one).returncode == 0
    again = run("repose-solve", one, "-accuracy", 1e-6, "-output", "again", "-bulk_modulus",
                last(one)["bulk_modulus"], cwd=folder)
    assert (again.returncode, again.stderr) == (0, ""), again
    assert apart(last(one), last(folder / "again.h5")) < 1e-5


def test_a_limit_above_everything_changes_nothing(run, folder):
    solve(run, folder, "whole")
    assert re.search(r"torn +nothing", solve(run, folder, "high", 1000).stdout)
    whole, high = folder / "whole.h5", folder / "high.h5"
    assert (model_of(high)["spring/points"] == model_of(whole)["spring/points"]).all()
    assert apart(last(high), last(whole)) == 0


def test_a_limit_that_tears_tissue_off_is_refused_in_one_line(run, folder):
    result = solve(run, folder, "low", 0.001, status=1)
    assert result.stderr.count("\n") == 1 and "is torn off" in result.stderr, result.stderr
    assert not list(folder.glob("low*.h5*"))


def test_an_end_before_its_time_is_said_loudly(run, folder):
    result = solve(run, folder, "early", LIMIT, "-time_limit", 0, status=2)
    assert "NOT SETTLED" in result.stdout
    assert run("repose-check", "early.h5", cwd=folder).returncode == 0


@pytest.mark.parametrize("scene, message", [
    (SCENE + "tearing: {limit: 0}\n", "tearing.limit"),
    (SCENE + "tearing: {}\n", "limit"),
    (SCENE + "tearing: {limt: 1}\n", "limit"),
    (SCENE.replace(FORCES, "") + "tearing: {limit: 1}\n", "needs forces"),
    (SCENE + "tearing: {limit: 1}\ninstruments:\n"
     "  - {sphere: {center: [63, -98, -10], radius: 20}, push: [-9, 12, 0], skin: slide}\n",
     "exclude each other"),
], ids=["zero", "empty", "misspelled", "no forces", "sliding"])
def test_bad_lines_are_refused(run, folder, scene, message):
    (folder / "bad.yaml").write_text(scene)
    result = run("repose-solve", "bad.yaml", cwd=folder)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result.stderr
    assert message in result.stderr and "bad.yaml:" in result.stderr
    assert not list(folder.glob("bad*.h5*"))
