"""NAME.h5 as a VTKHDF file: what VTK and ParaView open is what HDF5 holds, stored once."""

import os
import shutil
import sys

import h5py
import numpy as np
import pytest

from conftest import PROJECT, finish
from read_back import shown_name
from tissue import last, model_of, steps, write_model

OPENING = "paper_jaw_opening.yaml"
MOVING = {"PointData/displacement (mm)": "point/displacement", "PointData/advance (mm)": "point/advance",
          "PointData/residual_force (N)": "point/residual_force",
          "CellData/volume_ratio": "prism/volume_ratio", "Points": "point/position"}
STAYING = {"PointData/set": "point/set", "PointData/layer": "point/layer",
           "PointData/column": "point/column", "PointData/initial_position (mm)": "point/position"}
OF_BONES = {"CellData/bone": "bone_surfaces/bone",
            "PointData/initial_position (mm)": "bone_surfaces/points",
            "PointData/displacement (mm)": "bone_surface/displacement"}


@pytest.fixture
def opening(solved):
    file = solved(OPENING, "-load_steps", 3)
    assert len(steps(file)) >= 4
    return file


def where_bones_are(model, step):
    return step.get("bone_surface/points", model["bone_surfaces/points"])


def of_both_parts(name, tissue, model, step, bones_rows):
    """An array of the tissue followed by what the bones have of it."""
    if name == "Points":
        bones = where_bones_are(model, step)
    elif name in OF_BONES:
        bones = {**model, **step}[OF_BONES[name]]
    else:
        bones = np.full((bones_rows, *tissue.shape[1:]),
                        np.nan if tissue.dtype.kind == "f" else -1, tissue.dtype)
    return np.concatenate([tissue, bones])


def same(one, other):
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


def test_what_moves_is_every_step_and_what_stays_is_the_models(opening):
    path, model = steps(opening), model_of(opening)
    with h5py.File(opening) as h5:
        root = h5["VTKHDF"]
        assert root.attrs["Type"] == b"UnstructuredGrid" and list(root.attrs["Version"]) == [2, 0]
        prisms, faces = len(model["prism/points"]), len(model["bone_surfaces/triangles"])
        bones = {"PointData": len(model["bone_surfaces/points"]), "CellData": faces}
        assert np.array_equal(root["Connectivity"][:], np.concatenate(
            [model["prism/points"].ravel(), model["bone_surfaces/triangles"].ravel()]))
        assert np.array_equal(root["Offsets"][:], np.concatenate(
            [np.arange(0, 6 * prisms + 1, 6), np.arange(0, 3 * faces + 1, 3)]))
        assert root["Types"].dtype == np.uint8
        assert np.array_equal(root["Types"][:], [13] * prisms + [5] * faces)
        assert root["Steps"].attrs["NSteps"] == len(path)
        assert list(root["Steps/Values"][:]) == [step["load"] for step in path]
        for name, array in MOVING.items():
            rows = bones.get(name.split("/", maxsplit=1)[0])
            assert same(root[name][:], np.concatenate(
                [of_both_parts(name, step[array], model, step, rows) for step in path])), name
        for name, array in STAYING.items():
            rows = bones[name.split("/", maxsplit=1)[0]]
            assert same(root[name][:], of_both_parts(name, model[array], model, {}, rows)), name
        assert np.array_equal(root["CellData/bone"][:prisms], np.full(prisms, -1))
        assert np.array_equal(root["CellData/bone"][prisms:], model["bone_surfaces/bone"])
        names = {f"{place}/{name}" for place in ("PointData", "CellData") for name in root[place]}
        assert names == (MOVING.keys() | STAYING.keys() | OF_BONES.keys()) - {"Points"}
        for place in ("PointData", "CellData"):
            assert set(root[f"Steps/{place}Offsets"]) == set(root[place])


@pytest.mark.quick
def test_bones_have_their_motion_at_every_step(opening):
    """Finite, and that which the plan says: a screw about the jaw's hinge."""
    model = model_of(opening)
    before, count = model["bone_surfaces/points"], len(model["point/position"])
    jaw = np.zeros(len(before), bool)
    jaw[model["bone_surfaces/triangles"][model["bone_surfaces/bone"] == 1]] = True
    with h5py.File(opening) as h5:
        root = h5["VTKHDF"]
        for begin, load in zip(root["Steps/PointDataOffsets/displacement (mm)"][:],
                               root["Steps/Values"][:]):
            shown = root["PointData/displacement (mm)"][begin + count:begin + count + len(before)]
            c, s = np.cos(np.radians(8 * load)), np.sin(np.radians(8 * load))
            turned = before @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T
            assert np.isfinite(shown).all() and (shown[~jaw] == 0).all()
            assert np.abs(shown[jaw] - (turned - before)[jaw]).max() < 1e-9


def test_nothing_is_stored_twice(opening):
    with h5py.File(opening) as h5:
        root = h5["VTKHDF"]
        for name in [*MOVING, *STAYING, *OF_BONES, "Connectivity"]:
            assert root[name].is_virtual, name
            assert root[name].id.get_storage_size() == 0, name
            assert {source.file_name for source in root[name].virtual_sources()} == {"."}
        cells = sum(root["NumberOfCells"])
        held = {}
        root.visititems(lambda name, item: held.update({name: item.id.get_storage_size()})
                        if isinstance(item, h5py.Dataset) else None)
    assert sum(held.values()) < 9 * cells + 4096


def test_pressures_of_a_solid_are_shown(solved):
    with h5py.File(solved("head_solid.yaml", "-accuracy", 1)) as h5:
        shows(h5, "pressure")


def shows(h5, name, place="prism"):
    place_there = "PointData" if place == "point" else "CellData"
    shown = shown_name(name)
    first = h5[f"VTKHDF/Steps/{place_there}Offsets/{shown}"][:]
    for begin, step in zip(first, sorted(h5["step"])):
        stored = h5["step"][step][place][name][:]
        assert np.array_equal(h5["VTKHDF"][place_there][shown][begin:begin + len(stored)], stored)


def test_advance_is_the_way_along_the_normal_of_the_skin_above(opening):
    step, model = last(opening), model_of(opening)
    x, column = model["point/position"], model["point/column"]
    a, b, c = (x[model["skin/points"][:, k]] for k in range(3))
    normal = np.zeros((column.max() + 1, 3))
    for k in range(3):
        np.add.at(normal, column[model["skin/points"][:, k]], np.cross(b - a, c - a))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    expected = (step["point/displacement"] * normal[column]).sum(1)
    assert np.abs(step["point/advance"] - expected).max() < 1e-12 and abs(expected).max() > 1
    mouth = np.argmin(((x - (0, -90, -70))**2).sum(1))  # the chin: outwards is forward, −y
    assert normal[column[mouth]][1] < 0


def test_what_a_solid_tells_is_shown(run, environment, tmp_path):
    head = "\n".join(f"  - {{name: {bone}, file: {PROJECT}/meshes/paper_{bone}.ply}}"
                     for bone in ("skull", "mandible"))
    (tmp_path / "solid.yaml").write_text(
        f"skin: {PROJECT}/meshes/paper_skin.ply\nbones:\n{head}\n"
        "tissue: {layers: 3, material: {preset: face}}\n"
        "moves: [{bone: mandible, translate: [0, -3, 0]}]\n")
    solved = run("repose-solve", "solid.yaml", "-discretisation", "-stability", "-output", "solid")
    assert solved.returncode == 0, solved
    read_back(tmp_path / "solid.h5", environment)
    with h5py.File(tmp_path / "solid.h5") as h5:
        shows(h5, "von_mises")
        shows(h5, "principal_stretch")
        for name in ("discretisation_error", "contact_gap", "contact_pressure", "contact_force"):
            shows(h5, name, "point")
        assert "stability_mode" in h5["VTKHDF/PointData"]
        assert h5["VTKHDF/CellData/principal_stretch"].shape[1] == 3


def test_a_model_without_prisms_shows_its_springs(solved, run, tmp_path):
    model = {name: values for name, values in model_of(solved(OPENING)).items()
             if not name.startswith(("prism/", "bone_surface", "skin/"))}
    write_model(tmp_path / "net.h5", model)
    assert run("repose-solve", "net.h5", "-volume", "none", "-accuracy", 1, "-load_steps", 1,
               "-output", "rest").returncode in (0, 2)
    with h5py.File(tmp_path / "rest.h5") as h5:
        assert set(h5["VTKHDF/Types"][:]) == {3}
        assert np.array_equal(h5["VTKHDF/Connectivity"][:], model["spring/points"].ravel())


def read_back(file, environment):
    """Compares all that this Python's readers show, and those that REPOSE_READERS names."""
    others = [name for name in os.environ.get("REPOSE_READERS", "").split(":") if name]
    for python in [sys.executable, *others]:
        message = finish([python, str(PROJECT / "tests/program/read_back.py"), str(file)], file.parent,
                      environment, 120)
        assert (message.returncode, message.stderr) == (0, ""), message
        assert message.stdout.count(f"{len(steps(file))} load steps") == message.stdout.count("agree") > 0


@pytest.mark.quick
def test_other_programs_read_every_array_of_every_step(opening, environment):
    read_back(opening, environment)


def test_a_reader_that_shows_another_step_is_noticed(opening, environment, tmp_path):
    for part in opening.parent.glob(f"{opening.stem}*"):
        shutil.copy(part, tmp_path)
    view = tmp_path / f"{opening.stem}_tissue.xdmf"
    view.write_text(view.read_text().replace("step/0002/point/adv", "step/0001/point/adv"))
    with pytest.raises(AssertionError, match="tissue, step 0002, advance .mm.: .* they differ"):
        read_back(tmp_path / opening.name, environment)
