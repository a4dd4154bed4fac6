#!/usr/bin/env python3
"""A given skin, the mesh solved in its place, and the given skin after the move and by how far it moved:

    tests/benchmark/any_head_picture.py NAME OUT.png

NAME is the path of a result without ending; NAME.h5 and NAME_given_skin.vtp are read.
Needs what drivers/render.py does, by which it draws.
"""

import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "drivers"))
import render  # noqa: E402

render.find_screen()
render.load_modules()
np, vtk = render.np, render.vtk

EDGES = (0.15, 0.2, 0.35)
VIEW = "three-quarter"


def read_given(file):
    """Points, triangles and displacements of the given skin."""
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(file)
    reader.Update()
    given = reader.GetOutput()
    return (render.vtk_to_numpy(given.GetPoints().GetData()),
            render.vtk_to_numpy(given.GetPolys().GetConnectivityArray()).reshape(-1, 3),
            render.vtk_to_numpy(given.GetPointData().GetArray("displacement")))


def columns(name):
    """[(title, actor, color table or None)] and the given points."""
    points, corners, displacement = read_given(f"{name}_given_skin.vtp")
    way = np.linalg.norm(displacement, axis=1)
    table = render.colors("movement", way)
    solved = render.Result(f"{name}.h5")
    mesh = render.actor(render.surface(solved.before, solved.corners), render.SKIN)
    mesh.GetProperty().EdgeVisibilityOn()
    mesh.GetProperty().SetEdgeColor(EDGES)
    before, after = (render.surface(at, corners, way) for at in (points, points + displacement))
    return points, [("given", render.actor(before, render.SKIN), None), ("solved", mesh, None),
                    ("after", render.actor(after, render.SKIN), None),
                    ("movement, mm", render.actor(after, render.SKIN, table), table)]


def main():
    name, out = sys.argv[1:]
    points, drawn = columns(name)
    middle, across, up = render.extent(points, VIEW)
    wide, half = render.COLUMN, 1.05 * up
    high = wide * half / (1.05 * across)
    sheet = render.Sheet(wide * len(drawn), render.TITLE + high + render.BAR)
    for i, (title, actor, table) in enumerate(drawn):
        sheet.put(render.label(title), i * wide, 0, wide, render.TITLE)
        scene = render.renderer([actor])
        sheet.put(scene, i * wide, render.TITLE, wide, high)
        render.look(scene, VIEW, middle, half)
        bar = render.color_bar(table) if table else render.renderer([])
        sheet.put(bar, i * wide, render.TITLE + high, wide, render.BAR)
    render.write_picture(sheet.pixels(), render.Target(out, ".png"))


main()
