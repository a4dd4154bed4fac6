#!/usr/bin/env python3
"""A given skin, the mesh solved in its place, and the given skin after the move and by how far it moved:

    tests/benchmark/any_head_picture.py NAME OUT.png

NAME is the path of a result without ending; NAME.h5 and NAME_given_skin.vtp are read.
Needs h5py and VTK's Python modules, which draw without a screen.
"""

import sys

import h5py
import numpy as np
import vtkmodules.all as vtk
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

SKIN, EDGES = (0.87, 0.68, 0.58), (0.15, 0.2, 0.35)
PANEL = (400, 480)  # pixels
MAGMA = ("fcf3dc", "fed395", "fe9f6d", "f1605d", "c03a76", "832681", "4a1079")  # light to dark


def colours(largest):
    """The colour table of 0 … largest mm, as in drivers/render.py."""
    table = vtk.vtkColorTransferFunction()
    for i, text in enumerate(MAGMA):
        red, green, blue = (int(text[k:k + 2], 16) / 255 for k in (0, 2, 4))
        table.AddRGBPoint(largest * i / (len(MAGMA) - 1), red, green, blue)
    return table


def read_given(file):
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(file)
    reader.Update()
    return reader.GetOutput()


def solved_mesh(file):
    """The skin that was solved, at first."""
    with h5py.File(file) as h5:
        points, triangles = h5["model/point/position"][()], h5["model/skin/points"][()]
    cells = vtk.vtkCellArray()
    for triangle in triangles:
        cells.InsertNextCell(3, [int(vertex) for vertex in triangle])
    mesh, places = vtk.vtkPolyData(), vtk.vtkPoints()
    places.SetData(numpy_to_vtk(points, deep=True))
    mesh.SetPoints(places)
    mesh.SetPolys(cells)
    return mesh


def moved(given):
    """The given skin after the move, with its way in mm."""
    displacement = vtk_to_numpy(given.GetPointData().GetArray("displacement"))
    after, places = vtk.vtkPolyData(), vtk.vtkPoints()
    places.SetData(numpy_to_vtk(vtk_to_numpy(given.GetPoints().GetData()) + displacement, deep=True))
    after.DeepCopy(given)
    after.SetPoints(places)
    way = numpy_to_vtk(np.linalg.norm(displacement, axis=1), deep=True)
    after.GetPointData().SetScalars(way)
    return after


def panel(column, mesh, given, largest=None, edges=False):
    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputData(mesh)
    mapper.SetScalarVisibility(largest is not None)
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(SKIN)
    actor.GetProperty().SetEdgeVisibility(edges)
    actor.GetProperty().SetEdgeColor(EDGES)
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    renderer.SetViewport(column / 4, 0, (column + 1) / 4, 1)
    renderer.AddActor(actor)
    if largest is not None:
        mapper.SetLookupTable(colours(largest))
        bar = vtk.vtkScalarBarActor()
        bar.SetLookupTable(mapper.GetLookupTable())
        bar.SetTitle("mm")
        bar.GetTitleTextProperty().SetColor(0, 0, 0)
        bar.GetLabelTextProperty().SetColor(0, 0, 0)
        bar.GetLabelTextProperty().SetShadow(False)
        bar.UnconstrainedFontSizeOn()
        bar.GetTitleTextProperty().SetFontSize(14)
        bar.GetLabelTextProperty().SetFontSize(12)
        bar.SetNumberOfLabels(4)
        bar.SetLabelFormat("%.0f")
        bar.SetMaximumWidthInPixels(50)
        bar.SetVerticalTitleSeparation(10)
        bar.SetPosition(0.02, 0.08)
        renderer.AddViewProp(bar)
    middle = np.array(given.GetCenter())
    camera = renderer.GetActiveCamera()
    camera.SetViewUp(0, 0, 1)
    camera.SetFocalPoint(middle - [-15, 20, 0])
    camera.SetPosition(middle + [310, -500, 20])
    renderer.ResetCameraClippingRange()
    return renderer


def main():
    name, out = sys.argv[1:]
    given = read_given(f"{name}_given_skin.vtp")
    after = moved(given)
    largest = after.GetPointData().GetScalars().GetRange()[1]
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(8)
    window.SetSize(4 * PANEL[0], PANEL[1])
    for renderer in (panel(0, given, given), panel(1, solved_mesh(f"{name}.h5"), given, edges=True),
                     panel(2, after, given), panel(3, after, given, largest)):
        window.AddRenderer(renderer)
    window.Render()
    image, writer = vtk.vtkWindowToImageFilter(), vtk.vtkPNGWriter()
    image.SetInput(window)
    image.ReadFrontBufferOff()
    writer.SetInputConnection(image.GetOutputPort())
    writer.SetFileName(out)
    writer.Write()


main()
