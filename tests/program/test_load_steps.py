"""The rest position does not depend on how many parts the bones' motion is made in."""

import pytest

from tissue import last, same_face, steps


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


def test_twice_as_many_steps_on_the_finer_head(solved):
    check(solved, "head_jaw_advance.yaml", 1e-6, [2], ranks=2)


def test_loads_rise_to_one(solved):
    loads = [step["load"] for step in steps(solved("paper_jaw_opening.yaml", "-accuracy", 1e-6))]
    assert loads[0] == 0 and loads[-1] == 1
    assert all(a < b for a, b in zip(loads, loads[1:]))
