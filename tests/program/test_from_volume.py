"""drivers/plan.py: from voxels and the name of an operation to a scene, landmarks and a picture."""

import importlib.util
import json
import re
import subprocess
import sys

import meshio
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import volumes
from conftest import PROJECT, can_draw, finish, programs, runner
from heads import DATA
from tissue import last

SCRIPT = PROJECT / "drivers/plan.py"
SPEC = importlib.util.spec_from_file_location("plan", SCRIPT)
plan = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(plan)


MAXILLA, SPLIT, JAW, CHIN = "Le Fort I", "sagittal split", "jaw", "genioplasty"


@pytest.mark.quick
@pytest.mark.parametrize("text, moves", [
    # each word order, also mixed, with and without units and commas
    ("Le Fort I, 5 mm forward", {MAXILLA: {"advance": 5}}),
    ("Le Fort I, 5 mm forward, 2 up", {MAXILLA: {"advance": 5, "impaction": 2}}),
    ("Le Fort I, advance 5 mm, 2 mm up", {MAXILLA: {"advance": 5, "impaction": 2}}),
    ("Le Fort I 5 mm forward 2 mm up 3° yaw", {MAXILLA: {"advance": 5, "impaction": 2, "yaw": 3}}),
    ("Le Fort I 3 mm advancement and 2 mm impaction and yaw 2°", {MAXILLA: {"advance": 3, "impaction": 2, "yaw": 2}}),
    ("sagittal split, advance 6 mm with 2 degrees roll", {SPLIT: {"advance": 6, "roll": 2}}),
    ("jaw 3 mm left, roll 2 degrees", {JAW: {"left": 3, "roll": 2}}),
    ("jaw 3° yaw, 2 mm to the left", {JAW: {"yaw": 3, "left": 2}}),
    ("sagittal split, set-back 9 mm with impaction 5", {SPLIT: {"set_back": 9, "impaction": 5}}),
    ("BSSO set back of 6mm", {SPLIT: {"set_back": 6}}),
    ("move the jaw forward by 6", {JAW: {"advance": 6}}),
    # names, before, between and after the movements
    ("Le Fort 1 advance 5 mm", {MAXILLA: {"advance": 5}}),
    ("LeFort-1: impaction 4 mm", {MAXILLA: {"impaction": 4}}),
    ("Le Fort I,5.5mm forward,2mm up", {MAXILLA: {"advance": 5.5, "impaction": 2}}),
    ("Le Fort I. Forward 5 mm", {MAXILLA: {"advance": 5}}),
    ("setback 9 mm up 2 mm of the maxilla", {MAXILLA: {"set_back": 9, "impaction": 2}}),
    ("upper jaw, 5 mm forward", {MAXILLA: {"advance": 5}}),
    ("Le Fort I, upper jaw advance 5 mm", {MAXILLA: {"advance": 5}}),
    ("Le Fort I, 2 mm right, 1 mm lower", {MAXILLA: {"left": -2, "lower": 1}}),
    ("lower the maxilla by 3 mm", {MAXILLA: {"lower": 3}}),
    ("lower  jaw, 3 mm lower", {JAW: {"lower": 3}}),
    ("bilateral sagittal split osteotomy: the lower jaw 5 mm back", {SPLIT: {"set_back": 5}}),
    ("advance the chin by 8 mm", {CHIN: {"advance": 8}}),
    # signs and sides
    ("Le Fort I, yaw -2 degrees", {MAXILLA: {"yaw": -2}}),
    ("jaw, −5 mm forward", {JAW: {"advance": -5}}),
    ("Le Fort I, 4 mm forward, 3 degrees yaw to the right", {MAXILLA: {"advance": 4, "yaw": -3}}),
    ("jaw, 2 degrees to the patient's left yaw", {JAW: {"yaw": 2}}),
    ("jaw: yaw 2 degrees left 3 mm up 4 mm", {JAW: {"yaw": 2, "left": 3, "impaction": 4}}),
    ("sagittal split, 3 degrees pitch", {SPLIT: {"pitch": 3}}),
    # opening and closing imply the jaw
    ("open the jaw by 8 degrees", {JAW: {"open": 8}}),
    ("open bite: close by 3 degrees", {JAW: {"open": -3}}),
    # targets of the incisors
    ("BSSO to an overjet of 2 mm and an overbite of 1.5 mm", {SPLIT: {"overjet": 2, "overbite": 1.5}}),
    ("Le Fort I: overjet -1 mm, 3 mm up", {MAXILLA: {"overjet": -1, "impaction": 3}}),
    # several operations
    ("Le Fort I 5 mm forward and genioplasty 4 mm forward", {MAXILLA: {"advance": 5}, CHIN: {"advance": 4}}),
    ("BSSO 6 mm back with Le Fort I 5 mm forward, yaw 2", {MAXILLA: {"advance": 5, "yaw": 2}, SPLIT: {"set_back": 6}}),
    ("Le Fort I 5 mm up. Jaw closes 2 degrees + chin 4 mm forward",
     {MAXILLA: {"impaction": 5}, JAW: {"open": -2}, CHIN: {"advance": 4}})])
def test_a_text_is_read_as_operations(text, moves):
    operations = plan.read_operations(text)
    assert dict(operations) == moves
    assert list(moves) == [operation.name for operation in operations], "upper jaw first, chin last"
    assert plan.read_operations(plan.summarize(operations)) == operations


@pytest.mark.quick
@pytest.mark.parametrize("text, words", [
    ("nose job, 5 mm up", "'nose' is not understood; name Le Fort I"),
    ("Le Fort I, 5 mm forward, cant 3", "'cant' is not understood"),
    ("Le Fort I, 5 mm posterior impaction", "'posterior' is not understood"),
    ("genioplasty 6 mm forward, 3 mm shorter", "'shorter' is not understood"),
    ("sagittal split, 6 mm advancement on the right, 3 mm on the left", "'on' is not understood"),
    ("clockwise rotation of the jaw by 4 degrees", "'clockwise' is not understood"),
    ("Le Fort I, 5 cm forward", "'cm' is not understood"),
    ("jaw, 5 - 10 mm forward", "'-' is not understood"),
    ("Le Fort I-5 mm forward", "'-' is not understood"),
    ("jaw, 1e1 mm forward", "'e' is not understood"),
    ("bimaxillary 5 mm forward", "'bimaxillary' is not understood"),
    ("Le Fort II, 5 mm forward", "Le Fort I only"),
    ("Le Fort 3 forward", "Le Fort I only"),
    ("Le Fort 1 mm forward", "'mm' has no number"),
    ("Le Fort 1,5 mm forward", "write Le Fort I, with a blank before a number"),
    ("Le Fort I.5 mm forward", "write Le Fort I, with a blank before a number"),
    ("genioplasty, 5,5 mm forward", "'5,5' is not a number"),
    ("Le Fort I, 3.5.2 mm forward", "'3.5.2' is not a number"),
    ("jaw .5 mm forward", "'.5' is not a number"),
    ("BSSO.5 mm forward", "'.5' is not a number"),
    ("Le Fort I 5.mm forward", "'mm' has no number"),
    ("jaw, 5 mm yaw", "yaw is in degrees"),
    ("jaw, 4 degrees forward", "advance is in mm"),
    ("jaw 3 degrees left", "left is in mm"),
    ("jaw 3 degrees roll to the right", "the left side rises"),
    ("sagittal split, 6 mm advancement right", "'6 mm advancement right'"),
    ("Le Fort I, 5 mm forward and up", "'up': a movement is one number and one word"),
    ("Le Fort I, 5 mm forward, 2 mm", "'2 mm': a movement"),
    ("jaw 2 yaw left 3 yaw right 2", "several ways"),
    ("jaw " + 999 * "5 mm up ", "too long"),
    ("Le Fort I, 5 mm forward, 5 mm back", "exclude each other"),
    ("jaw, 2 mm left, 3 mm right", "exclude each other"),
    ("jaw, 2 mm forward, overjet 3 mm", "advance 2 mm and overjet 3 mm exclude each other"),
    ("Le Fort I, overbite 3 mm, 2 mm down", "exclude each other"),
    ("genioplasty, overjet 2 mm", "target of a jaw with teeth"),
    ("Le Fort I, open 3 degrees", "movement of the lower jaw"),
    ("jaw 400 mm forward", "more than 30 mm"),
    ("5 mm forward", "no operation is named"),
    ("genioplasty", "give a movement"),
    ("Le Fort I and genioplasty 4 mm forward", "Le Fort I: give a movement"),
    ("Le Fort I 5 mm forward, 3 degrees yaw of the mandible, 6 mm back", "name each"),
    ("5 mm forward of the maxilla, genioplasty 4 mm forward", "name each")])
def test_a_text_that_is_not_understood_is_refused(text, words, capsys):
    with pytest.raises(SystemExit):
        plan.read_or_refuse(text)
    refusal = capsys.readouterr().err
    assert words in refusal and refusal.count("\n") == 1


def scene_of(operation, bones=("skull", "mandible")):
    return plan.scene_text(plan.read_operations(operation), 4, bones)


@pytest.mark.quick
@pytest.mark.parametrize("operation, kerfs", [
    ("Le Fort I, 5 mm forward", [1]), ("Le Fort I, 5 mm forward, 2 up", [3]), ("Le Fort I, 4 mm back", [5]),
    ("genioplasty, 8 mm forward", [0.5]), ("genioplasty, 4 mm back, 3 mm up", [5.41]), ("BSSO set-back of 5 mm", [0.5]),
    ("Le Fort I 4 mm up, BSSO 5 mm back", [5, 0.5]), ("Le Fort I, roll 4 degrees", [3.09]),
    ("Le Fort I, roll -4 degrees", [3.09]), ("Le Fort I, pitch 3 degrees, 1 down", [2.62]),
    ("Le Fort I, pitch -3 degrees, 2 forward", [1]), ("Le Fort I, yaw -4 degrees", [3.09])])
def test_bone_is_taken_out_where_a_piece_moves_towards_it(operation, kerfs):
    found = [float(kerf) for kerf in re.findall("kerf: ([0-9.]+)", scene_of(operation))]
    assert found == pytest.approx(kerfs, abs=0.01)


@pytest.mark.quick
@pytest.mark.parametrize("operation, bones, lines", [
    ("Le Fort I, 5 mm forward, 2 up", ["skull", "mandible"],
     ["template: le_fort_1", "{bone: maxilla, clinical: {advance: 5, impaction: 2}}"]),
    ("Le Fort I, 3 mm right, 2 degrees roll", ["skull", "maxilla", "mandible"],
     ["{bone: maxilla, clinical: {left: -3, roll: 2, pivot: upper_incisor_edge}}"]),
    ("genioplasty, 4 mm back, 3 mm up", ["skull", "mandible"],
     ["template: genioplasty", "{bone: chin, clinical: {set_back: 4, impaction: 3}}"]),
    ("close the jaw by 3 degrees", ["skull", "mandible"], ["{bone: mandible, clinical: {open: -3}}"])])
def test_an_operation_is_a_template_and_a_clinical_move(operation, bones, lines):
    scene = scene_of(operation, bones)
    assert all(line in scene for line in lines)
    assert ("osteotomies" in scene) == ("template" in "".join(lines))


def test_a_chin_is_cut_from_the_jaw_and_moves_with_it():
    scene = scene_of("genioplasty 4 mm forward, Le Fort I 5 mm forward, BSSO 6 mm back, yaw 2 degrees")
    assert scene.startswith("# Le Fort I: advance 5 mm; sagittal split: set back 6 mm, yaw 2 degrees to the left; "
                            "genioplasty: advance 4 mm.\n")
    assert re.findall("{(bone: .*), kerf", scene) == [
        "bone: skull, piece: maxilla, template: le_fort_1", "bone: mandible, piece: jaw, template: sagittal_split",
        "bone: jaw, piece: chin, template: genioplasty"]
    assert scene.split("moves:\n")[1].splitlines() == [
        "  - {bone: maxilla, clinical: {advance: 5}}",
        "  - {bone: [jaw, chin], clinical: {set_back: 6, yaw: 2, pivot: lower_incisor_edge}}",
        "  - {bone: chin, clinical: {advance: 4}}"]
    whole = scene_of("jaw 2 mm forward, chin 4 mm forward")
    assert "bone: mandible, piece: chin" in whole and "bone: [mandible, chin], clinical: {advance: 2}" in whole


def test_a_printed_command_can_be_given_to_a_shell(tmp_path, capfd):
    plan.run(sys.executable, "-c", "import sys; print(sys.argv[1:])", tmp_path / "Plan für ä")
    first, printed = capfd.readouterr().out.splitlines()
    assert subprocess.check_output(["sh", "-c", first.removeprefix("$ ")], text=True).strip() == printed


@pytest.mark.parametrize("end", [b"\n", b"\r\n"], ids=["Unix", "Windows"])
def test_segments_of_slicer_are_known_by_their_names(tmp_path, end):
    names = ["Mandible", "Lower teeth", "Soft tissue (skin)", "Maxilla & Upper Skull", "Upper teeth", "Spine", "Table"]
    labels = np.arange(8, dtype="u1").reshape(2, 2, 2)
    file = volumes.write_segmentation(tmp_path / "head.seg.nrrd", labels, names, (0, 0, 0), 1.0)
    head, blank, data = file.read_bytes().partition(b"\n\n")
    file.write_bytes((head + blank).replace(b"\n", end) + data)
    segmentation = plan.Segmentation(file)
    assert segmentation.roles() == {
        "skin": names[:6], "mandible": names[:2], "skull": ["Maxilla & Upper Skull", "Upper teeth"]}
    segmentation.write(names[:2], tmp_path / "jaw.nrrd")
    assert (tmp_path / "jaw.nrrd").read_bytes().endswith(b"\n\n" + bytes([0, 1, 1, 0, 0, 0, 0, 0]))


@pytest.mark.quick
@pytest.mark.parametrize("names, roles", [
    (["Unterkiefer", "Schädel", "Haut", "Oberkiefer", "Zähne unten", "Obere Zähne", "Luft"], "mkhxmx-"),
    (["mâchoire inférieure", "crâne", "peau", "mâchoire supérieure", "Dents du bas", "dents du haut", "air"], "mkhxmx-"),
    (["Mandíbula", "Cráneo", "Piel", "Maxilar", "dientes inferiores", "Dientes superiores", "background"], "mkhxmx-"),
    (["Schädel mit Oberkiefer", "Mandible", "Skin"], "kmh"),
    (["Maxilar inferior", "Skull without mandible", "Tejidos blandos", "Maxilar superior", "Untere Zähne"], "mkhxm"),
    (["Maxillaire inférieur", "Hyoid bone", "Weichgewebe", "Maxillary sinus", "Cervical spine bone", "Cranium"], "m.h..k"),
])
def test_names_of_segments_are_understood_in_other_languages(tmp_path, names, roles):
    labels = np.arange(8, dtype="u1").reshape(2, 2, 2)
    found = plan.Segmentation(volumes.write_segmentation(tmp_path / "head.seg.nrrd", labels, names, (0, 0, 0), 1.0)).roles()
    for letter, role in (("m", "mandible"), ("k", "skull"), ("x", "maxilla")):
        assert found.get(role, []) == [name for name, its in zip(names, roles) if its == letter]
    assert found["skin"] == [name for name, its in zip(names, roles) if its != "-"]


@pytest.mark.parametrize("names, words", [
    (["Mandible", "Skull", "Skin", "Upper and lower teeth"], "Upper and lower teeth: not known whether"),
    (["Mandible", "Skull", "Skin", "Zähne"], "Zähne: not known whether"),
    (["Mandible", "Skull", "Skin", "Mandible"], "two segments are named Mandible"),
    (["A", "B", "C", "D", "E", "F", "G", "Mandible"], "segment Mandible holds no voxel"),
])
def test_segments_that_are_ambiguous_are_refused(tmp_path, environment, names, words):
    volumes.write_segmentation(tmp_path / "head.seg.nrrd", np.arange(8, dtype="u1").reshape(2, 2, 2), names, (0, 0, 0), 1.0)
    result = finish([sys.executable, SCRIPT, "head.seg.nrrd", "-operation", "jaw, 5 mm forward"], tmp_path, environment, 60)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result
    assert f"head.seg.nrrd: {words}" in result.stderr


def test_segments_whose_names_are_not_understood_are_named(tmp_path, environment):
    volumes.write_segmentation(tmp_path / "head.seg.nrrd", np.arange(8, dtype="u1").reshape(2, 2, 2),
                               ["Segment_1", "Żuchwa", "Skin"], (0, 0, 0), 1.0)
    result = finish([sys.executable, SCRIPT, "head.seg.nrrd", "-operation", "jaw, 5 mm forward"], tmp_path, environment, 60)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result
    assert "no segment is named as skull or mandible among Segment_1, Żuchwa, Skin" in result.stderr
    assert "mandible (Unterkiefer" in result.stderr


def test_segments_that_overlap_are_in_layers(tmp_path):
    labels = np.array([[[[1, 0], [1, 1], [0, 1], [0, 0]]] * 2] * 2, dtype="u1")  # z, y, x, layer
    file = volumes.write_segmentation(tmp_path / "head.seg.nrrd", labels, ["Skin", "Skull"], (0, 0, 0), 1.0)
    text = file.read_bytes()
    for old, new in ((b"dimension: 3", b"dimension: 4"), (b"directions: ", b"directions: none "),
                     (b"kinds: ", b"kinds: list "), (b"Segment1_LabelValue:=2", b"Segment1_LabelValue:=1"),
                     (b"Segment1_Layer:=0", b"Segment1_Layer:=1")):
        assert old in text
        text = text.replace(old, new)
    file.write_bytes(text)
    segmentation = plan.Segmentation(file)
    segmentation.write(["Skull"], tmp_path / "skull.nrrd")
    written = (tmp_path / "skull.nrrd").read_bytes()
    assert b"sizes: 4 2 2\n" in written and b"space directions: (1.0,0,0)" in written
    assert written.endswith(b"\n\n" + bytes([0, 1, 1, 0] * 4))


@pytest.mark.parametrize("arguments, words", [
    (["none.mhd", "-operation", "jaw, 5 mm forward"], ["none.mhd"]),
    (["ct.mhd", "labels.mhd", "-operation", "nose job, 5 mm up"], ["'nose'", "name Le Fort I"]),
    (["ct.mhd", "labels.mhd", "other.mhd", "-operation", "jaw, 5 mm forward"], ["unrecognized arguments: other.mhd"]),
    (["head.seg.nrrd", "-operation", "jaw, 5 mm forward", "labels.mhd"], ["labels.mhd: head.seg.nrrd is a segmentation"]),
    (["head.seg.nrrd", "-operation", "jaw, 5 mm forward", "-apart", "ct.mhd", "ct.mhd"], ["-apart: the bones are those"]),
    (["ct.mhd", "labels.mhd", "-apart", "ct.mhd", "ct.mhd", "-operation", "jaw, 5 mm forward"], ["-apart: the bones are"])])
def test_what_cannot_be_planned_is_refused_in_one_line(tmp_path, environment, arguments, words):
    for name in ("ct.mhd", "labels.mhd", "head.seg.nrrd"):
        (tmp_path / name).touch()
    result = finish([sys.executable, SCRIPT, *arguments], tmp_path, environment, 60)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result
    assert all(word in result.stderr for word in words)
    assert not (tmp_path / "plan").exists()


@pytest.mark.parametrize("content", [b"", b"NRRD0004\n", b"NRRD0004\ntype: short\nsizes: 2 2 2\nencoding: gzip\n\nxyz",
                                     b"NRRD0004\ntype: short\nsizes: 2 2 2\nencoding: raw\n\nx"])
def test_a_damaged_segmentation_is_refused_in_one_line(tmp_path, environment, content):
    (tmp_path / "head.seg.nrrd").write_bytes(content)
    result = finish([sys.executable, SCRIPT, "head.seg.nrrd", "-operation", "jaw, 5 mm forward"], tmp_path,
                    environment, 60)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result
    assert "plan.py: head.seg.nrrd: damaged, or not a segmentation of 3D Slicer" in result.stderr


@pytest.fixture
def rerun(tmp_path, environment):
    """rerun(scene, *options) → (result, names in the folder) of a run whose first program fails, in a folder with the
    files of an earlier run and others."""
    (tmp_path / "bin").mkdir()
    for name in ("isosurface", "landmarks", "solve"):
        program = tmp_path / f"bin/repose-{name}"
        program.write_text("#!/bin/sh\nexit 1\n")
        program.chmod(0o755)
    (tmp_path / "plan").mkdir()
    for name in (*plan.WRITTEN, "notes.txt", "label_3.ply"):
        (tmp_path / "plan" / name).write_text(name)
    (tmp_path / "ct.mhd").touch()

    def run(scene, *options):
        (tmp_path / "plan/scene.yaml").write_text(scene)
        result = finish([sys.executable, SCRIPT, "ct.mhd", "-operation", "jaw, 5 mm forward", *options], tmp_path,
                        environment | {"REPOSE_BUILD": str(tmp_path)}, 60)
        assert result.returncode == 1 and result.stderr.count("\n") == 1, result
        return result, {path.name for path in (tmp_path / "plan").iterdir()}
    return run


@pytest.mark.parametrize("options, kept", [
    ([], set()), (["-apart", "plan/bone_1.mrk.json", "plan/bone_2.mrk.json"], {"bone_1.mrk.json", "bone_2.mrk.json"})])
def test_a_folder_that_is_used_again_holds_one_run(rerun, options, kept, tmp_path, environment):
    result, names = rerun(scene_of("Le Fort I, 5 mm forward"), *options)
    assert "repose-isosurface ended" in result.stderr and "of an earlier run" in result.stdout
    assert names == {"scene.yaml", "old_scene.yaml", "old_landmarks.mrk.json", "notes.txt", "label_3.ply"} | kept
    assert scene_of("Le Fort I, 5 mm forward") in (tmp_path / "plan/old_scene.yaml").read_text(), "edits are kept"
    again = finish([sys.executable, SCRIPT, "ct.mhd", "-operation", "jaw, 5 mm forward"], tmp_path,
                   environment | {"REPOSE_BUILD": str(tmp_path)}, 60)
    assert "repose-isosurface ended" in again.stderr, "a run that failed is no obstacle"
    assert {path.name for path in (tmp_path / "plan").iterdir()} == names - kept
    assert scene_of("Le Fort I, 5 mm forward") in (tmp_path / "plan/old_scene.yaml").read_text(), "edits are kept"
    _, names = rerun("# " + plan.PROPOSED)
    assert {"old_scene.yaml", "old_2_scene.yaml"} <= names, "edits of two runs are kept"


@pytest.mark.quick
def test_a_folder_in_which_a_run_is_at_work_is_refused(rerun, tmp_path):
    plan.lock(tmp_path / "plan")
    result, names = rerun(scene_of("Le Fort I, 5 mm forward"))
    assert "plan: another run of this program is at work in it" in result.stderr
    assert names == {*plan.WRITTEN, "notes.txt", "label_3.ply"}


def test_programs_that_are_not_there_are_refused_before_anything_is_removed(rerun, tmp_path):
    (tmp_path / "bin/repose-solve").unlink()
    result, names = rerun(scene_of("Le Fort I, 5 mm forward"))
    assert "bin/repose-solve: no such program" in result.stderr
    assert names == {*plan.WRITTEN, "notes.txt", "label_3.ply"}


def test_points_that_are_not_there_are_refused_before_anything_is_removed(rerun):
    result, names = rerun(scene_of("Le Fort I, 5 mm forward"), "-apart", "skull.mrk.json", "jaw.mrk.json")
    assert "skull.mrk.json: no such file" in result.stderr and names == {*plan.WRITTEN, "notes.txt", "label_3.ply"}


def test_files_of_others_are_not_removed(rerun):
    result, names = rerun("skin: skin.ply\n")
    assert "scene.yaml was not written by this program" in result.stderr
    assert names == {*plan.WRITTEN, "notes.txt", "label_3.ply"}


ORIGIN, SPACING, SIZE = (-80.0, -122.0, -76.0), 2.0, (81, 118, 104)


def border_loops(triangles):
    """Vertices along each border of a surface."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    there = set(map(tuple, edges))
    after = {int(b): int(a) for a, b in there if (b, a) not in there}
    loops = []
    while after:
        loop = [next(iter(after))]
        while (vertex := after.pop(loop[-1])) != loop[0]:
            loop.append(vertex)
        loops.append(loop)
    return loops


def inside(name):
    """Voxels of a surface of the shipped head; its skin is closed at the mouth, and far behind."""
    mesh = meshio.read(PROJECT / f"meshes/head_{name}.ply")
    points, triangles = mesh.points, mesh.cells_dict["triangle"]
    for loop in border_loops(triangles):
        middle = points[loop].mean(axis=0)
        far = middle[1] > -60
        points = np.vstack([points, middle + (0, 10000 * far, 0)])
        fan = [[a, b, len(points) - 1] for a, b in zip(loop, np.roll(loop, -1))]
        triangles = np.vstack([triangles, fan])
    return volumes.voxels_inside(points, triangles, ORIGIN, SPACING, SIZE)


@pytest.fixture(scope="module")
def parts():
    return {name: inside(name) for name in ("skin", "skull", "mandible")}


def ct_of(parts, folder, turn=np.eye(3)):
    """The shipped head as a CT, turned in the scan."""
    bone = parts["skull"] | parts["mandible"]
    values = np.where(bone, 1000, np.where(parts["skin"], 40, -1000)).astype("<i2")
    text = ("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
            f"TransformMatrix = {' '.join(map(str, turn.T.ravel()))}\n"
            f"Offset = {' '.join(map(str, turn @ ORIGIN))}\nElementSpacing = {SPACING} {SPACING} {SPACING}\n"
            f"DimSize = {' '.join(map(str, SIZE))}\nElementType = MET_SHORT\nElementDataFile = LOCAL\n")
    file = folder / "head.mha"
    file.write_bytes(text.encode() + values.tobytes())
    return file


def segmentation_of(parts, folder):
    """The shipped head as 3D Slicer's segmentation, without bone in its soft tissue."""
    labels = parts["skin"] * 1
    labels[parts["skull"]], labels[parts["mandible"]] = 2, 3
    return volumes.write_segmentation(folder / "head.seg.nrrd", labels,
                                      ["Soft tissue", "Cranium", "Lower jaw"], ORIGIN, SPACING)


def propose(folder, environment, *arguments):
    (folder / "build").mkdir(exist_ok=True)
    (folder / "build/bin").unlink(missing_ok=True)
    (folder / "build/bin").symlink_to(programs())
    result = finish([sys.executable, SCRIPT, *arguments, "-propose"], folder,
                    environment | {"REPOSE_BUILD": "build"}, 240)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert result.stdout.startswith("understood: "), result
    assert (folder / "plan/landmarks.svg").exists()
    if can_draw():
        assert (folder / "plan/proposal.png").stat().st_size > 50000, result.stdout
        assert "plan/proposal.png" in result.stdout
    assert {path.name for path in (folder / "plan").iterdir()} < set(plan.WRITTEN)
    solved = runner(folder, environment)("repose-solve", "plan/scene.yaml", "-dry_run", "-output", "plan/model")
    assert (solved.returncode, solved.stderr) == (0, ""), solved
    assert "  warning" not in solved.stdout
    place, lips = points_of(folder / "plan/landmarks.mrk.json"), points_of(folder / "plan/model_incisions.mrk.json")
    for name, at in (("mouth_right", min(lips)), ("mouth_left", max(lips))):
        assert np.linalg.norm(lips[at] - place[name]) < 3, "lips are parted from corner to corner"
    return (folder / "plan/scene.yaml").read_text(), solved.stdout, place


def points_of(markups):
    entries = json.loads(markups.read_text())["markups"][0]["controlPoints"]
    return {entry["label"]: np.array(entry["position"]) for entry in entries}


@pytest.mark.parametrize("written", [ct_of, pytest.param(segmentation_of, marks=pytest.mark.long)])
def test_voxels_of_the_shipped_head_become_a_scene(parts, written, tmp_path, environment):
    scene, _, place = propose(tmp_path, environment, written(parts, tmp_path), "-operation",
                              "open the jaw by 6 degrees")
    assert "bone: mandible, clinical: {open: 6}" in scene
    given = json.loads((PROJECT / "meshes/head_landmarks.json").read_text())
    for side in ("left", "right"):
        name = f"condyle_{side}_center"
        assert np.linalg.norm(place[name] - given[name]) < 5


@pytest.mark.long
def test_landmarks_are_searched_on_skull_and_maxilla_together(parts, tmp_path, environment):
    z, y = (ORIGIN[axis] + SPACING * np.arange(SIZE[axis]) for axis in (2, 1))
    given, places = json.loads((PROJECT / "meshes/head_landmarks.json").read_text()), []
    for names in (["Soft tissue", "Cranium", "Lower jaw"], ["Soft tissue", "Cranium", "Lower jaw", "Maxilla"]):
        labels = parts["skin"] * 1
        labels[parts["skull"]], labels[parts["mandible"]] = 2, 3
        if "Maxilla" in names:
            front = (z < given["upper_incisor_edge"][2] + 30)[:, None, None] & (y < -30)[None, :, None]
            labels[parts["skull"] & front] = 4
        folder = tmp_path / names[-1]
        folder.mkdir()
        file = volumes.write_segmentation(folder / "head.seg.nrrd", labels, names, ORIGIN, SPACING)
        scene, _, place = propose(folder, environment, file, "-operation", "Le Fort I, overjet 3 mm")
        places.append(place)
    assert "name: maxilla" in scene and "le_fort_1" not in scene
    assert places[0].keys() == places[1].keys()
    assert max(np.linalg.norm(places[0][name] - places[1][name]) for name in places[0]) < 1e-6


@pytest.mark.long
@pytest.mark.parametrize("operation", ["genioplasty, 6 mm forward", "Le Fort I, 4 mm up, 3 degrees yaw"])
def test_a_head_that_is_turned_in_the_scan_has_the_same_plan(parts, tmp_path, environment, operation):
    turn, scenes, pieces = Rotation.from_euler("xyz", [-12, 5, -8], degrees=True).as_matrix(), [], []
    for name, axes in (("upright", np.eye(3)), ("turned", turn)):
        (tmp_path / name).mkdir()
        scene, _, _ = propose(tmp_path / name, environment, ct_of(parts, tmp_path / name, axes), "-operation",
                              operation)
        run = runner(tmp_path / name, environment)
        assert run("repose-osteotomy", "plan/scene.yaml", "-moved", "-output", "cut").returncode == 0
        moved, = (tmp_path / name).glob("cut_*_moved.ply")
        scenes.append(scene)
        pieces.append(meshio.read(moved).points @ axes)
    assert scenes[0] == scenes[1]
    assert max(cKDTree(one).query(other)[0].max() for one, other in (pieces, pieces[::-1])) < 0.3


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")
@pytest.mark.parametrize("labels", [["labels.nii.gz"], pytest.param([], marks=pytest.mark.long)])
def test_a_scene_is_proposed_that_can_be_solved(tmp_path, environment, labels):
    scene, dry, place = propose(tmp_path, environment, DATA / "head_hu.mhd",
                                *(DATA / name for name in labels), "-operation",
                                "Le Fort I, 5 mm forward, 2 up")
    assert "piece 'maxilla'" in dry
    reference = json.loads((DATA / "landmarks.json").read_text())
    for side in ("left", "right"):
        name = f"condyle_{side}_center"
        assert np.linalg.norm(place[name] - reference[name]) < 3, "parted in the joints"


@pytest.mark.long
def test_a_face_is_solved_with_its_planning_sheet(parts, tmp_path, environment):
    (tmp_path / "build").mkdir()
    (tmp_path / "build/bin").symlink_to(programs())
    result = finish([sys.executable, SCRIPT, segmentation_of(parts, tmp_path), "-operation", "open the jaw by 6 degrees",
                     "-ranks", "1"], tmp_path, environment | {"REPOSE_BUILD": "build"}, 240)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "plan/face.html" in result.stdout
    assert {path.name for path in (tmp_path / "plan").iterdir()} < set(plan.WRITTEN)
    assert last(tmp_path / "plan/face.h5")["converged"] == 1
    sheet = (tmp_path / "plan/face.html").read_text()
    assert "Not all landmarks were given" not in sheet
