"""The change that -sensitivity predicts for a variation is that of the varied scene, solved."""

import re

import numpy as np
import pytest

from tissue import last, model_of

SCENE = """skin: paper_skin.ply
bones:
  - {name: skull, file: paper_skull.ply}
  - {name: mandible, file: paper_mandible.ply}
boundary: {rim: fixed}
tissue:
  layers: 4
moves:
  - {bone: mandible, translate: [0, -3, 0]}
"""
SKIN = "  material: {skin: {thickness: 1.5, young: 0.075}}\n"
VARIED = {
    "a free rim": SCENE.replace("fixed", "free"),
    "a skin of 1.5 mm, five times as stiff": SCENE.replace("moves", SKIN + "moves"),
    "a lower Poisson's ratio (0.40 for 0.45)":
        SCENE.replace("moves", "  material: {poisson: 0.4}\nmoves"),
    "tissue.release half as large again": SCENE.replace("moves", "  release: 15\nmoves"),
}
ROW = re.compile(r"sensitivity +(.*) moves half of the skin by less than (\S+) mm, 95 % by (\S+) "
                 r"mm, all by (\S+) mm")


def prepare(folder, text):
    (folder / "face.yaml").write_text(text)


def solve(run, folder, text, *options, ranks=1):
    """Returns the output of a run, the skin and its rest position."""
    prepare(folder, text)
    result = run("repose-solve", "face.yaml", "-accuracy", 0.001, *options, ranks=ranks)
    assert result.returncode == 0, result
    model = model_of(folder / "face.h5")
    skin = model["point/layer"] == 0
    return (result.stdout, model["point/position"][skin],
            last(folder / "face.h5")["point/position"][skin])


def test_predictions_are_those_of_the_varied_scenes(run, folder):
    text, initial, rest = solve(run, folder, SCENE, "-sensitivity")
    report = {name: [float(x) for x in found] for name, *found in ROW.findall(text)}
    assert report.keys() == VARIED.keys()
    assert [*report.values()] == sorted(report.values(), key=lambda row: -row[1])
    moves = np.linalg.norm(rest - initial, axis=1) > 0.5
    for name, scene in VARIED.items():
        _, _, varied = solve(run, folder, scene)
        true = np.quantile(np.linalg.norm(varied - rest, axis=1)[moves], [0.5, 0.95, 1])
        assert np.allclose(report[name], true, rtol=0.3, atol=0.02), (name, report[name], true)


def test_cut_through_tissue_that_is_let_go(run, folder):
    """With more tissue released the cut doubles more points."""
    path = "[[20.7, -91, -1.2], [21.7, -92, -17.3], [20.7, -88.9, -32.8], [18.6, -88.1, -44.2]]"
    cut = f"incisions: [{{path: {path}, layers: 4}}]\n"
    more = "tissue.release half as large again"
    text, initial, rest = solve(run, folder, SCENE + cut, "-sensitivity")
    points = len(model_of(folder / "face.h5")["point/layer"])
    report = {name: [float(x) for x in found] for name, *found in ROW.findall(text)}
    _, _, varied = solve(run, folder, VARIED[more] + cut)
    assert len(model_of(folder / "face.h5")["point/layer"]) > points
    moves = np.linalg.norm(rest - initial, axis=1) > 0.5
    true = np.quantile(np.linalg.norm(varied - rest, axis=1)[moves], [0.5, 0.95, 1])
    assert np.allclose(report[more], true, rtol=0.3, atol=0.02), (report[more], true)


def test_face_that_hardly_moves_has_no_numbers(run, folder):
    text, _, _ = solve(run, folder, SCENE.replace("-3", "-0.3"), "-sensitivity")
    assert text.count("no skin counts, as none moves by 0.5 mm") == len(VARIED)
    assert not ROW.search(text)


@pytest.mark.quick
def test_names_hold_the_numbers_of_the_material(run, folder):
    thin = SKIN.replace("1.5", "2").replace("{skin", "{poisson: 0.3, skin")
    text, _, _ = solve(run, folder, SCENE.replace("moves", thin + "moves"), "-sensitivity")
    assert {"a skin of 2 mm, five times as stiff", "a lower Poisson's ratio (0.25 for 0.30)"} < {
        name for name, *_ in ROW.findall(text)}


def test_ranks_agree(run, folder):
    one, two = (ROW.findall(solve(run, folder, SCENE, "-sensitivity", ranks=ranks)[0])
                for ranks in (1, 2))
    assert len(one) == len(VARIED)
    for a, b in zip(sorted(one), sorted(two)):
        assert a[0] == b[0]
        assert np.allclose(np.array(a[1:], float), np.array(b[1:], float), rtol=0.1, atol=0.01)


@pytest.mark.parametrize("text, options, words", [
    (SCENE.replace("moves", "  springs: {default: {modulus: 0.05}}\nmoves"), [], "springs"),
    (SCENE, ["-adapt"], "coarser model"),
])
def test_what_it_is_not_known_of_is_refused(run, folder, text, options, words):
    prepare(folder, text)
    result = run("repose-solve", "face.yaml", "-sensitivity", *options)
    assert result.returncode == 1 and result.stderr.count("\n") == 1
    assert "-sensitivity" in result.stderr and words in result.stderr
