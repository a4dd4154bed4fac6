"""Coarser models of a scene, solved in its place or to be compared with it."""

import re

import pytest

from conftest import runner
from tissue import apart, last, skin, steps

SCENE = """skin: head_skin.ply
bones:
  - {name: skull, file: head_skull.ply}
  - {name: mandible, file: head_mandible.ply}
tissue:
  layers: 4
  springs:
    default: {modulus: 0.05, law: quartic, reference: initial}
moves:
  - {bone: mandible, MOVE}
solve:
  volume: {poisson: 0.4967}
  accuracy: 1.0e-6
"""


MOVES = {"forward": "translate: [0, -6, 0]",
         "open": "rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: 10}"}


@pytest.fixture(scope="module")
def head(tmp_path_factory, environment):
    """head(*options, ranks=1, jaw="forward") → result file and what was said, of a head of 4000 skin
    vertices whose jaw goes forward by 6 mm or opens by 10°. The same is solved once only."""
    folder = tmp_path_factory.mktemp("head")
    run, done = runner(folder, environment), {}
    made = run("repose-phantom", "-skin_vertices", 4000, "-output", "head")
    assert made.returncode == 0, made
    for jaw, move in MOVES.items():
        (folder / f"{jaw}.yaml").write_text(SCENE.replace("MOVE", move))

    def solve(*options, ranks=1, jaw="forward"):
        key = (options, ranks, jaw)
        if key not in done:
            name = f"result_{len(done)}"
            result = run("repose-solve", f"{jaw}.yaml", *options, "-output", name, ranks=ranks)
            assert (result.returncode, result.stderr) == (0, ""), result
            done[key] = folder / f"{name}.h5", result.stdout
        return done[key]

    solve.run = run
    return solve


def skin_distance(coarse, fine):
    """Largest distance of the skins' rest positions, at the coarse skin's vertices, mm; displacements
    of the fine skin are averaged over the vertices around."""
    scipy = pytest.importorskip("scipy.spatial")
    (places, moved), (fine_places, fine_moved) = skin(coarse), skin(fine)
    near = scipy.cKDTree(fine_places).query(places, k=3)[1]
    return ((moved - fine_moved[near].mean(1)) ** 2).sum(1).max() ** 0.5


def test_adapt_solves_a_coarser_model_within_the_accuracy(head):
    coarse, message = head("-adapt", "-accuracy", 10)
    error = last(coarse)["discretisation_error"]
    assert error + last(coarse)["displacement_error"] <= 10 and "solved model" in message
    assert "discretisation_error" not in steps(coarse)[0]
    assert len(skin(coarse)[0]) < 1500
    assert skin_distance(coarse, head()[0]) < error
    checked = head.run("repose-check", coarse)
    assert checked.returncode == 0, checked


@pytest.mark.long
def test_adapt_keeps_the_scene_s_own_model_where_nothing_else_is_near_enough(head):
    own, message = head("-adapt", "-accuracy", 1e-3)
    assert "discretisation_error" not in last(own) and "solved model" not in message
    assert apart(last(own), last(head()[0])) < 1e-3


def test_a_preview_is_a_coarse_model_and_says_what_it_is_worth(head):
    preview, message = head("-profile", "preview")
    error = last(preview)["discretisation_error"]
    assert ("MORE THAN THE 1 mm REQUESTED" in message) == (error > 1)
    assert skin_distance(preview, head()[0]) < error
    assert last(preview)["evaluations"] < 50


def test_adapt_on_two_ranks(head):
    one, two = (head("-adapt", "-accuracy", 10, ranks=ranks)[0] for ranks in (1, 2))
    assert last(one)["discretisation_error"] == pytest.approx(last(two)["discretisation_error"], 0.1)
    assert apart(last(one), last(two)) <= (last(one)["displacement_error"]
                                           + last(two)["displacement_error"])


@pytest.mark.parametrize("options, words", [
    (["-adapt", "-profile", "exact"], "-adapt solves coarser models"),
    (["-adapt", "-load_steps", 3], "load_steps are requested"),
    (["-adapt", "-functional", "force", "-volume", "none"], "the functional is force"),
    (["-profile", "quick"], "preview, balanced, exact"),
])
def test_what_cannot_be_is_refused_in_a_line(head, options, words):
    result = head.run("repose-solve", "forward.yaml", *options, "-output", "refused")
    assert result.returncode == 1 and words in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_model_file_has_no_coarser_models(head):
    refused = head.run("repose-solve", head()[0], "-adapt", "-output", "refused")
    assert refused.returncode == 1 and "does not state its scene" in refused.stderr


@pytest.mark.quick
def test_a_dry_run_says_what_would_be_done_and_why(head):
    def strategy(*options):
        message = head.run("repose-solve", "forward.yaml", "-dry_run", *options)
        assert (message.returncode, message.stderr) == (0, ""), message
        return dict(re.findall(r"^  (\S[\w ]{0,20}\S) {2,}(.*)$", message.stdout, re.M))

    usual, steps_given = strategy(), strategy("-load_steps", 3, "-profile", "preview")
    assert usual["minimizes"] == "the energy of springs, volume term penalty, to 1e-06 mm"
    assert usual["coarser models"] == "none: no option requests any"
    assert steps_given["coarser models"] == "none: load_steps are requested"
    assert "because of -profile preview" in strategy("-profile", "preview")["coarser models"]
