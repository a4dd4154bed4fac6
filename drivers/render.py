#!/usr/bin/env python3
"""A picture of a result, drawn without a screen: before, after and displacement, one row a view.

    drivers/render.py NAME [-output picture.png] [-views front,three-quarter,side] [-step last]

NAME is the path without ending: NAME_skin.xdmf and, if it is there, NAME_bones.xdmf are read.
Needs ParaView: apt-get install --no-install-recommends python3-paraview xvfb xauth
"""

import argparse
import json
import os
import shutil
import sys

if "REPOSE_RENDER" in os.environ:  # inside ParaView's interpreter, see in_paraview
    import numpy as np
    import vtkmodules.all as vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    sys.argv[1:] = json.loads(os.environ["REPOSE_RENDER"])

# Where the camera stands as seen from the head: +x patient left, +y posterior, +z up.
VIEWS = {"front": (0, -1, 0), "three-quarter": (0.65, -0.75, 0.1), "side": (1, 0, 0)}
COLUMNS = ("before", "after", "displacement")
WIDTH = 1600  # pixels
BAR = 0.09  # share of the width that the colour bar takes
SKIN, IVORY, INK = (0.87, 0.68, 0.58), (0.96, 0.92, 0.80), (0.15, 0.15, 0.15)
MAGMA = ("fcf3dc", "fed395", "fe9f6d", "f1605d", "c03a76", "832681", "4a1079")  # light to dark
SUPER = 2  # pixels drawn for one of the picture, along each axis


class Arguments(argparse.ArgumentParser):
    def error(self, message):
        refuse(message)


def refuse(message):
    print(f"render.py: {message}", file=sys.stderr)
    sys.exit(1)


def arguments():
    parser = Arguments(prog="render.py", description=__doc__, add_help=False,
                       formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("name")
    parser.add_argument("-output")
    parser.add_argument("-views", default=",".join(VIEWS))
    parser.add_argument("-step", default="last")
    chosen = parser.parse_args()
    chosen.output = os.path.abspath(chosen.output or chosen.name + ".png")
    chosen.name = os.path.abspath(chosen.name)
    chosen.views = chosen.views.split(",")
    for view in chosen.views:
        if view not in VIEWS:
            refuse(f"-views {view}: unknown, take some of {','.join(VIEWS)}")
    if not os.path.isfile(chosen.name + "_skin.xdmf"):
        refuse(f"{chosen.name}_skin.xdmf is missing: NAME is the result's path without ending")
    if not os.path.isdir(os.path.dirname(chosen.output)):
        refuse(f"-output {chosen.output}: make its folder first")
    return chosen


def in_paraview():
    """Runs this script again in ParaView's own interpreter on a screen in memory. That interpreter
    would take options for its own, so they travel in the environment."""
    for program in ("pvbatch", "xvfb-run"):
        if not shutil.which(program):
            refuse(f"{program} is missing: "
                   "apt-get install --no-install-recommends python3-paraview xvfb xauth")
    os.environ["REPOSE_RENDER"] = json.dumps(sys.argv[1:])
    os.execvp("xvfb-run", ["xvfb-run", "-a", "pvbatch", os.path.abspath(__file__)])


def read(file, step):
    """The surface of one time step of an XDMF file, before and after, with smooth normals."""
    reader = vtk.vtkXdmfReader()
    reader.SetFileName(file)
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    if step != "last" and not (step.isdecimal() and int(step) < len(times)):
        refuse(f"-step {step}: {file} has the steps 0 to {len(times) - 1}, or last")
    reader.UpdateTimeStep(times[-1 if step == "last" else int(step)])
    surface = vtk.vtkDataSetSurfaceFilter()
    surface.SetInputData(reader.GetOutputDataObject(0))
    surface.Update()
    after = surface.GetOutput()
    return {"before": smooth(initial(after, file)), "after": smooth(after)}


def initial(surface, file):
    """The surface where it was before: at its initial_position or back along its displacement."""
    arrays = surface.GetPointData()
    points = vtk.vtkPoints()
    if arrays.HasArray("initial_position"):
        points.SetData(arrays.GetArray("initial_position"))
    elif arrays.HasArray("displacement"):
        moved = vtk_to_numpy(surface.GetPoints().GetData())
        back = moved - vtk_to_numpy(arrays.GetArray("displacement"))
        points.SetData(numpy_to_vtk(back, deep=True))
    else:
        refuse(f"{file} has neither the array displacement nor initial_position")
    before = vtk.vtkPolyData()
    before.ShallowCopy(surface)
    before.SetPoints(points)
    return before


def clipped(surface, function, inside):
    """The part of a surface inside or outside an implicit function."""
    clip = vtk.vtkClipPolyData()
    clip.SetInputData(surface)
    clip.SetClipFunction(function)
    clip.SetInsideOut(inside)
    clip.Update()
    return clip.GetOutput()


def beside(bones, skin):
    """The part of the bones in the box of the skin."""
    box = vtk.vtkBox()
    box.SetBounds(skin.GetBounds())
    return clipped(bones, box, True)


def smooth(surface):
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputData(surface)
    normals.SplittingOff()
    normals.Update()
    return normals.GetOutput()


def colours(surface):
    """The colour table of |displacement|, from 0 to its largest value in mm."""
    largest = surface.GetPointData().GetArray("displacement").GetRange(-1)[1] or 1
    table = vtk.vtkColorTransferFunction()
    for i, text in enumerate(MAGMA):
        red, green, blue = (int(text[k:k + 2], 16) / 255 for k in (0, 2, 4))
        table.AddRGBPoint(largest * i / (len(MAGMA) - 1), red, green, blue)
    table.SetVectorModeToMagnitude()
    return table


def actor(surface, colour, table=None, opacity=1.0):
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(surface)
    mapper.SetScalarVisibility(table is not None)
    if table:
        mapper.SetLookupTable(table)
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("displacement")
    drawn = vtk.vtkActor()
    drawn.SetMapper(mapper)
    drawn.GetProperty().SetColor(colour)
    drawn.GetProperty().SetOpacity(opacity)
    drawn.GetProperty().SetAmbient(0.2)
    drawn.GetProperty().SetDiffuse(0.8)
    drawn.GetProperty().SetSpecular(0.12)
    drawn.GetProperty().SetSpecularPower(25)
    return drawn


def renderer(actors):
    """A white scene lit from three sides of the camera."""
    scene = vtk.vtkRenderer()
    scene.SetBackground(1, 1, 1)
    scene.SetUseDepthPeeling(True)
    scene.SetMaximumNumberOfPeels(12)
    for drawn in actors:
        scene.AddActor(drawn)
    scene.RemoveAllLights()
    for place, strength in (((-0.6, 0.9, 1.5), 0.8), ((1.5, 0.2, 1), 0.35), ((0, -1, 0.8), 0.15)):
        light = vtk.vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(*place)
        light.SetIntensity(strength)
        scene.AddLight(light)
    return scene


def extent(surfaces, view):
    """Middle, half width and half height of surfaces seen from a view, as (middle, half, half)."""
    forward = -np.array(VIEWS[view]) / np.linalg.norm(VIEWS[view])
    right = np.cross(forward, (0, 0, 1)) / np.linalg.norm(np.cross(forward, (0, 0, 1)))
    frame = np.array([right, np.cross(right, forward), forward])
    points = np.concatenate([vtk_to_numpy(s.GetPoints().GetData()) for s in surfaces]) @ frame.T
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2 @ frame, *((high - low)[:2] / 2)


def look(scene, view, middle, half_height):
    camera = scene.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(m + 1000 * v for m, v in zip(middle, VIEWS[view])))
    camera.SetViewUp(0, 0, 1)
    camera.SetParallelScale(half_height)
    scene.ResetCameraClippingRange()


def label(scene, text):
    drawn = vtk.vtkTextActor()
    drawn.SetInput(text)
    drawn.GetTextProperty().SetColor(INK)
    drawn.GetTextProperty().SetFontSize(SUPER * 26)
    drawn.GetTextProperty().SetJustificationToCentered()
    drawn.GetPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
    drawn.GetPositionCoordinate().SetValue(0.5, 0.25)
    scene.AddViewProp(drawn)


def colour_bar(scene, table, height):
    bar = vtk.vtkScalarBarActor()
    bar.SetLookupTable(table)
    bar.SetTitle("mm")
    bar.SetNumberOfLabels(5)
    bar.SetLabelFormat("%.3g")
    bar.UnconstrainedFontSizeOn()
    for text in (bar.GetTitleTextProperty(), bar.GetLabelTextProperty()):
        text.SetColor(INK)
        text.SetFontSize(SUPER * 20)
        text.BoldOff()
        text.ItalicOff()
        text.ShadowOff()
    bar.SetPosition(0.1, 0.95 - height)
    bar.SetWidth(0.8)
    bar.SetHeight(height)
    scene.AddViewProp(bar)


def cut_away(skin, bones):
    """Skin over bones: whole on the patient's right, a veil on the left."""
    if not bones:
        return [actor(skin, SKIN)]
    middle = vtk.vtkPlane()
    middle.SetOrigin(skin.GetCenter())
    middle.SetNormal(1, 0, 0)
    return [actor(clipped(skin, middle, True), SKIN), actor(beside(bones, skin), IVORY),
            actor(clipped(skin, middle, False), SKIN, opacity=0.3)]


def columns(skin, bones, table):
    """The actors of each column; an actor may stand in several scenes of a window."""
    coloured = [actor(skin["after"], SKIN, table)]
    if bones:
        coloured.append(actor(beside(bones["after"], skin["after"]), IVORY))
    return {"displacement": coloured, **{
        state: cut_away(skin[state], bones and bones[state]) for state in ("before", "after")}}


class Sheet:
    """A window that scenes are put on, in pixels from the upper left corner."""

    def __init__(self, height):
        self.height = int(height)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetAlphaBitPlanes(True)
        self.window.SetMultiSamples(0)
        self.window.SetSize(SUPER * WIDTH, SUPER * self.height)

    def put(self, scene, left, top, width, height):
        scene.SetViewport(left / WIDTH, 1 - (top + height) / self.height,
                          (left + width) / WIDTH, 1 - top / self.height)
        self.window.AddRenderer(scene)

    def save(self, output):
        """Writes to another name first: a picture is complete or absent."""
        self.window.Render()
        image = vtk.vtkWindowToImageFilter()
        image.SetInput(self.window)
        image.ReadFrontBufferOff()
        small = vtk.vtkImageShrink3D()
        small.SetInputConnection(image.GetOutputPort())
        small.SetShrinkFactors(SUPER, SUPER, 1)
        writer = vtk.vtkPNGWriter()
        writer.SetInputConnection(small.GetOutputPort())
        writer.SetFileName(output + ".part")
        writer.Write()
        os.replace(output + ".part", output)


def picture(skin, bones, views):
    """A sheet of one row a view and one column a state, cropped to the skin."""
    table = colours(skin["after"])
    drawn = columns(skin, bones, table)
    margin, title, wide = 1.05, 44, WIDTH * (1 - BAR) / len(COLUMNS)
    frames = [extent(skin.values(), view) for view in views]
    scale = wide / (2 * margin * max(across for _, across, _ in frames))  # pixels per mm
    sheet = Sheet(title + sum(2 * margin * up * scale for _, _, up in frames))
    top = title
    for view, (middle, _, up) in zip(views, frames):
        for i, column in enumerate(COLUMNS):
            scene = renderer(drawn[column])
            sheet.put(scene, i * wide, top, wide, 2 * margin * up * scale)
            look(scene, view, middle, margin * up)
        top += 2 * margin * up * scale
    for i, column in enumerate(COLUMNS):
        scene = renderer([])
        label(scene, column)
        sheet.put(scene, i * wide, 0, wide, title)
    scene = renderer([])
    colour_bar(scene, table, min(0.85, 500 / sheet.height))
    sheet.put(scene, (1 - BAR) * WIDTH, 0, BAR * WIDTH, sheet.height)
    return sheet


def main():
    chosen = arguments()
    if "REPOSE_RENDER" not in os.environ:
        in_paraview()
    skin = read(chosen.name + "_skin.xdmf", chosen.step)
    bones_file = chosen.name + "_bones.xdmf"
    bones = read(bones_file, chosen.step) if os.path.isfile(bones_file) else None
    picture(skin, bones, chosen.views).save(chosen.output)
    print(chosen.output)


main()
