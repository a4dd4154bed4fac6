"""The rest position does not depend on how many parts the bones' motion is made in."""

import re

import numpy as np
import pytest

from conftest import PROJECT
from tissue import apart, last, same_face, steps


def check(solved, scene, accuracy, factors, ranks=1):
    """Automatic load steps and `factors` times as many end in one rest position, without a fold."""
    automatic = solved(scene, "-accuracy", accuracy, ranks=ranks)
    first = steps(automatic)[1]["load"]
    for factor in factors:
        more = solved(scene, "-accuracy", accuracy, "-load_steps", factor * round(1 / first),
                      ranks=ranks)
        assert steps(more)[1]["load"] == pytest.approx(first / factor)
        assert len(steps(more)) > factor / first
        assert last(automatic)["inverted_prisms"] == last(more)["inverted_prisms"] == 0
        same_face(automatic, more, 2 * accuracy)


@pytest.mark.parametrize("scene", ["paper_jaw_advance.yaml", "paper_jaw_opening.yaml"])
def test_twice_as_many_steps(solved, scene):
    check(solved, scene, 1e-6, [2])


@pytest.mark.long
def test_twice_as_many_steps_on_the_finer_head(solved):
    check(solved, "head_springs_advance.yaml", 1e-6, [2], ranks=2)


def test_loads_rise_to_one(solved):
    loads = [step["load"] for step in steps(solved("paper_jaw_opening.yaml", "-accuracy", 1e-6))]
    assert loads[0] == 0 and loads[-1] == 1
    assert all(a < b for a, b in zip(loads, loads[1:]))


def verified(run, scene, *options, ranks=1):
    """Returns the output of -verify_path on a scene, and the exit status."""
    message = run("repose-solve", PROJECT / "meshes" / scene, "-verify_path", *options, ranks=ranks)
    assert message.stderr == ""
    row = next(line for line in message.stdout.splitlines() if line.startswith("  path "))
    return message.returncode, row, message.stdout


def largest_difference(row):
    return float(re.search(r"(\S+) mm apart at most", row)[1])


def test_a_path_that_leads_elsewhere_is_told(run, solved):
    """An opening of 8° in one step: springs are pressed together, and jump to another place."""
    scene, first = "paper_jaw_opening.yaml", ["-accuracy", 1e-3, "-load_steps"]
    status, row, message = verified(run, scene, *first, 1)
    assert status == 2 and "THE REST POSITION DEPENDS ON IT: in 2 load steps in place of 1" in row
    one, two = (last(solved(scene, *first, count)) for count in (1, 2))
    assert apart(one, two) > 1
    assert largest_difference(row) == pytest.approx(apart(one, two), rel=0.05)
    farthest = np.linalg.norm(one["point/position"] - two["point/position"], axis=1).argmax()
    at = one["point/position"][farthest] - one["point/displacement"][farthest]
    place = re.search(r"farthest about \((\S+), (\S+), (\S+)\) mm", row).groups()
    assert [float(x) for x in place] == pytest.approx(at, abs=0.06)
    assert "NOT CONVERGED" not in message


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_path_that_is_one(run, ranks):
    status, row, message = verified(run, "head_solid.yaml", ranks=ranks)
    assert status == 0 and "verified: in 2 load steps in place of 1" in row
    assert 0 < largest_difference(row) <= 0.2  # twice the accuracy


@pytest.mark.quick
@pytest.mark.parametrize("options, why", [
    (["-adapt"], "-adapt: the path is to be verified"),
    (["-restart", "a.h5"], "-verify_path: the run resumes from another result")])
def test_a_path_that_cannot_be_verified(run, options, why):
    message = run("repose-solve", PROJECT / "meshes/head_solid.yaml", "-verify_path", *options)
    assert (message.returncode, message.stdout) == (1, "") and why in message.stderr
