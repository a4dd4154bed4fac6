"""NAME.h5 as a VTKHDF file: what VTK and ParaView open is what HDF5 holds, stored once."""

import importlib.util

import h5py
import numpy as np
import pytest

from conftest import PROJECT
from tissue import model_of, steps, write_model

OPENING = "paper_jaw_opening.yaml"
MOVING = {"PointData/displacement": "point/displacement",
          "PointData/residual_force": "point/residual_force",
          "CellData/volume_ratio": "prism/volume_ratio", "Points": "point/position"}
STAYING = {"PointData/set": "point/set", "PointData/layer": "point/layer",
           "PointData/column": "point/column"}


@pytest.fixture
def opening(solved):
    file = solved(OPENING, "-load_steps", 3)
    assert len(steps(file)) >= 4
    return file


def test_what_moves_is_every_step_and_what_stays_is_the_models(opening):
    path, model = steps(opening), model_of(opening)
    with h5py.File(opening) as h5:
        root = h5["VTKHDF"]
        assert root.attrs["Type"] == b"UnstructuredGrid" and list(root.attrs["Version"]) == [2, 0]
        prisms = len(model["prism/points"])
        assert np.array_equal(root["Connectivity"][:], model["prism/points"].ravel())
        assert np.array_equal(root["Offsets"][:], np.arange(0, 6 * prisms + 1, 6))
        assert root["Types"].dtype == np.uint8 and set(root["Types"][:]) == {13}
        assert root["Steps"].attrs["NSteps"] == len(path)
        assert list(root["Steps/Values"][:]) == [step["load"] for step in path]
        for name, array in MOVING.items():
            assert np.array_equal(root[name][:], np.concatenate([step[array] for step in path]))
        for name, array in STAYING.items():
            assert root[name] == h5["model"][array], name  # the same object
        names = {f"{place}/{name}" for place in ("PointData", "CellData") for name in root[place]}
        assert names == (MOVING.keys() | STAYING.keys()) - {"Points"}
        for place in ("PointData", "CellData"):
            assert set(root[f"Steps/{place}Offsets"]) == set(root[place])


def test_nothing_is_stored_twice(opening):
    with h5py.File(opening) as h5:
        root = h5["VTKHDF"]
        for name in [*MOVING, "Connectivity"]:
            assert root[name].is_virtual, name
            assert root[name].id.get_storage_size() == 0, name
            assert {source.file_name for source in root[name].virtual_sources()} == {"."}
        cells = root["NumberOfCells"][0]
        held = {}
        root.visititems(lambda name, item: held.update({name: item.id.get_storage_size()})
                        if isinstance(item, h5py.Dataset) and name not in STAYING else None)
    assert sum(held.values()) < 9 * cells + 4096


def test_pressures_are_shown_where_the_volume_is_exact(solved):
    with h5py.File(solved("paper_jaw_advance.yaml", "-volume", "exact", "-accuracy", 1)) as h5:
        shows(h5, "pressure")


def shows(h5, name, place="prism"):
    stored = [h5["step"][step][place][name][:] for step in sorted(h5["step"])]
    data = h5["VTKHDF/PointData" if place == "point" else "VTKHDF/CellData"]
    assert np.array_equal(data[name][:], np.concatenate(stored))


def test_stress_stretch_and_uncertainty_of_a_solid_are_shown(run, tmp_path):
    head = "\n".join(f"  - {{name: {bone}, file: {PROJECT}/meshes/paper_{bone}.ply}}"
                     for bone in ("skull", "mandible"))
    (tmp_path / "solid.yaml").write_text(
        f"skin: {PROJECT}/meshes/paper_skin.ply\nbones:\n{head}\n"
        "tissue: {layers: 3, material: {preset: face}}\n"
        "moves: [{bone: mandible, translate: [0, -3, 0]}]\n")
    assert run("repose-solve", "solid.yaml", "-discretisation", "-output", "solid").returncode == 0
    with h5py.File(tmp_path / "solid.h5") as h5:
        shows(h5, "von_mises")
        shows(h5, "principal_stretch")
        shows(h5, "discretisation_error", "point")
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


def shown(grid, name, vtk):
    """An array of a grid that VTK read, by its name in the file."""
    place, _, array = name.partition("/")
    data = {"Points": grid.GetPoints, "PointData": grid.GetPointData,
            "CellData": grid.GetCellData}[place]()
    return vtk.util.numpy_support.vtk_to_numpy(data.GetArray(array) if array else data.GetData())


def test_vtk_reads_every_array_of_every_step(opening):
    if importlib.util.find_spec("vtkmodules") is None:
        pytest.skip("VTK is not installed (pip install vtk)")
    import vtkmodules.all as vtk
    import vtkmodules.util.numpy_support
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(opening))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    path, model = steps(opening), model_of(opening)
    assert list(times) == [step["load"] for step in path]
    for time, step in zip(times, path):
        reader.UpdateTimeStep(time)
        grid = reader.GetOutputDataObject(0)
        for name, array in MOVING.items():
            assert np.array_equal(shown(grid, name, vtkmodules), step[array]), (time, name)
        for name, array in STAYING.items():
            assert np.array_equal(shown(grid, name, vtkmodules), model[array]), (time, name)
        corners = vtkmodules.util.numpy_support.vtk_to_numpy(grid.GetCells().GetConnectivityArray())
        assert np.array_equal(corners, model["prism/points"].ravel())
        assert {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())} == {13}
