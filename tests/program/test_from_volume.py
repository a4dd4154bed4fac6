"""drivers/plan.py: from voxels and the name of an operation to a scene, landmarks and a picture."""

import importlib.util
import json
import re

import pytest

from conftest import PROJECT, finish, programs, runner
from heads import DATA

SCRIPT = PROJECT / "drivers/plan.py"
SPEC = importlib.util.spec_from_file_location("plan", SCRIPT)
plan = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(plan)


@pytest.mark.parametrize("text, movements", [
    ("Le Fort I, 5 mm forward", [(5, "forward")]),
    ("Le Fort I, 5 mm forward, 2 up", [(5, "forward"), (2, "up")]),
    ("genioplasty: advance 8 mm", [(8, "advance")]),
    ("open the jaw by 8 degrees", [(8, "open")]),
    ("BSSO set-back of 6 mm", [(6, "setback")]),
    ("jaw 3° yaw, 2 mm to the left", [(3, "yaw"), (2, "left")]),
    ("Le Fort I", [])])
def test_movements_are_read_from_words(text, movements):
    assert plan.movements(text) == movements


def test_segments_of_slicer_are_known_by_their_names(tmp_path):
    file = tmp_path / "head.seg.nrrd"
    names = ["Mandible", "Soft tissue (skin)", "Upper skull", "Spine"]
    header = "".join(f"Segment{i}_Name:={name}\nSegment{i}_LabelValue:={i + 1}\n"
                     for i, name in enumerate(names))
    file.write_bytes(f"NRRD0004\ndimension: 3\n{header}\n".encode() + bytes(8))
    assert plan.roles_of(file) == {"skin": 2, "mandible": 1, "skull": 3}
    file.write_bytes(f"NRRD0004\ndimension: 4\n{header}\n".encode() + bytes(8))
    with pytest.raises(SystemExit, match="one label map"):
        plan.roles_of(file)


@pytest.mark.parametrize("arguments, words", [
    (["none.mhd", "-operation", "jaw, 5 mm forward"], ["none.mhd"]),
    (["ct.mhd", "-operation", "jaw, 5 mm forward"], ["label map", "-apart"]),
    (["ct.mhd", "labels.mhd", "-operation", "nose job, 5 mm up"], ["name Le Fort I"]),
    (["ct.mhd", "labels.mhd", "-operation", "genioplasty"], ["give a movement"])])
def test_what_cannot_be_planned_is_refused_in_one_line(tmp_path, environment, arguments, words):
    for name in ("ct.mhd", "labels.mhd"):
        (tmp_path / name).touch()
    result = finish([SCRIPT, *arguments], tmp_path, environment, 60)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result
    assert all(word in result.stderr for word in words)
    assert not (tmp_path / "plan").exists()


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")
def test_a_scene_is_proposed_that_can_be_solved(tmp_path, environment):
    (tmp_path / "build").mkdir()
    (tmp_path / "build/bin").symlink_to(programs())
    result = finish([SCRIPT, DATA / "head_hu.mhd", DATA / "labels.nii.gz", "-operation",
                     "Le Fort I, 5 mm forward, 2 up", "-propose"], tmp_path,
                    environment | {"REPOSE_BUILD": "build"}, 120)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert (tmp_path / "plan/landmarks.svg").exists()
    scene = (tmp_path / "plan/scene.yaml").read_text()
    marks = json.loads((tmp_path / "plan/landmarks.mrk.json").read_text())["markups"][0]
    place = {entry["label"]: entry["position"] for entry in marks["controlPoints"]}
    level = float(re.search(r"point: \[[^,]*, [^,]*, ([\d.-]+)\], normal: \[0, 0, -1\]", scene)[1])
    assert abs(level - place["nasal_spine"][2] - 5) < 0.1, "above the nasal floor"
    for line in ("piece: maxilla", "translate: [0.0, -5.0, 0.0]", "translate: [0.0, 0.0, 2.0]"):
        assert line in scene
    solved = runner(tmp_path, environment)("repose-solve", "plan/scene.yaml", "-dry_run")
    assert (solved.returncode, solved.stderr) == (0, ""), solved
    assert "piece 'maxilla'" in solved.stdout and "  warning" not in solved.stdout
