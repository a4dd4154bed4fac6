"""drivers/sheet/scene.py: the files that a scene names, and scenes with other moves."""

import os
import sys

import pytest
import yaml

from conftest import PROJECT

sys.path.insert(0, str(PROJECT / "drivers"))
from sheet.scene import named_file, with_moves  # noqa: E402
from sheet.script import Unusable  # noqa: E402

pytestmark = pytest.mark.quick

MATRIX = [[1, 0, 0, 0], [0, 1, 0, -1.5], [0, 0, 1, 0], [0, 0, 0, 1]]


def write(tmp_path, text):
    scene = tmp_path / "scene.yaml"
    scene.write_text(text, encoding="utf-8")
    return scene


@pytest.mark.parametrize("text, key, name", [
    ("anatomy:\n  # landmarks: old.json\n  landmarks: new.json\n", "landmarks", "new.json"),
    ("# landmarks: old.json\nanatomy: {landmarks: new.json}  # landmarks: old.json\n", "landmarks", "new.json"),
    ('anatomy: {landmarks: "Müller, Anna.json"}\n', "landmarks", "Müller, Anna.json"),
    ("anatomy: {landmarks: 'O''Brien #2.json'}\n", "landmarks", "O'Brien #2.json"),
    ('anatomy: {landmarks: "O\'Brien.json"}\n', "landmarks", "O'Brien.json"),
    ('{"landmarks": "a b.json", "skin": "c.ply"}', "landmarks", "a b.json"),
    ("anatomy: {landmarks: a b.json\t}\t# the\u2028head\n", "landmarks", "a b.json"),
    ("--- !scene\nbase: &base {landmarks: !file a.json}\nanatomy: {<<: *base}\nnote: 2024-13-45\n", "landmarks", "a.json"),
    ("landmarks: moves.json\nanatomy: {landmarks: head.json}\n", "landmarks", "head.json"),
    ("skin: {volume: ct.mhd, level: -300}\n", "skin", None), ("skin: a.ply\n", "landmarks", None)])
def test_a_file_is_that_which_the_scene_names(tmp_path, text, key, name):
    found = named_file(write(tmp_path, text), key)
    assert found == (name and os.path.join(tmp_path, name))


@pytest.mark.parametrize("text", ["- a\n", "skin: [\n", "skin", ""])
def test_a_file_that_is_no_scene_is_refused(tmp_path, text):
    for read in (lambda file: named_file(file, "skin"), lambda file: with_moves(file, {})):
        with pytest.raises(Unusable, match="scene.yaml: .*scene"):
            read(write(tmp_path, text))


FLUSH = "skin: face.ply\nmoves:\n- bone: jaw\n  translate: [0, 1, 0]\n\n# the tissue\ntissue: {layers: 4}\n"


@pytest.mark.parametrize("text, kept", [
    (FLUSH, "# the tissue\ntissue: {layers: 4}"),
    ("skin: face.ply\ntissue: {layers: 4}\nmoves:\n- bone: jaw\n  translate:\n  - 0\n  - 1\n  - 0", "skin: face.ply"),
    ("moves:\n  - {bone: jaw,\n     translate: [0, 1, 0]\n}\nskin: face.ply # the skin\ntissue: {layers: 4}\n", "# the skin"),
    ("--- # a plan\nskin: face.ply\ntissue: {layers: 4}\n...\n", "# a plan"),
    ("  skin: face.ply\n  moves: []\n  tissue: {layers: 4}\n", "  tissue: {layers: 4}"),
    ("skin: face.ply\ntissue: {layers: 4}\nmoves:\n", "skin: face.ply"),
    ("--- &head\nskin: face.ply\t# \u2028 \nmoves: []\ntissue: {layers: 4}\n", "--- &head"),
    ("skin: face.ply\nmoves: [{bone: jaw, translate: &v {layers: 4}}]\ntissue: *v\n", "skin: face.ply"),
    ('{"skin": "face.ply", "tissue": {"layers": 4}, "moves": [{"bone": "jaw"}]}', "face.ply")])
@pytest.mark.parametrize("moves", [{}, {"Kinn: \"ü\"": MATRIX, "jaw": MATRIX}])
def test_a_scene_with_other_moves_is_the_same_but_for_these(tmp_path, text, kept, moves):
    changed = with_moves(write(tmp_path, text), moves)
    assert kept in changed
    assert yaml.safe_load(changed) == {
        "skin": "face.ply", "tissue": {"layers": 4},
        "moves": [{"bone": bone, "transform": matrix} for bone, matrix in moves.items()]}
