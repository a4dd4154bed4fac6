"""The panel for 3D Slicer: its description, and the program behind it called as Slicer calls it."""

import base64
import importlib.util
import io
import json
import os
import re
import signal
import subprocess
import time
import xml.etree.ElementTree

import h5py
import numpy as np
import pytest

from conftest import PROJECT, TIME_LIMIT, finish, programs, shipped
from tissue import last, model_of

PANEL = PROJECT / "drivers/slicer/Repose"
MESHES = PROJECT / "meshes"
FILES = {"geometry": {".ply", ".vtp"}, "transform": {".tfm", ".h5"}, "pointfile": {".mrk.json"},
         "file": {".h5"}}
VALUES = {"integer", "double", "boolean", "string", "string-vector", "string-enumeration"}


# ----- as Slicer writes files


def triangles_of(file):
    """Points and triangles of one of our own ASCII or binary PLY files."""
    data = file.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    points, faces = (int(n) for n in re.findall(rb"element \w+ (\d+)", head))
    kind = "<f8" if b"property double x" in head else "<f4"
    if b"format ascii" in head:
        rows = body.split(b"\n")
        return (np.array([row.split()[:3] for row in rows[:points]], float),
                np.array([row.split()[1:4] for row in rows[points:points + faces]], int))
    size = 3 * points * np.dtype(kind).itemsize
    corners = np.frombuffer(body, np.dtype([("n", "u1"), ("corner", "<i4", 3)]), faces, size)
    return np.frombuffer(body, kind, 3 * points).reshape(-1, 3).astype(float), corners["corner"]


def slicer_ply(file, points, triangles, space="LPS", binary=False):
    """A model as vtkPLYWriter writes it for Slicer: float32, the coordinate system as a comment."""
    if space == "RAS":
        points = points * (-1, -1, 1)
    layout = "binary_little_endian" if binary else "ascii"
    head = (f"ply\nformat {layout} 1.0\ncomment VTK generated PLY File\ncomment SPACE={space}\n"
            f"obj_info vtkPolyData points and polygons: vtk4.0\nelement vertex {len(points)}\n"
            "property float x\nproperty float y\nproperty float z\n"
            f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    if binary:
        faces = np.zeros(len(triangles), [("n", "u1"), ("corner", "<i4", 3)])
        faces["n"], faces["corner"] = 3, triangles
        body = points.astype("<f4").tobytes() + faces.tobytes()
    else:
        body = "".join("%g %g %g \n" % tuple(p) for p in points)
        body = (body + "".join("3 %d %d %d \n" % tuple(t) for t in triangles)).encode()
    file.write_bytes(head.encode() + body)
    return file


def slicer_transform(file, motion):
    """A 4×4 motion of a bone in LPS as Slicer saves it: its inverse, by ITK."""
    back = np.linalg.inv(motion)
    numbers = [*back[:3, :3].ravel(), *back[:3, 3]]
    if file.suffix == ".tfm":
        file.write_text("#Insight Transform File V1.0\n#Transform 0\n"
                        "Transform: AffineTransform_double_3_3\n"
                        f"Parameters: {' '.join(map(repr, map(float, numbers)))}\n"
                        "FixedParameters: 0 0 0\n")
        return file
    with h5py.File(file, "w") as h5:
        text = h5py.string_dtype("ascii")
        for name, value in (("ITKVersion", "5.4.0"), ("HDFVersion", "1.14.3"), ("OSName", "Linux")):
            h5.create_dataset(name, (1,), text, [value])
        group = h5.create_group("TransformGroup/0")
        group.create_dataset("TransformType", (1,), text, ["AffineTransform_double_3_3"])
        group["TransformParameters"], group["TransformFixedParameters"] = numbers, np.zeros(3)
    return file


def slicer_curve(file, points, space="LPS"):
    turned = np.array(points) * ((-1, -1, 1) if space == "RAS" else 1)
    schema = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/" \
             "Resources/Schema/markups-schema-v1.0.3.json#"
    controls = [{"id": str(i), "label": f"C-{i}", "description": "", "associatedNodeID": "",
                 "position": list(p), "orientation": [-1, 0, 0, 0, -1, 0, 0, 0, 1],
                 "selected": True, "locked": False, "visibility": True, "positionStatus": "defined"}
                for i, p in enumerate(turned, 1)]
    markup = {"type": "Curve", "coordinateSystem": space, "coordinateUnits": "mm", "locked": False,
              "labelFormat": "%N-%d", "controlPoints": controls, "measurements": [],
              "display": {"visibility": True, "opacity": 1.0}}
    file.write_text(json.dumps({"@schema": schema, "markups": [markup]}, indent=4))
    return file


FORWARD = np.array([[1, 0, 0, 1], [0, 1, 0, -4], [0, 0, 1, 0.5], [0, 0, 0, 1]], float)


@pytest.fixture
def head(tmp_path):
    """head(space, ending, …) → arguments for skin, two bones and the mandible's transform."""

    def arguments(space="LPS", ending=".tfm", binary=False):
        given = []
        for name, mesh in (("skin", "skin"), ("bone1", "skull"), ("bone2", "mandible")):
            file = tmp_path / f"{name}_vtkMRMLModelNode{space}.ply"
            slicer_ply(file, *triangles_of(MESHES / f"paper_{mesh}.ply"), space, binary)
            given += [f"--{name}", file]
        return given + ["--transform2", slicer_transform(tmp_path / f"jaw{ending}", FORWARD),
                        "--processors", 1]

    return arguments


@pytest.fixture
def panel(tmp_path, environment):
    """panel(*arguments) → CompletedProcess, in Slicer's surroundings: with its own libraries and
    its own Python's home, none of which may reach ours."""
    for folder in ("temporary", "libraries", "python"):
        (tmp_path / folder).mkdir()
    needed = subprocess.check_output(["ldd", programs() / "repose-solve"], text=True)
    for library in set(re.findall(r"lib(?:fmt|yaml-cpp|hdf5_openmpi)\.so[.\d]*", needed)):
        (tmp_path / "libraries" / library).write_text("of another version")
    (tmp_path / "python/h5py.py").write_text("raise SystemExit('of another version')")
    surroundings = environment | {
        "REPOSE_BUILD": str(programs().parent), "TMPDIR": str(tmp_path / "temporary"),
        "LD_LIBRARY_PATH": str(tmp_path / "libraries"), "PYTHONHOME": str(tmp_path / "python"),
        "PYTHONPATH": str(tmp_path / "python")}

    def run_panel(*arguments, wait=True):
        command = [str(PANEL), *map(str, arguments)]
        if wait:
            return finish(command, tmp_path, surroundings, TIME_LIMIT)
        return subprocess.Popen(command, cwd=tmp_path, env=surroundings, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    return run_panel


def returned(file):
    return dict(line.split(" = ", 1) for line in file.read_text().splitlines())


def read_vtp(file):
    """All arrays of a .vtp as the panel writes it."""
    found = {}
    for item in xml.etree.ElementTree.parse(file).iter():
        if item.tag == "DataArray":
            raw = base64.b64decode(item.text)
            assert int(np.frombuffer(raw, "<u8", 1)[0]) == len(raw) - 8
            values = np.frombuffer(raw[8:], "<i8" if item.get("type") == "Int64" else "<f8")
            found[item.get("Name")] = values.reshape(-1, int(item.get("NumberOfComponents", 1)))
        elif item.tag == "Array":
            found[item.get("Name")] = "".join(chr(int(c)) for c in item.text.split()).rstrip("\0")
    return found


# ----- the description


def groups():
    return list(xml.etree.ElementTree.parse(PANEL.with_suffix(".xml")).getroot().iter("parameters"))


@pytest.mark.quick
def test_description_has_the_shape_that_slicer_reads():
    root = xml.etree.ElementTree.parse(PANEL.with_suffix(".xml")).getroot()
    heads = [item.tag for item in root if item.tag != "parameters"]
    assert heads == ["category", "title", "description", "version", "documentation-url", "license",
                     "contributor", "acknowledgements"]
    names = []
    for group in groups():
        assert [item.tag for item in group][:2] == ["label", "description"]
        for item in list(group)[2:]:
            names.append(item.findtext("name"))
            assert item.tag in FILES.keys() | VALUES, item.tag
            assert re.fullmatch("[a-zA-Z][a-zA-Z0-9]*", names[-1])
            assert item.findtext("label") and item.findtext("description")
            given_back = item.findtext("channel") == "output" and item.tag not in FILES
            assert item.findtext("longflag") == (None if given_back else f"--{names[-1]}")
            assert item.find("default") is not None or item.tag in FILES
            if item.tag in FILES:
                assert item.findtext("channel") in ("input", "output")
                assert set(item.get("fileExtensions").split(",")) <= FILES[item.tag]
    assert len(set(names)) == len(names) > 20


def ctk_cli_reads(text):
    return pytest.importorskip("ctk_cli").CLIModule(stream=io.StringIO(text))


def slicer_cli_web_reads(text):
    return pytest.importorskip("slicer_cli_web.cli_utils").as_model(text)


@pytest.mark.parametrize("read", [ctk_cli_reads, slicer_cli_web_reads])
def test_others_read_the_description(read):
    """pip install ctk-cli; pip install --no-deps girder-slicer-cli-web."""
    module = read(PANEL.with_suffix(".xml").read_text())
    arguments, options, outputs = module.classifyParameters()
    assert module.title == "Repose" and not arguments
    assert {p.name for p in options} >= {"skin", "bone4", "transform4", "lips", "predictedSkin"}
    assert [p.name for p in outputs][0] == "verdict"
    by_name = {p.name: p for p in module.parameters()}
    assert by_name["accuracy"].parseValue(by_name["accuracy"].default) == 0.1
    assert by_name["boneNames"].isVector() and by_name["transform1"].subtype == "linear"
    assert by_name["lips"].coordinateSystem == "lps"


def test_description_is_printed(panel):
    result = panel("--xml")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout == PANEL.with_suffix(".xml").read_text()


# ----- the program


@pytest.mark.parametrize("ending", [".tfm", ".h5"])
def test_round_trip_is_the_scene_that_a_person_would_write(panel, head, run, tmp_path, ending):
    names = ["predictedSkin", "movedBone1", "movedBone2", "resultFile", "returnparameterfile"]
    outputs = {name: tmp_path / name for name in names}
    result = panel(*head(ending=ending), "--boneNames", "skull,jaw", "--accuracy", 0.01,
                   *[word for item in outputs.items() for word in (f"--{item[0]}", item[1])])
    assert (result.returncode, result.stderr) == (0, "")
    (tmp_path / "same.yaml").write_text(
        "skin: skin_vtkMRMLModelNodeLPS.ply\nbones:\n"
        "  - {name: skull, file: bone1_vtkMRMLModelNodeLPS.ply}\n"
        "  - {name: jaw, file: bone2_vtkMRMLModelNodeLPS.ply}\n"
        "tissue: {layers: 4, material: {preset: face}}\n"
        "moves: [{bone: jaw, translate: [1, -4, 0.5]}]\n")
    assert run("repose-solve", "same.yaml", "-accuracy", 0.01).returncode == 0
    step, model = last(tmp_path / "same.h5"), model_of(tmp_path / "same.h5")
    skin = read_vtp(outputs["predictedSkin"])
    used = np.unique(model["skin/points"])
    assert np.abs(skin["Points"] - step["point/position"][used]).max() < 1e-9
    assert np.array_equal(used[skin["connectivity"].reshape(-1, 3)], model["skin/points"])
    assert np.abs(skin["displacement"] - step["point/displacement"][used]).max() < 1e-9
    assert np.array_equal(skin["displacement_magnitude"][:, 0],
                          np.linalg.norm(skin["displacement"], axis=1))
    assert skin["SPACE"] == "LPS" and skin["uncertainty"].max() <= 0.01
    skull, jaw = (read_vtp(outputs[f"movedBone{i}"])["Points"] for i in (1, 2))
    assert np.abs(skull - model["bone_surface/0/points"]).max() == 0
    assert np.abs(jaw - model["bone_surface/1/points"] - (1, -4, 0.5)).max() < 1e-9
    kept = last(outputs["resultFile"])["point/position"]
    assert np.abs(kept - step["point/position"]).max() < 1e-9
    numbers = returned(outputs["returnparameterfile"])
    assert "accuracy reached" in numbers["verdict"] and numbers["invertedPrisms"] == "0"
    assert float(numbers["accuracyReached"]) == pytest.approx(step["displacement_error"], rel=1e-5)
    assert float(numbers["largestMovement"]) == pytest.approx(
        np.linalg.norm(step["point/displacement"][used], axis=1).max(), rel=1e-5)


@pytest.mark.quick
@pytest.mark.parametrize("ending", [".tfm", ".h5"])
def test_transforms_that_itk_writes_move_the_bone(panel, head, tmp_path, ending):
    """By the library that Slicer writes them with: pip install SimpleITK."""
    itk = pytest.importorskip("SimpleITK")
    transform = itk.AffineTransform(3)
    transform.Rotate(1, 2, -0.05)
    transform.SetTranslation([-1.0, 3.0, -0.5])
    transform.SetCenter([0.0, -40.0, -20.0])
    given = head(ending=ending)
    itk.WriteTransform(transform, str(tmp_path / f"jaw{ending}"))
    result = panel(*given, "--predictedSkin", tmp_path / "skin.vtp", "--movedBone2",
                   tmp_path / "jaw.vtp")
    assert (result.returncode, result.stderr) == (0, "")
    before, _ = triangles_of(tmp_path / "bone2_vtkMRMLModelNodeLPS.ply")
    back = transform.GetInverse()
    expected = [back.TransformPoint(list(map(float, point))) for point in before]
    assert np.abs(read_vtp(tmp_path / "jaw.vtp")["Points"] - expected).max() < 1e-3


def test_vtk_reads_the_skin_and_slicers_turn_takes_its_vectors_along(panel, head, tmp_path):
    if importlib.util.find_spec("vtkmodules") is None:
        pytest.skip("VTK is not installed (pip install vtk)")
    import vtkmodules.all as vtk
    from vtkmodules.util.numpy_support import vtk_to_numpy
    assert panel(*head(), "--predictedSkin", tmp_path / "skin.vtp").returncode == 0
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "skin.vtp"))
    turn = vtk.vtkTransformPolyDataFilter()
    flip = vtk.vtkTransform()
    flip.Scale(-1, -1, 1)
    turn.SetTransform(flip)
    turn.SetInputConnection(reader.GetOutputPort())
    turn.Update()
    known, seen = read_vtp(tmp_path / "skin.vtp"), turn.GetOutput()
    assert seen.GetFieldData().GetAbstractArray("SPACE").GetValue(0) == "LPS"
    for name, array in (("Points", seen.GetPoints().GetData()),
                        ("displacement", seen.GetPointData().GetArray("displacement"))):
        assert np.allclose(vtk_to_numpy(array), known[name] * (-1, -1, 1), atol=1e-4), name


@pytest.mark.parametrize("binary", [False, True])
def test_models_and_curves_in_ras_give_the_same_face(panel, head, tmp_path, binary):
    cut = [[47, -80, 8], [49, -75, -8], [46.5, -70, -24]]
    for space in ("LPS", "RAS"):
        curve = slicer_curve(tmp_path / f"cut_{space}.mrk.json", cut, space)
        result = panel(*head(space, binary=binary), "--lips", curve, "--predictedSkin",
                       tmp_path / f"{space}.vtp")
        assert (result.returncode, result.stderr) == (0, "")
        assert "accuracy reached" in result.stdout and "doubled in 4 layers" in result.stdout
    lps, ras = (read_vtp(tmp_path / f"{space}.vtp") for space in ("LPS", "RAS"))
    assert np.abs(lps["Points"] - ras["Points"]).max() < 1e-3
    assert len(lps["Points"]) > len(triangles_of(MESHES / "paper_skin.ply")[0])


@pytest.mark.parametrize("end", [b"\n", b"\r\n"], ids=["Unix", "Windows"])
@pytest.mark.parametrize("name", ["face.ply", "FACE.PLY"])
@pytest.mark.parametrize("binary", [False, True])
def test_a_model_in_ras_is_turned_whatever_its_line_ends(program, tmp_path, binary, name, end):
    points, triangles = np.array([[1, 2, 3], [4, -5, 6], [7, 8, -9.5]]), np.array([[0, 1, 2]])
    file = slicer_ply(tmp_path / name, points, triangles, "RAS", binary)
    head, mark, body = file.read_bytes().partition(b"end_header\n")
    file.write_bytes((head + mark).replace(b"\n", end) + (body if binary else body.replace(b"\n", end)))
    (tmp_path / "scene").mkdir()
    turned = tmp_path / "scene" / program["link"](file, tmp_path / "scene", "skin")
    content = turned.read_bytes().replace(b"\r\n", b"\n")
    assert b"SPACE=LPS" in content and b"SPACE=RAS" not in content
    turned.write_bytes(content)
    for one, other in zip(triangles_of(turned), (points, triangles)):
        assert np.array_equal(one, other)


def test_a_damaged_model_in_ras_is_refused(program, tmp_path):
    file = slicer_ply(tmp_path / "face.ply", np.zeros((3, 3)), np.array([[0, 1, 2]]), "RAS", True)
    file.write_bytes(file.read_bytes()[:-35])
    with pytest.raises(program["Refusal"], match="face.ply: damaged, or not a PLY file"):
        program["link"](file, tmp_path, "skin")


@pytest.mark.parametrize("name, head", [("face.STL", b"3D Slicer output. SPACE=RAS".ljust(84, b"\0")),
                                        ("face.obj", b"# 3D Slicer output. SPACE=RAS\nv 0 0 0\n")])
def test_a_model_in_ras_that_is_not_converted_is_refused(program, tmp_path, name, head):
    (tmp_path / name).write_bytes(head)
    with pytest.raises(program["Refusal"], match=f"{name}: in RAS, .*save it as LPS or as PLY"):
        program["link"](tmp_path / name, tmp_path, "skin")


@pytest.mark.quick
def test_the_lips_are_the_scenes_mouth_and_a_cut_is_an_incision(panel, head, tmp_path):
    """The solver names what it refuses: so much of a scene that the panel writes is seen."""
    short = slicer_curve(tmp_path / "short.mrk.json", [[47.0, -80.0, 8.0]], "LPS")
    for flag, key in (("--lips", "mouth.path"), ("--incision", "incisions[0].path")):
        result = panel(*head(), flag, short, "--predictedSkin", tmp_path / "skin.vtp")
        assert result.returncode != 0 and key in result.stderr, (key, result.stderr)


def test_progress_only_grows_and_ends(panel, head, tmp_path):
    result = panel(*head(), "--tissue", "springs", "--accuracy", 1e-6, "--predictedSkin",
                   tmp_path / "skin.vtp")
    report = [float(t) for t in re.findall("<filter-progress>(.*?)</filter-progress>", result.stdout)]
    assert report == sorted(report) and report[-1] == 1 and len(set(report)) > 3
    assert all(0 <= share <= 1 for share in report)


def test_a_missed_accuracy_is_handed_over_and_says_so(panel, head, tmp_path):
    result = panel(*head(), "--accuracy", 1e-6, "--timeLimit", 1e-6, "--predictedSkin",
                   tmp_path / "skin.vtp", "--returnparameterfile", tmp_path / "numbers.params")
    assert (result.returncode, result.stderr) == (0, "")
    message = returned(tmp_path / "numbers.params")["verdict"]
    assert message.startswith("ACCURACY NOT REACHED") and message in result.stdout
    assert len(read_vtp(tmp_path / "skin.vtp")["Points"]) == 477


def test_help_lists_every_flag(panel):
    result = panel("--help")
    assert (result.returncode, result.stderr) == (0, "")
    assert {"--skin", "--bone1", "--accuracy", "--predictedSkin"} <= set(result.stdout.split())


WRONG = {"no skin": ([], "no skin is chosen"),
         "unknown flag": (["--sknn", "x"], "--sknn: unknown"),
         "no value": (["--skin"], "--skin: a value is missing"),
         "not a number": (["--accuracy", "fine"], "--accuracy fine: give a number from 1e-6 to 10"),
         "out of range": (["--layers", "1"], "--layers 1: give a whole number from 2 to 64"),
         "unknown tissue": (["--tissue", "steel"], "take one of face, skin_on_fat"),
         "missing file": (["--skin", "none.ply", "--bone1", MESHES / "paper_skull.ply"],
                          "none.ply: no such file"),
         "folder": (["--skin", MESHES, "--bone1", MESHES / "paper_skull.ply"], "is a folder, expected a file"),
         "no bone": (["--skin", MESHES / "paper_skin.ply"], "no bone is chosen"),
         "no model": (["--skin", MESHES / "paper_skin.ply", "--transform3", "t.tfm"],
                      "bone 3 has a transform and no model"),
         "not a mesh": (["--skin", PANEL.with_suffix(".xml"), "--bone1",
                         MESHES / "paper_skull.ply"], "skin.xml")}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_in_one_line(panel, tmp_path, case):
    arguments, part = WRONG[case]
    result = panel("--predictedSkin", tmp_path / "skin.vtp", *arguments)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1 and part in result.stderr, result.stderr
    assert str(tmp_path / "temporary") not in result.stderr
    assert not (tmp_path / "skin.vtp").exists()
    assert list((tmp_path / "temporary").iterdir()) == []


def test_the_panel_does_not_replace_a_model_that_it_reads(panel, head, tmp_path):
    arguments = head()
    for flag in ("--predictedSkin", "--movedBone2", "--resultFile"):
        content = arguments[1].read_bytes()
        result = panel(*arguments, flag, arguments[1])
        assert result.returncode == 1 and "is an input of this run" in result.stderr, result
        assert len(result.stderr.splitlines()) == 1 and arguments[1].read_bytes() == content


def test_two_outputs_of_one_file_are_refused(panel, head, tmp_path):
    (tmp_path / "folder").mkdir()
    for first, second in (("--predictedSkin", "--movedBone2"), ("--movedBone1", "--returnparameterfile")):
        result = panel(*head(), first, tmp_path / "a.vtp", second, tmp_path / "folder/../a.vtp")
        assert result.returncode == 1 and len(result.stderr.splitlines()) == 1, result
        assert f"{second} {tmp_path}/folder/../a.vtp: is the file of {first}, too; choose another one" in result.stderr
        assert not (tmp_path / "a.vtp").exists()


def test_a_moved_model_of_no_bone_is_refused(panel, head, tmp_path):
    result = panel(*head(), "--movedBone4", tmp_path / "bone4.vtp")
    assert (result.returncode, result.stderr) == (
        1, "Repose: bone 4 has a moved model to write and no model; choose one\n")


def test_a_preview_says_that_it_is_one(panel, head, tmp_path):
    result = panel(*head(), "--preview", "--accuracy", 0.1, "--predictedSkin",
                   tmp_path / "skin.vtp", "--returnparameterfile", tmp_path / "numbers")
    assert (result.returncode, result.stderr) == (0, "")
    numbers = returned(tmp_path / "numbers")
    assert re.match(r"PREVIEW, to 1 mm: the face is within \S+ mm of rest", numbers["verdict"])
    assert "accuracy reached" not in numbers["verdict"]
    assert float(numbers["accuracyReached"]) <= 1
    assert numbers["meshError"] == "-1", "no coarse model of a skin of less than 4000 vertices"
    report = read_vtp(tmp_path / "skin.vtp")["uncertainty"]
    assert np.ptp(report) == 0 and report[0, 0] == pytest.approx(float(numbers["accuracyReached"]), rel=1e-5)


@pytest.fixture(scope="module")
def program():
    """The program behind the panel as a module."""
    text = (PANEL.parent / "lib/run.py").read_text()
    names = {"__file__": str(PANEL.parent / "lib/run.py"), "__name__": "panel"}
    exec(compile(text.removesuffix("sys.exit(main())\n"), "run.py", "exec"), names)
    return names


@pytest.mark.quick
@pytest.mark.parametrize("status", [0, 2])
@pytest.mark.parametrize("error", [0.05, 0.1, 0.2, np.inf])
@pytest.mark.parametrize("preview", [False, True])
def test_an_accuracy_is_claimed_only_where_it_is_reached(program, status, error, preview):
    report = {"load": 1.0, "displacement_error": error, "reason": b"why", "converged": 0, "inverted_prisms": 1}
    message = program["verdict"](status, report, 0.1, preview)
    reached = status == 0 and error <= 0.1
    assert message.startswith("ACCURACY NOT REACHED" if not reached else
                           "PREVIEW, to 0.1 mm" if preview else "accuracy reached: ")


def test_a_folded_rest_position_is_named_as_such(program):
    report = {"load": 1.0, "displacement_error": 0.05, "reason": b"why", "converged": 1, "inverted_prisms": 3}
    assert program["verdict"](2, report, 0.1, False).startswith("FOLDED: 3 prisms of tissue are inside out")


@pytest.fixture
def long_run(panel, tmp_path):
    """A run of the panel that has begun to search, and its solver's process."""
    turn = np.eye(4)
    turn[1:3, 1:3] = [[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]]
    process = panel("--skin", MESHES / "head_skin.ply", "--bone1", MESHES / "head_skull.ply",
                    "--bone2", MESHES / "head_mandible.ply",
                    "--transform2", slicer_transform(tmp_path / "open.tfm", turn),
                    "--accuracy", 1e-6, "--layers", 8, "--processors", 2,
                    "--predictedSkin", tmp_path / "skin.vtp", wait=False)
    for line in process.stdout:
        if line.startswith("<filter-progress>"):
            break
    children = f"/proc/{process.pid}/task/{process.pid}/children"
    with open(children, encoding="ascii") as file:
        solver = int(file.read().split()[0])
    yield process, solver
    process.kill()
    process.communicate()


def wait_for_end(pid, seconds=60):
    """Returns whether a process that is not a child ends."""
    for _ in range(10 * seconds):
        try:
            with open(f"/proc/{pid}/stat", encoding="ascii") as file:
                if file.read().rsplit(")", 1)[1].split()[0] == "Z":
                    return True
        except FileNotFoundError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.parametrize("signals", [["TERM"], *(pytest.param(more, marks=pytest.mark.long) for more in (
    ["INT"], ["HUP"], ["TERM", "INT", "TERM", "HUP"]))])
def test_cancel_ends_the_solver_and_hands_nothing_over(long_run, tmp_path, signals):
    process, solver = long_run
    for name in signals:
        process.send_signal(signal.Signals[f"SIG{name}"])
        time.sleep(0.05)
    process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert wait_for_end(solver)
    assert not (tmp_path / "skin.vtp").exists()
    assert list((tmp_path / "temporary").iterdir()) == []


def test_a_killed_panel_leaves_no_solver_and_the_next_one_no_folder(long_run, panel, tmp_path):
    process, solver = long_run
    (running,) = (tmp_path / "temporary").glob("repose_*")  # beside mpirun's own
    assert panel("--skin", "none.ply").returncode == 1
    assert running.exists(), "of a run that lives"
    os.kill(process.pid, signal.SIGKILL)
    assert wait_for_end(solver)
    process.wait()
    assert panel("--skin", "none.ply").returncode == 1
    assert not running.exists()


@pytest.mark.parametrize("tissue", [e.text for e in xml.etree.ElementTree.parse(
    PANEL.with_suffix(".xml")).getroot().find(".//*[name='tissue']").findall("element")])
def test_every_tissue_of_the_panel_is_one_of_the_scenes(panel, head, tmp_path, tissue):
    result = panel(*head(), "--tissue", tissue, "--accuracy", 1, "--predictedSkin",
                   tmp_path / "skin.vtp")
    assert (result.returncode, result.stderr) == (0, "")


def test_uncertainty_is_told_point_by_point(panel, head, tmp_path):
    result = panel(*head(), "--uncertainty", "--predictedSkin", tmp_path / "skin.vtp",
                   "--resultFile", tmp_path / "face.h5",
                   "--returnparameterfile", tmp_path / "numbers")
    assert (result.returncode, result.stderr) == (0, "")
    step = last(tmp_path / "face.h5")
    used = np.unique(model_of(tmp_path / "face.h5")["skin/points"])
    wanted = step["displacement_error"] + step["point/discretisation_error"][used]
    report = read_vtp(tmp_path / "skin.vtp")["uncertainty"][:, 0]
    assert np.abs(report - wanted).max() < 1e-12 and report.max() > 10 * report.min()
    numbers = returned(tmp_path / "numbers")
    assert float(numbers["meshError"]) == pytest.approx(step["discretisation_error"], rel=1e-5)
    assert float(numbers["accuracyReached"]) == pytest.approx(step["displacement_error"], rel=1e-5)


def test_several_processors(panel, head, tmp_path):
    arguments = head()[:-1] + [2]
    result = panel(*arguments, "--predictedSkin", tmp_path / "skin.vtp")
    assert (result.returncode, result.stderr) == (0, "")
    assert "on 2 ranks" in result.stdout


def test_the_given_model_comes_back_displaced(program, run, tmp_path):
    """Where a remeshed part of the skin was solved, all of the chosen model is returned."""
    (tmp_path / "part.yaml").write_text(shipped("head_jaw_opening.yaml", layers=2, edge=8))
    assert run("repose-solve", "part.yaml", "-accuracy", 1).returncode == 0
    with h5py.File(tmp_path / "part.h5") as h5:
        points, triangles, arrays = program["skin_to_hand_back"](h5)
        reached = h5["step"][sorted(h5["step"])[-1]].attrs["displacement_error"]
    given = read_vtp(tmp_path / "part_given_skin.vtp")
    assert np.array_equal(points, given["Points"] + given["displacement"])
    assert np.array_equal(triangles, given["connectivity"].reshape(-1, 3))
    assert np.array_equal(arrays["computed"], given["solved"].ravel())
    assert np.array_equal(arrays["uncertainty"], reached * (arrays["computed"] > 0))
    assert arrays["displacement_magnitude"].max() > 5
