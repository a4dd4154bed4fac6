"""The rest position does not depend on how many parts the bones' motion is made in."""

import pytest

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
def test_two_and_three_times_as_many_steps(solved, scene):
    check(solved, scene, 1e-6, [2, 3])


def test_twice_as_many_steps_on_the_finer_head(solved):
    check(solved, "head_jaw_advance.yaml", 1e-6, [2], ranks=2)


def test_a_tame_move_takes_one_step(solved):
    one = solved("paper_jaw_advance.yaml", "-accuracy", 0.01)
    three = solved("paper_jaw_advance.yaml", "-accuracy", 0.01, "-load_steps", 3)
    assert [step["load"] for step in steps(one)] == [0, 1]
    evaluations = [sum(step["evaluations"] for step in steps(file)) for file in (one, three)]
    assert 1.5 * evaluations[0] < evaluations[1]


def test_a_stiff_volume_term_is_reached_from_softer_ones(solved):
    stiff = "paper_jaw_opening.yaml", "-accuracy", 1e-6, "-bulk_modulus", 1e3
    led, followed = solved(*stiff), solved(*stiff, "-load_steps", 4)
    same_face(led, followed, 2e-6)
    evaluations = [sum(step["evaluations"] for step in steps(file)) for file in (led, followed)]
    assert 2 * evaluations[0] < evaluations[1]


def test_a_long_step_does_not_pass_over_a_jump(solved):
    """Its end is near its prediction, but the prediction back from there does not lead to its
    start; where the user asks for so few steps, they are taken."""
    ends = [last(solved("paper_jaw_opening.yaml", "-accuracy", 1e-4, *options))
            for options in ([], ["-load_steps", 14], ["-load_steps", 2])]
    assert apart(ends[0], ends[1]) < 2e-4
    assert apart(ends[0], ends[2]) > 1


def test_loads_rise_to_one(solved):
    loads = [step["load"] for step in steps(solved("paper_jaw_opening.yaml", "-accuracy", 1e-6))]
    assert loads[0] == 0 and loads[-1] == 1
    assert all(a < b for a, b in zip(loads, loads[1:]))
