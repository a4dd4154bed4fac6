#!/usr/bin/env python3
"""Reads a result through the readers of other programs and compares every array of every load step,
bit for bit, with what HDF5 holds.

    PYTHON tests/program/read_back.py NAME.h5

PYTHON decides on the readers: VTK's of NAME.h5 (pip install vtk h5py), meshio's of NAME_*.xdmf (pip
install meshio h5py), ParaView's Xdmf2 and Xdmf3 (xvfb-run -a pvbatch). A line for each that agrees;
exit status 1 and what differs for the first that does not, or where there is none.
"""

import importlib.util
import os
import sys

import h5py
import numpy as np

# View → its cells in /model, and the group of their numbers in a step.
VIEWS = {"tissue": ("prism/points", "prism"), "springs": ("spring/points", "spring"),
         "skin": ("skin/points", ""), "bones": ("bone_surfaces/triangles", "")}


# Units that readers see in names (docs/reference/formats.md).
UNITS = {"mm": ("displacement", "initial_position", "advance", "discretisation_error", "contact_gap",
                "other_rest_displacement", "elongation", "rest_length"),
         "N": ("residual_force", "contact_force", "tension"),
         "MPa": ("contact_pressure", "pressure", "von_mises")}
UNIT = {name: unit for unit, names in UNITS.items() for name in names}


def shown_name(name):
    """The name of an array for readers."""
    if name.startswith("tangent_young_"):
        return f"{name} (mm)"
    if name.startswith("tangent_"):
        return f"{name} ({'mm per mm' if name[-2] == 't' else 'mm per degree'})"
    return f"{name} ({UNIT[name]})" if name in UNIT else name


def held_by(h5, step, view):
    """Points, corners of the cells, and numbers of points and of cells by name, as they are stored."""
    model, step = h5["model"], h5["step"][step]
    cells, kind = VIEWS[view]
    points, moved = model["point"], step["point"]
    if view == "bones":
        points = model["bone_surfaces"]
        moved = step["bone_surface"]
        if "points" not in moved:
            moved = points
        at_points = {"initial_position": points["points"],
                     "displacement": step["bone_surface/displacement"]}
        at_cells = {"bone": points["bone"]}
    else:
        at_points = {name: points[name] for name in ("set", "layer", "column")}
        at_points |= {"initial_position": points["position"], **moved}
        del at_points["position"]
        at_cells = dict(step[kind]) if kind else {}
    if view == "springs":
        at_cells |= {name: model["spring"][name] for name in ("set", "rest_length")}
    where = moved["points" if view == "bones" else "position"]
    return where[:], model[cells][:].ravel(), *(
        {shown_name(name): array[:] for name, array in numbers.items()}
        for numbers in (at_points, at_cells))


def joined(one, other):
    """Two parts as one grid; where one has no value, NaN, or −1 of whole numbers."""
    def both(a, b, rows):
        def blank(like, count):
            empty = np.nan if like.dtype.kind == "f" else -1
            return np.full((count, *like.shape[1:]), empty, like.dtype)
        return {name: np.concatenate([a[name] if name in a else blank(b[name], rows[0]),
                                      b[name] if name in b else blank(a[name], rows[1])])
                for name in a | b}
    cells = [len(next(iter(part[3].values()))) for part in (one, other)]
    return (np.concatenate([one[0], other[0]]), np.concatenate([one[1], other[1] + len(one[0])]),
            both(one[2], other[2], [len(one[0]), len(other[0])]), both(one[3], other[3], cells))


def whole(h5, step):
    """Returns the grid of a step that NAME.h5 shows as a VTKHDF file."""
    return joined(held_by(h5, step, "tissue"), held_by(h5, step, "bones"))


# ----- readers: yield load and grid (points, corners, numbers of points, numbers of cells)


def grid_of(grids):
    """Merges the grids that VTK has read."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    points, corners, before = [], [], 0
    for grid in grids:
        points.append(vtk_to_numpy(grid.GetPoints().GetData()))
        cells = grid.GetPolys() if grid.IsA("vtkPolyData") else grid.GetCells()
        corners.append(vtk_to_numpy(cells.GetConnectivityArray()) + before)
        before += len(points[-1])

    def numbers(data):
        names = [data[0].GetArrayName(i) for i in range(data[0].GetNumberOfArrays())]
        return {name: np.concatenate([vtk_to_numpy(part.GetArray(name)) for part in data])
                for name in names}
    return (np.concatenate(points), np.concatenate(corners),
            numbers([grid.GetPointData() for grid in grids]),
            numbers([grid.GetCellData() for grid in grids]))


def by_vtk(file):
    import vtkmodules.all as vtk
    reader = vtk.vtkHDFReader()
    reader.SetFileName(file)
    reader.UpdateInformation()
    time_steps = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    for load in reader.GetOutputInformation(0).Get(time_steps):
        reader.UpdateTimeStep(load)
        read = reader.GetOutputDataObject(0)
        parts = [read]  # VTK 9.3 merges them
        if read.IsA("vtkPartitionedDataSet"):
            parts = [read.GetPartition(part) for part in range(read.GetNumberOfPartitions())]
        yield load, grid_of(parts)


def by_meshio(file):
    import meshio
    with meshio.xdmf.TimeSeriesReader(file) as reader:
        for step in range(reader.num_steps):
            reader.mesh_grid = reader.collection[step]
            points, cells = reader.read_points_cells()
            load, at_points, at_cells = reader.read_data(step)
            yield load, (points, cells[0].data.ravel(), at_points,
                         {name: blocks[0] for name, blocks in at_cells.items()})


def by_paraview(reader, names):
    def read(file):
        from paraview import servermanager, simple
        source = getattr(simple, reader)(**{names: [os.path.abspath(file)]})
        for load in source.TimestepValues:
            source.UpdatePipeline(load)
            yield load, grid_of([servermanager.Fetch(source)])
        simple.Delete(source)
    return read


def readers():
    """[(name, version, function, whether it reads XDMF)] of those that this Python has."""
    there = importlib.util.find_spec
    if "paraview" in sys.modules or there("paraview"):
        from paraview.simple import GetParaViewVersion
        return [(f"ParaView's {reader}", GetParaViewVersion(), by_paraview(reader, names), True)
                for reader, names in (("XDMFReader", "FileNames"), ("Xdmf3ReaderS", "FileName"))]
    found = []
    if there("vtkmodules"):
        from vtkmodules.vtkCommonCore import vtkVersion
        version = vtkVersion.GetVTKVersion()
        if tuple(map(int, version.split(".")[:2])) >= (9, 3):  # that reads load steps of VTKHDF
            found.append(("VTK", version, by_vtk, False))
    if there("meshio"):
        import meshio
        found.append(("meshio", meshio.__version__, by_meshio, True))
    return found


# ----- comparison


def compare(shown, held, where):
    same = shown.dtype == held.dtype and np.array_equal(
        shown.reshape(held.shape), held, equal_nan=held.dtype.kind == "f")
    if not same:
        sys.exit(f"{where}: shown are {shown.dtype} {shown.shape}, held {held.dtype} {held.shape}, "
                 "and they differ")


def compare_grids(read, held, view, where):
    """Counts the arrays that agree. Tissue and springs show all their arrays, other views may not."""
    for what, shown, stored in zip(("points", "corners"), read, held):
        compare(shown, stored, f"{where}, {what}")
    for shown, stored in zip(read[2:], held[2:]):
        for name, values in shown.items():
            blank = np.full(values.shape, np.nan)  # of a step that does not have it
            compare(values, stored.get(name, blank), f"{where}, {name}")
        complete = view in ("tissue", "bones", "whole") or view == "springs" and stored is held[3]
        if complete and not stored.keys() <= shown.keys():
            sys.exit(f"{where}: not shown is {', '.join(stored.keys() - shown.keys())}")
    return 2 + len(read[2]) + len(read[3])


def read_back(file, view, reader):
    """Counts the load steps and arrays of a view that agree with the file."""
    name, _, read, xdmf = reader
    arrays = 0
    with h5py.File(file) as h5:
        series = list(read(f"{file.removesuffix('.h5')}_{view}.xdmf" if xdmf else file))
        if [load for load, _ in series] != [step.attrs["load"] for step in h5["step"].values()]:
            sys.exit(f"{name}, {view}: the load steps are {[load for load, _ in series]}")
        for step, (_, grid) in zip(h5["step"], series):
            held = held_by(h5, step, view) if xdmf else whole(h5, step)
            arrays += compare_grids(grid, held, view, f"{name}, {view}, step {step}")
    return len(series), arrays


def main():
    if len(sys.argv) != 2 or not sys.argv[1].endswith(".h5"):
        sys.exit(__doc__)
    file, found = sys.argv[1], readers()
    if not found:
        sys.exit("this Python has neither VTK nor meshio nor ParaView")
    views = [view for view in VIEWS if os.path.isfile(f"{file.removesuffix('.h5')}_{view}.xdmf")]
    for reader in found:
        for view in views if reader[3] else ["whole"]:
            count, arrays = read_back(file, view, reader)
            print(f"{reader[0]} {reader[1]}: {view}, {count} load steps, {arrays} arrays agree")


if __name__ == "__main__":
    main()
