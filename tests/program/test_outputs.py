"""No program replaces a file that it reads: refused in one line, and the file stays as it was."""

import shutil

import h5py
import pytest

from conftest import PROJECT

MESHES = PROJECT / "meshes"
SCENE = """skin: skin.ply
bones: [{name: skull, file: skull.ply}, {name: mandible, file: mandible.ply}]
tissue: {layers: 2}
moves: [{bone: mandible, transform: move.h5}]
"""
HEAD = ["skin.ply", "-skull", "skull.ply", "-mandible", "mandible.ply"]
PLANE = ["-point", "0", "0", "0", "-normal", "0", "0", "1"]


def write_transform(file):
    """A translation by 1 mm along y as ITK stores it."""
    with h5py.File(file, "w") as transform:
        group = transform.create_group("TransformGroup/0")
        group["TransformType"] = b"AffineTransform_double_3_3"
        group["TransformParameters"] = [1.0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0]
        group["TransformFixedParameters"] = [0.0, 0, 0]


@pytest.fixture
def inputs(tmp_path):
    """Files of a head in the working folder, some behind links; returns their contents by name."""
    for part in ("skin", "skull"):
        shutil.copy(MESHES / f"head_{part}.ply", tmp_path / f"{part}.ply")
    (tmp_path / "files").mkdir()
    shutil.copy(MESHES / "head_mandible.ply", tmp_path / "files/jaw.ply")
    (tmp_path / "mandible.ply").symlink_to("files/jaw.ply")
    (tmp_path / "scene.yaml").write_text(SCENE)
    shutil.copy(MESHES / "head_skull.ply", tmp_path / "head_skull.ply")
    shutil.copy(MESHES / "head.mrk.json", tmp_path / "known.mrk.json")
    (tmp_path / "known.csv").write_text("subnasale,0,-90,0\n")
    write_transform(tmp_path / "move.h5")
    return {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()}


@pytest.mark.quick
@pytest.mark.parametrize("program, arguments, file", [
    ("repose-solve", ["scene.yaml", "-output", "move"], "move.h5"),
    ("repose-solve", ["scene.yaml", "-output", "files/../move"], "files/../move.h5"),
    ("repose-decimate", ["skin.ply", "-triangles", "1000", "-output", "skin.ply"], "skin.ply"),
    ("repose-decimate", ["mandible.ply", "-triangles", "500", "-output", "files/jaw.ply"], "files/jaw.ply"),
    ("repose-landmarks", [*HEAD, "-landmarks", "known.mrk.json", "-output", "known"], "known.mrk.json"),
    ("repose-compare", ["skin.ply", "skin.ply", "-landmarks", "known.csv", "-output", "known"], "known.csv"),
    ("repose-osteotomy", ["head_skull.ply", *PLANE, "-piece", "skull", "-output", "head"], "head_skull.ply"),
    ("repose-register", ["skin.ply", "skin.ply", "-landmarks", "known.mrk.json", "known.mrk.json", "-output", "skin"],
     "skin.ply")])
def test_an_input_is_not_replaced(run, inputs, tmp_path, program, arguments, file):
    result = run(program, *arguments)
    assert result.returncode == 1 and result.stderr.count("\n") == 1, result
    assert f"{file}: is an input of this run and would be replaced; choose another -output" in result.stderr
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == inputs
    assert program == "repose-solve" or not result.stdout, "refused before the work"


@pytest.mark.parametrize("program, arguments, name, files", [
    ("repose-solve", ["scene.yaml"], "r.h5", {"r.h5", "r_skin.xdmf"}),
    ("repose-osteotomy", ["skull.ply", *PLANE], "r.PLY", {"r_piece.ply", "r_rest.ply"}),
    ("repose-compare", ["skin.ply", "skin.ply"], "r.csv", {"r.vtp", "r.csv"}),
    ("repose-register", ["skin.ply", "skin.ply", "-landmarks", "known.mrk.json", "known.mrk.json"], "r.tfm",
     {"r.tfm", "r.ply"}),
    ("repose-landmarks", HEAD, "r.mrk.json", {"r.mrk.json"}),
    ("repose-phantom", ["-skin_vertices", "477"], "r.yaml", {"r_skin.ply"})])
def test_the_ending_of_a_result_is_not_doubled(run, inputs, tmp_path, program, arguments, name, files):
    assert run(program, *arguments, "-output", name).returncode == 0
    made = {file.name for file in tmp_path.iterdir() if file.name.lower().startswith("r")}
    assert files <= made and not any(file.lower().startswith(f"{name.lower()}.") or
                                     file.lower().startswith(f"{name.lower()}_") for file in made), made


@pytest.mark.parametrize("program, arguments", [
    ("repose-compare", ["skin.ply", "skin.ply"]), ("repose-decimate", ["skin.ply", "-triangles", "1000"]),
    ("repose-isosurface", ["none.mhd", "-otsu"]), ("repose-landmarks", HEAD), ("repose-phantom", ["-skin_vertices", "477"]),
    ("repose-osteotomy", ["skull.ply", *PLANE]),
    ("repose-register", ["skin.ply", "skin.ply", "-landmarks", "known.mrk.json", "known.mrk.json"]),
    ("repose-scan", ["none.ply"]), ("repose-tradeoff", ["scene.yaml"])])
def test_a_missing_folder_is_refused_before_the_work(run, inputs, program, arguments):
    result = run(program, *arguments, "-output", "none/r.ply")
    assert (result.returncode, result.stdout) == (1, "") and result.stderr.count("\n") == 1, result
    assert "cannot be written: there is no folder none; make it or choose another -output" in result.stderr


@pytest.mark.parametrize("program, arguments, name", [
    ("repose-compare", ["skin.ply", "skin.ply"], "r.csv"), ("repose-landmarks", HEAD, "r.svg"),
    ("repose-phantom", ["-skin_vertices", "477"], "r_jaw_advance.yaml"),
    ("repose-osteotomy", ["skull.ply", *PLANE], "r_piece.ply"), ("repose-tradeoff", ["scene.yaml"], "r_map.csv")])
def test_a_folder_in_place_of_any_file_is_refused_before_the_work(run, inputs, tmp_path, program, arguments, name):
    (tmp_path / name).mkdir()
    result = run(program, *arguments, "-output", "r")
    assert (result.returncode, result.stdout) == (1, "") and result.stderr.count("\n") == 1, result
    assert f"{name}: is a folder; remove it or choose another -output" in result.stderr


def test_a_file_in_place_of_the_folder_of_a_page_is_refused(run, inputs):
    result = run("repose-paper", "-output", "skin.ply", "-meshes", MESHES)
    assert (result.returncode, result.stdout) == (1, ""), result
    assert "skin.ply: cannot be made: " in result.stderr and "; choose another -output" in result.stderr


@pytest.mark.parametrize("name", ["folder/", ".", "a\tb"])
def test_names_that_are_none_are_refused(run, inputs, tmp_path, name):
    result = run("repose-solve", "scene.yaml", "-output", name)
    assert result.returncode == 1 and result.stderr.count("\n") == 1
    assert "is no name of files" in result.stderr
    assert {file for file in tmp_path.rglob("*") if file.is_file()} == set(inputs)


def test_a_run_removes_what_a_killed_one_left_of_each_file(run, inputs, tmp_path):
    """A killed run may leave a part of any file that it writes."""
    solve = ["scene.yaml", "-output", "face", "-checkpoint_interval", "1e9"]
    assert run("repose-solve", *solve).returncode == 0
    written = {file.name for file in tmp_path.iterdir() if file.name.startswith("face")}
    assert {"face.h5", "face_skin.xdmf", "face_blocks.xdmf"} <= written, written
    for name in written:
        (tmp_path / f"{name}.1.part").touch()
    assert run("repose-solve", *solve).returncode == 0
    assert not list(tmp_path.glob("*.part"))
