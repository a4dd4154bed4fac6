"""The number of ranks changes neither the model nor the rest position."""

import re

import numpy as np
import pytest

from conftest import PROJECT, RUNS_ALL, shipped
from heads import read_vtp
from tissue import apart, last, model_of, steps

LOADED = """
gravity: [0, 0, -9.80665]
forces:
  - {at: [0, -90, 0], radius: 30, force: [0, 0, -0.5]}
"""


def check_same(one, many):
    """Models equal in every byte but for rest lengths, which a solve over the ranks balances; rest
    positions as near as both are to the one rest position (1e-9 mm), so that the objective, which is
    stationary there, is equal to rounding. A long load step may be refused here and taken there."""
    model, other = model_of(one), model_of(many)
    assert model.keys() == other.keys()
    different = [name for name in model if model[name].tobytes() != other[name].tobytes()]
    assert different in ([], ["spring/rest_length"])
    assert np.abs(model["spring/rest_length"] - other["spring/rest_length"]).max() < 1e-11
    rounding = 1e-12 * abs(last(one)["objective"])
    mine, theirs = ({step["load"]: step for step in steps(file)} for file in (one, many))
    common = sorted(mine.keys() & theirs.keys())
    assert common[0] == 0 and common[-1] == 1
    for here, there in ((mine[load], theirs[load]) for load in common):
        assert apart(here, there) < 1e-8
        assert here["objective"] == pytest.approx(there["objective"], rel=1e-12)
        for name in ("f_e", "f_v", "penalty", "potential"):
            assert here[name] == pytest.approx(there[name], rel=1e-10, abs=rounding)
        for name in ("volume", "lambda", "bulk_modulus", "inverted_prisms", "converged"):
            assert here[name] == there[name]
        for name, scale in (("spring/tension", "spring/tension"), ("spring/elongation",) * 2,
                            ("point/residual_force", "spring/tension"),
                            ("prism/volume_ratio",) * 2, ("point/displacement",) * 2):
            difference = np.abs(here[name] - there[name]).max()
            assert difference <= 1e-6 * max(1, np.abs(here[scale]).max())


@pytest.mark.quick
@pytest.mark.parametrize("ranks", [2, *(pytest.param(ranks, marks=pytest.mark.long) for ranks in (3, 5))])
def test_same_face_on_any_number_of_ranks(solved, ranks):
    options = ["paper_jaw_advance.yaml", "-accuracy", "1e-9"]
    check_same(solved(*options), solved(*options, ranks=ranks))


def test_same_face_of_a_turned_jaw(solved):
    options = ["paper_jaw_opening.yaml", "-accuracy", "1e-9"]
    check_same(solved(*options), solved(*options, ranks=3))


@pytest.mark.parametrize("scene, ranks", [
    pytest.param(scene, ranks, marks=[] if ranks == quick else pytest.mark.long)
    for scene, quick in (("head_solid.yaml", 3), ("head_le_fort.yaml", 2), ("head_instrument.yaml", 3))
    for ranks in (2, 3, 5)])
def test_ranks_make_the_parts_of_a_solid_that_one_rank_builds(solved, scene, ranks):
    one, many = solved(scene), solved(scene, ranks=ranks)
    model, other = model_of(one), model_of(many)
    assert model.keys() == other.keys()
    assert [name for name in model if model[name].tobytes() != other[name].tobytes()] == []
    assert apart(last(one), last(many)) < 0.1  # the accuracy


def test_ranks_that_made_their_parts_measure_instruments_and_verify_the_path(run, tmp_path):
    (tmp_path / "coarse.yaml").write_text(shipped("head_instrument.yaml", edge=7))
    rows = []
    for ranks in (1, 3):
        result = run("repose-solve", "coarse.yaml", "-verify_path", ranks=ranks)
        assert (result.returncode, result.stderr) == (0, ""), result
        assert ("by 3 ranks, each its part" in result.stdout) == (ranks == 3)
        assert "verified: in " in result.stdout
        rows.append(next(row for row in result.stdout.splitlines() if "instrument 0 " in row))
    forces = [[float(x) for x in re.findall(r"[-\d.e]+(?=[,)])", row)] for row in rows]
    assert len(forces[0]) == 3 and max(map(abs, forces[0])) > 0.1
    assert forces[0] == pytest.approx(forces[1], abs=0.01)  # N


@pytest.mark.long
def test_a_skin_that_was_solved_in_place_of_the_given_one(run, tmp_path):
    (tmp_path / "solid.yaml").write_text(shipped("head_solid.yaml", edge=8))
    found = []
    for ranks in (1, 2):
        result = run("repose-solve", "solid.yaml", "-output", f"on{ranks}", ranks=ranks)
        assert (result.returncode, result.stderr) == (0, ""), result
        assert ("by 2 ranks, each its part" in result.stdout) == (ranks == 2)
        found.append(read_vtp(tmp_path / f"on{ranks}_given_skin.vtp")["displacement"])
        again = run("repose-solve", "solid.yaml", "-restart", f"on{ranks}.h5", "-output", "copy",
                    ranks=ranks)
        assert again.returncode == 0 and "nothing is left to do" in again.stdout
        copy = read_vtp(tmp_path / "copy_given_skin.vtp")["displacement"]
        assert np.array_equal(copy, found[-1])
    assert np.abs(found[0]).max() > 1
    assert np.abs(found[0] - found[1]).max() < 0.1


# On the cheek: the mouth of this head is open, and remeshing keeps it so.
LIPS = "mouth: {path: [[45, -67, -31], [45, -75, -14], [45, -81, 1]]}\n"


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_a_remeshed_skin_with_parted_lips_ends_on_any_ranks(run, tmp_path, ranks):
    (tmp_path / "lips.yaml").write_text(shipped("head_jaw_opening.yaml", edge=8) + LIPS)
    result = run("repose-solve", "lips.yaml", ranks=ranks)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "parted lips            along" in result.stdout
    assert (f"by {ranks} ranks, each its part" in result.stdout) == (ranks > 1)


CHEEK = "incisions:\n  - {path: [[-45, -67, -31], [-45, -75, -14], [-45, -81, 1]], layers: 2}\n"


def test_ranks_make_the_parts_of_a_solid_with_cuts(run, tmp_path):
    (tmp_path / "cuts.yaml").write_text(shipped("head_jaw_opening.yaml", layers=3, edge=8) + LIPS + CHEEK)
    models, rests = [], []
    for ranks in (1, 2, 3, 5) if RUNS_ALL else (1, 3, 5):
        result = run("repose-solve", "cuts.yaml", "-output", f"on{ranks}", ranks=ranks)
        assert (result.returncode, result.stderr) == (0, ""), result
        assert all(result.stdout.count(f"{row:23}along") == 1 for row in ("incision", "parted lips"))
        assert (f"by {ranks} ranks, each its part" in result.stdout) == (ranks > 1)
        models.append(model_of(tmp_path / f"on{ranks}.h5"))
        rests.append(last(tmp_path / f"on{ranks}.h5"))
    assert len(models[0]["contact/wall/net"]) == 4  # two a cut
    for model, rest in zip(models, rests):
        assert model.keys() == models[0].keys()
        assert [name for name in model if model[name].tobytes() != models[0][name].tobytes()] == []
        assert apart(rest, rests[0]) < 0.1  # the accuracy


def test_ranks_make_the_parts_of_a_solid_whose_tension_opens_a_cut(solved):
    one = solved("head_incision.yaml")
    model, rest = model_of(one), last(one)
    for ranks in (2, 3) if RUNS_ALL else (3,):
        many = solved("head_incision.yaml", ranks=ranks)
        other = model_of(many)
        assert model.keys() == other.keys()
        for name in model:  # each number of ranks finds its initial equilibrium
            if model[name].dtype.kind == "f":
                assert np.allclose(model[name], other[name], rtol=1e-9, atol=1e-9), name
            else:
                assert (model[name] == other[name]).all(), name
        assert apart(rest, last(many)) < 0.1  # the accuracy


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_only_rank_0_knows_is_refused_on_all_ranks(run, tmp_path, ranks):
    text = (PROJECT / "meshes/paper_jaw_advance.yaml").read_text()
    text = text.replace(": paper_", f": {PROJECT}/meshes/paper_")
    forces = LOADED.partition("forces:")[1:]
    tears = [text.partition("moves:")[0], "tearing: {limit: 0.5}\n", *forces]
    (tmp_path / "tears.yaml").write_text("".join(tears))
    result = run("repose-solve", "tears.yaml", "-verify_path", ranks=ranks)
    assert result.returncode == 1
    assert "error: -verify_path: the tissue may tear; leave the option out" in result.stderr


@pytest.mark.quick
def test_each_rank_builds_its_part_of_springs(run):
    result = run("repose-solve", PROJECT / "meshes/head_springs_advance.yaml", "-dry_run", ranks=2)
    assert result.returncode == 0, result
    assert "by 2 ranks, each its part\n" in result.stdout


@pytest.mark.parametrize("volume", ["none", "paper"])
def test_same_face_with_weight_turgor_and_forces(solved, tmp_path, volume):
    text = (PROJECT / "meshes/paper_jaw_advance.yaml").read_text()
    text = text.replace(": paper_", f": {PROJECT}/meshes/paper_").replace("-6, 0]", "-3, 0]")
    text = text.replace("  layers: 4", "  layers: 4\n  turgor: 0.03\n  mass: [.1, .1, .1, .1]", 1)
    scene = tmp_path / "loaded.yaml"
    scene.write_text(text + LOADED)
    weight = ["-lambda", "0.9"] if volume == "paper" else []
    options = [scene, "-accuracy", "1e-9", "-volume", volume, *weight]
    check_same(solved(*options), solved(*options, ranks=3))
    assert last(solved(*options))["potential"] != 0


@pytest.mark.parametrize("ranks", [2, *(pytest.param(ranks, marks=pytest.mark.long) for ranks in (3, 5))])
def test_a_run_on_ranks_repeats_bit_by_bit(run, tmp_path, ranks):
    (tmp_path / "coarse.yaml").write_text(shipped("head_jaw_advance.yaml", layers=3, edge=8))
    positions = set()
    for _ in range(3):
        result = run("repose-solve", "coarse.yaml", "-accuracy", 1, "-output", "again", ranks=ranks)
        assert (result.returncode, result.stderr) == (0, ""), result
        positions.add(last(tmp_path / "again.h5")["point/position"].tobytes())
    assert len(positions) == 1
