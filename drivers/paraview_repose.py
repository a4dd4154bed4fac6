"""A result in ParaView at one look: before, after and bones through the skin, and the profile line.

As a macro: Macros → Import new macro → this file; then open NAME_skin.xdmf (or NAME.h5), select it
and press the macro's button. Without ParaView's window:

    pvpython drivers/paraview_repose.py NAME [picture.png] [state.pvsm]

Without a display: xvfb-run -a pvpython …
NAME is the result without ending. It reads NAME_skin.xdmf and NAME_bones.xdmf, which ParaView reads
from version 5.6 on; the time slider shows the load steps. Where the scene's skin was remeshed, that of
the scene is shown, displaced as at the end (NAME_given_skin.vtp); "computed skin" in the pipeline
browser is the one with load steps.
"""

import os
import shlex
import sys

IS_SCRIPT = bool(sys.argv) and os.path.basename(sys.argv[0]) == "paraview_repose.py"
if IS_SCRIPT:
    sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
    from sheet.script import Unusable, has_display, refuse, result_name, run, words
    from sheet.whole_file import Target
else:  # a macro, which ParaView copies to a folder of its own and whose exit would end ParaView

    def refuse(reason):
        raise RuntimeError(f"paraview_repose.py: {reason}")


try:
    from paraview.simple import (AddCameraLink, AssignViewToLayout, ColorBy,
                                 CreateLayout, CreateRenderView, GetActiveSource, GetAnimationScene,
                                 GetColorTransferFunction, GetParaViewVersion, GetScalarBar,
                                 RenderAllViews, SaveScreenshot, SaveState, SetActiveView, Show,
                                 Slice, Text, Threshold, WarpByVector, XDMFReader, XMLPolyDataReader)
except ImportError as missing:
    refuse(f"{missing.name} is missing: run pvpython of ParaView; "
           "apt-get install --no-install-recommends python3-paraview xvfb xauth")

BLUE, RED, INK = (0.12, 0.44, 0.71), (0.75, 0.22, 0.17), (0.15, 0.15, 0.15)
SKIN, IVORY = (0.87, 0.68, 0.58), (0.96, 0.92, 0.8)
# As in drivers/sheet/__init__.py, which a macro cannot import.
RAMP = ("fcf3dc", "fed395", "fe9f6d", "f1605d", "c03a76", "832681", "4a1079")
FRONT_RIGHT, PROFILE = (-0.65, -0.75, 0.1), (-1, 0, 0)  # looking to the right
PICTURES, STATE = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"), ".pvsm"
PARTS = ("_skin.xdmf", "_given_skin.vtp", "_bones.xdmf", "_tissue.xdmf", "_springs.xdmf", ".h5", ".vtkhdf")


def selected_result():
    """The result that is selected in ParaView's window."""
    source = GetActiveSource()
    files = getattr(source, "FileNames", None) or getattr(source, "FileName", None) or ""
    file = files if isinstance(files, str) else files[0]
    for part in PARTS:
        if file.endswith(part):
            return file.removesuffix(part)
    refuse("select a result's NAME_skin.xdmf or NAME.h5 first")


def require_result(name):
    if not os.path.isfile(name + "_skin.xdmf"):
        refuse(f"{name}_skin.xdmf is missing: NAME is the result's path")


def require_display():
    """Refuses what would crash: a ParaView that draws in X windows only, and no X server."""
    from vtkmodules import vtkRenderingOpenGL2
    needs_display = hasattr(vtkRenderingOpenGL2, "vtkXOpenGLRenderWindow") and \
        GetParaViewVersion() < 6
    if needs_display and not has_display():
        refuse(f"no display: xvfb-run -a pvpython {shlex.join(sys.argv)}")


def view(layout, hint, title):
    """A white view, with a title."""
    made = CreateRenderView()
    AssignViewToLayout(view=made, layout=layout, hint=hint)
    made.UseColorPaletteForBackground = 0
    made.Background = [1, 1, 1]
    made.OrientationAxesVisibility = 0
    made.CameraParallelProjection = 1
    made.CameraViewUp = [0, 0, 1]
    drawn = Show(Text(registrationName=title, Text=title), made)
    drawn.WindowLocation = "Upper Center"
    drawn.FontSize, drawn.Color = 18, list(INK)
    return made


def bounds(source):
    source.UpdatePipeline()
    return source.GetDataInformation().GetBounds()


def look_from(made, direction, skin):
    """Fills the view with the skin."""
    box = bounds(skin)
    middle = [(box[2 * axis] + box[2 * axis + 1]) / 2 for axis in range(3)]
    made.CameraFocalPoint = middle
    made.CameraPosition = [m + 1000 * d for m, d in zip(middle, direction)]
    made.CameraParallelScale = 0.65 * (box[5] - box[4])


def shown(source, made, color, opacity=1.0):
    drawn = Show(source, made)
    ColorBy(drawn, None)
    drawn.DiffuseColor = drawn.AmbientColor = list(color)
    drawn.Opacity = opacity
    return drawn


def initial(source, name):
    """A surface where it was before."""
    return WarpByVector(registrationName=name, Input=source, Vectors=["POINTS", "displacement (mm)"],
                        ScaleFactor=-1.0)


def colored_by_movement(source, made):
    drawn = shown(source, made, SKIN, 0.75)
    data = source.PointData
    array = next(name for name in ("displacement (mm)", "displacement") if data.GetArray(name))
    ColorBy(drawn, ("POINTS", array, "Magnitude"))
    drawn.RescaleTransferFunctionToDataRange(False)
    table = GetColorTransferFunction(array)
    low, high = table.RGBPoints[0], table.RGBPoints[-4]
    table.ColorSpace = "RGB"
    table.RGBPoints = [value for i, color in enumerate(RAMP) for value in (
        low + (high - low) * i / (len(RAMP) - 1),
        *(int(color[k:k + 2], 16) / 255 for k in (0, 2, 4)))]
    bar = GetScalarBar(table, made)
    bar.Title, bar.ComponentTitle = "movement, mm", ""
    bar.TitleColor = bar.LabelColor = list(INK)
    bar.TitleFontSize = bar.LabelFontSize = 16
    bar.Orientation, bar.WindowLocation = "Horizontal", "Lower Center"
    if GetParaViewVersion() < 6:
        bar.AutomaticLabelFormat = 0
        bar.LabelFormat = bar.RangeLabelFormat = "%.3g"
    drawn.SetScalarBarVisibility(made, True)


def bone_names(name, bones):
    """The names of the bones, from the result where this Python has h5py; else their numbers."""
    try:
        import h5py
        with h5py.File(name + ".h5") as h5:
            return [word.decode() for word in h5["model/bone"][:]]
    except (ImportError, OSError):
        return [f"bone {k}" for k in range(int(bones.CellData["bone"].GetRange()[1]) + 1)]


def each_bone(name, bones):
    """Entries of the pipeline browser, one a bone and named by it, to be shown, hidden and colored."""
    for number, word in enumerate(bone_names(name, bones)):
        one = Threshold(registrationName=word, Input=bones, Scalars=["CELLS", "bone"])
        one.LowerThreshold = one.UpperThreshold = number


def given_skin(name):
    """Before and after of the skin that the scene names, where another was solved in its place."""
    file = name + "_given_skin.vtp"
    if not os.path.isfile(file):
        return None
    before = XMLPolyDataReader(registrationName="skin before", FileName=[file])
    return before, WarpByVector(registrationName="skin", Input=before,
                                Vectors=["POINTS", "displacement"], ScaleFactor=1.0)


def profile(source, name, made, color):
    """The cut of a skin with the plane through its middle."""
    low, high = bounds(source)[:2]
    line = Slice(registrationName=name, Input=source)
    line.SliceType.Origin, line.SliceType.Normal = [(low + high) / 2, 0, 0], [1, 0, 0]
    shown(line, made, color).LineWidth = 4


def show(name):
    """Shows a result in three views; their layout."""
    solved = "computed skin" if os.path.isfile(name + "_given_skin.vtp") else "skin"
    skin = XDMFReader(registrationName=solved, FileNames=[name + "_skin.xdmf"])
    scene = GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.GoToLast()
    bones = XDMFReader(registrationName="bones", FileNames=[name + "_bones.xdmf"]) \
        if os.path.isfile(name + "_bones.xdmf") else None
    given = given_skin(name)
    before, skin = given or (initial(skin, "skin before"), skin)
    layout = CreateLayout("Repose")
    second = layout.SplitHorizontal(0, 1 / 3) + 1
    third = layout.SplitHorizontal(second, 1 / 2) + 1
    left, middle = view(layout, second - 1, "before"), view(layout, third - 1, "after")
    right = view(layout, third, "profile: blue before, red after")
    for made, drawn in ((left, before), (middle, skin)):
        if bones:
            shown(initial(bones, "bones before") if drawn is before else bones, made, IVORY)
        shown(drawn, made, SKIN, 0.5)
        look_from(made, FRONT_RIGHT, skin)
    colored_by_movement(skin, middle)
    if bones:
        each_bone(name, bones)
    profile(before, "profile before", right, BLUE)
    profile(skin, "profile after", right, RED)
    look_from(right, PROFILE, skin)
    AddCameraLink(left, middle, "before and after")
    SetActiveView(middle)
    RenderAllViews()
    return layout


def save(layout, target):
    """Writes a picture of the views, or ParaView's state."""
    root, ending = os.path.splitext(str(target))
    part = f"{root}.{os.getpid()}.part{ending}"
    try:
        if ending.lower() == STATE:
            SaveState(part)
        else:
            layout.SetSize(1500, 600)
            SaveScreenshot(part, layout, ImageResolution=[3000, 1200])
        if not os.path.isfile(part) or not os.path.getsize(part):
            raise Unusable(f"{target}: cannot be written by ParaView; free some space or choose another name")
        target.check()
        os.replace(part, str(target))
    finally:
        if os.path.exists(part):
            os.remove(part)


def main():
    """Shows the result that is named, and writes the files that are named behind it."""
    result, *files = words(__doc__, 1, 3)
    name = os.path.abspath(result_name(result))
    targets = [Target(file, (*PICTURES, STATE), [name + part for part in PARTS]) for file in files]
    require_result(name)
    require_display()
    layout = show(name)
    for target in targets:
        save(layout, target)


if IS_SCRIPT:
    run(main)
else:
    selected = selected_result()
    require_result(selected)
    show(selected)
