"""Only the tissue that feels a move is searched, and what that costs in accuracy is said."""

import re

import numpy as np
import pytest

from conftest import PROJECT
from tissue import apart, last, model_of, steps

CHIN = "head_springs_genioplasty.yaml"


def number(text, name):
    return float(re.search(name + r"\s+([\d.e+-]+)", text).group(1))


@pytest.mark.parametrize("accuracy", ["0.5", "0.1"])
def test_the_answer_is_as_near_as_it_says(solved, accuracy):
    path = ["-load_steps", 3]
    exact = solved(CHIN, *path, "-accuracy", "1e-5", "-active_region", "off")
    file = solved(CHIN, *path, "-accuracy", accuracy, "-active_region", "on")
    assert 0 < apart(last(file), last(exact)) <= last(file)["displacement_error"] <= float(accuracy)
    assert len(steps(file)) > 2
    for step, truth in zip(steps(file), steps(exact)):
        assert step["load"] == truth["load"]
        assert apart(step, truth) <= step["displacement_error"] + truth["displacement_error"]


def test_what_is_left_out_stays_and_is_held(solved, run):
    file = solved(CHIN, "-accuracy", "0.5", "-active_region", "on")
    model, found = model_of(file), last(file)
    still = (model["point/set"] == 0) & (found["point/displacement"] == 0).all(axis=1)
    assert 0.1 < still.mean() < 0.9
    force = np.linalg.norm(found["point/residual_force"][still], axis=1)
    border = force > 0
    assert 0 < border.mean() < 0.5
    assert force.max() > 0.1 * found["gradient_max"]
    assert run("repose-check", file).returncode == 0


def test_fewer_unknowns(run):
    counts = {}
    for choice in ("on", "off"):
        said = run("repose-solve", PROJECT / "meshes" / CHIN, "-accuracy", "0.5",
                   "-active_region", choice)
        assert (said.returncode, said.stderr) == (0, "")
        counts[choice] = number(said.stdout, "unknowns")
        assert ("active region" in said.stdout) == (choice == "on")
    assert counts["on"] < 0.6 * counts["off"]


def test_same_on_any_number_of_ranks(solved):
    options = [CHIN, "-accuracy", "0.01", "-active_region", "on"]
    one, three = last(solved(*options)), last(solved(*options, ranks=3))
    assert apart(one, three) <= one["displacement_error"] + three["displacement_error"]
    assert one["objective"] == pytest.approx(three["objective"], rel=1e-6)
    assert ((one["point/displacement"] == 0) == (three["point/displacement"] == 0)).all()


@pytest.mark.parametrize("options, word", [
    (["-functional", "force", "-volume", "none"], "functional is force"),
    (["-volume", "exact"], "volume term is exact"),
    (["-stability"], "stability"),
])
def test_refused_where_it_cannot_be(run, options, word):
    said = run("repose-solve", PROJECT / "meshes" / CHIN, "-active_region", "on", *options)
    assert said.returncode == 1
    assert said.stderr.count("\n") == 1
    assert "-active_region on" in said.stderr and word in said.stderr


def test_refused_in_a_restart(solved, run):
    file = solved(CHIN, "-accuracy", "0.5", "-active_region", "on")
    options = [PROJECT / "meshes" / CHIN, "-restart", file, "-output", "again"]
    said = run("repose-solve", *options, "-active_region", "on")
    assert said.returncode == 1 and "-active_region on" in said.stderr
    said = run("repose-solve", *options, "-accuracy", "0.5")
    assert (said.returncode, said.stderr) == (0, ""), said
