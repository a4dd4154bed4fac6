#!/usr/bin/env python3
"""The lips before and after operations: three views of the skin that was solved, and the midsagittal
section of tissue, bones and teeth, one picture an operation.

    tests/benchmark/ratios.py -keep FOLDER
    tests/benchmark/ratios_picture.py FOLDER OUT [WAY]

FOLDER holds the results of ratios.py and their landmarks, OUT is a folder, WAY one of those of
ratios.py (default). In the section tissue that holds to bone ends in red; tissue that touches bone or
teeth, as in the vestibule, is supported elastically or free ends in blue. Needs what drivers/render.py does, by which it
draws.
"""

import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "drivers"))
import render  # noqa: E402
from sheet.landmarks import read_landmarks  # noqa: E402

render.find_screen()
render.load_modules()
np, vtk = render.np, render.vtk

WIDTH = 250  # pixels of a view
HALF = 38  # mm from the middle of a view to its border
HELD, FREE = (0.80, 0.10, 0.10), (0.10, 0.30, 0.85)
WEDGE_ENDS = (0, 2, 1, 3, 5, 4)  # VTK's wedge has its first triangle the other way round


def wedges(points, prisms):
    """The tissue as an unstructured grid of prisms."""
    grid = vtk.vtkUnstructuredGrid()
    grid.SetPoints(vtk.vtkPoints())
    grid.GetPoints().SetData(render.numpy_to_vtk(points, deep=True))
    cells = np.hstack([np.full((len(prisms), 1), 6), prisms[:, WEDGE_ENDS]]).astype(np.int64)
    array = vtk.vtkCellArray()
    array.ImportLegacyFormat(render.numpy_to_vtkIdTypeArray(cells.ravel(), deep=True))
    grid.SetCells(vtk.VTK_WEDGE, array)
    return grid


def cut(drawn, x):
    """The section of cells by a sagittal plane."""
    plane = vtk.vtkPlane()
    plane.SetOrigin(x, 0, 0)
    plane.SetNormal(1, 0, 0)
    cutter = vtk.vtkCutter()
    cutter.SetInputData(drawn)
    cutter.SetCutFunction(plane)
    cutter.Update()
    return cutter.GetOutput()


def filled(lines):
    """The area within closed lines."""
    fill = vtk.vtkContourTriangulator()
    fill.SetInputData(lines)
    fill.Update()
    return fill.GetOutput()


def flat(drawn, color, width=1.0):
    """An actor without shading."""
    shown = render.actor(drawn, color)
    shown.GetProperty().LightingOff()
    shown.GetProperty().SetLineWidth(render.SUPER * width)
    return shown


def deep_ends(model):
    """Triangles that end the tissue below, [n, 3], and which of them bone holds, [n]."""
    prisms, layer = model["prism/points"][:], model["point/layer"][:]
    deep = prisms[:, 3:]
    deep = deep[(layer[deep] == layer.max()).all(axis=1)]
    return deep, (model["point/bone"][:][deep] >= 0).all(axis=1)


def bone_contours(result, bones, x):
    """The section of each bone."""
    of_bone = result.model["bone_surfaces/bone"][:]
    return [cut(render.surface(bones, result.bone_corners[of_bone == bone]), x)
            for bone in np.unique(of_bone)]


def section(result, points, bones, x):
    """Actors of the section: bones and teeth, tissue, its skin and its deep end."""
    deep, held = deep_ends(result.model)
    prisms = result.model["prism/points"][:]
    top = prisms[(result.model["point/layer"][:][prisms[:, :3]] == 0).all(axis=1), :3]
    drawn = []
    for contour in bone_contours(result, bones, x):
        drawn += [flat(filled(contour), render.IVORY), flat(contour, render.INK)]
    drawn.append(flat(cut(wedges(points, prisms), x), render.SKIN))
    for triangles, color in ((top, render.INK), (deep[held], HELD), (deep[~held], FREE)):
        if len(triangles):
            drawn.append(flat(cut(render.surface(points, triangles), x), color, 2))
    for i, shown in enumerate(drawn):
        shown.AddPosition(-0.1 * i, 0, 0)  # the later ones in front
    return drawn


def rows_of(result):
    """Before and after: points of the tissue, and the state that render.py draws."""
    return [(result.model["point/position"][:], result.first()),
            (result.points(-1), result.state(-1))]


def picture(file, landmarks, output):
    result = render.Result(str(file), solved_skin=True)
    middle = landmarks["stomion"] if "stomion" in landmarks else (
        landmarks["upper_lip"] + landmarks["lower_lip"]) / 2
    views = list(render.VIEWS)
    sheet = render.Sheet(WIDTH * (len(views) + 1), 2 * WIDTH)
    for i, (points, state) in enumerate(rows_of(result)):
        for j, view in enumerate(views + ["section"]):
            scene = render.renderer(section(result, points, state["bones"], middle[0])
                                    if view == "section" else
                                    render.actors("after", state, result, {}))
            sheet.put(scene, j * WIDTH, i * WIDTH, WIDTH, WIDTH)
            render.look(scene, "profile" if view == "section" else view, middle, HALF)
    render.write_picture(sheet.pixels(), render.Target(output, ".png"))


def main():
    folder, out = map(pathlib.Path, sys.argv[1:3])
    way = "_".join(sys.argv[3:] or ["default"])
    landmarks = read_landmarks(folder / "head.mrk.json")
    out.mkdir(exist_ok=True)
    for file in sorted(folder.glob(f"*_{way}.h5")):
        picture(file, landmarks, out / f"{file.stem.removesuffix('_' + way)}.png")


if __name__ == "__main__":
    main()
