"""A mesh before and after decimation, side by side with their edges:

    xvfb-run -a pvbatch tests/benchmark/decimation_picture.py BEFORE.ply AFTER.ply OUT.png"""

import sys

from paraview.simple import (CreateLayout, CreateView, PLYReader, Render, SaveScreenshot, Show)


def view_of(file):
    view = CreateView("RenderView")
    view.OrientationAxesVisibility = 0
    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    shown = Show(PLYReader(FileNames=[file]), view)
    shown.Representation = "Surface With Edges"
    shown.DiffuseColor = [0.93, 0.89, 0.80]
    shown.EdgeColor = [0.15, 0.2, 0.35]
    shown.LineWidth = 0.6
    return view


def aim(view):
    """From the front and the side: the face looks to −y, z is up."""
    view.ResetCamera()
    camera = view.GetActiveCamera()
    camera.SetViewUp(0, 0, 1)
    x, y, z = camera.GetFocalPoint()
    camera.SetPosition(x - 0.7, y - 1, z + 0.25)
    view.ResetCamera()
    camera.Zoom(1.3)
    Render(view)


def main():
    before, after, out = sys.argv[1:]
    layout = CreateLayout("side by side")
    views = [view_of(before), view_of(after)]
    layout.SplitHorizontal(0, 0.5)
    for hint, view in zip((1, 2), views):
        layout.AssignView(hint, view)
    layout.SetSize(1600, 800)
    for view in views + views:  # the first round settles their sizes
        aim(view)
    SaveScreenshot(out, layout, ImageResolution=[1200, 600])


main()
