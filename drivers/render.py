#!/usr/bin/env python3
"""Pictures of a result, drawn without a screen, and a film of its way.

    drivers/render.py NAME [OTHER] [-output picture.png] [-views front,three-quarter,profile]
        [-columns before,after,movement,bones] [-step last] [-film film.gif] [-frames 24]
        [-scene scene.yaml] [-solved_skin]

NAME is the result (NAME.h5, the ending may be left out); OTHER is another plan of the same patient,
whose columns stand beside, on one scale, with the difference of the faces. One row a view, one column
a way to see it:

    before, after   the skin that the scene names, displaced
    movement        how far each place of the skin has gone, mm
    advance         how far outwards (red) or inwards (blue), mm
    stress          von Mises stress of the skin's prisms; tension of its springs
    region          which part of the skin was computed
    bones           the skin as a veil over the bones

-solved_skin shows the skin that was solved, where that is a remeshed part of the scene's.
-film draws the columns along the load steps, between which it moves evenly, into an animated GIF.
-scene shows the instruments of the scene, which the result does not hold; it needs PyYAML.
-views takes three-quarter-left, too, which shows the patient's left side.
Needs VTK and h5py, and no display: pip install vtk h5py, with apt-get install libegl1
libgl1-mesa-dri; or, without pip, apt-get install --no-install-recommends python3-paraview
python3-h5py xvfb xauth. A film needs Pillow, which comes with the former.
"""

import ctypes.util
import importlib.util
import io
import json
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from sheet import RAMP, REGION, rounded_up  # noqa: E402
from sheet.script import (Arguments, Unusable, has_display, number_from, own_names, reading, refuse,  # noqa: E402
                          refuse_missing, require_file, result_name, run)
from sheet.whole_file import Target  # noqa: E402

if "REPOSE_RENDER" in os.environ:  # inside ParaView's interpreter, see find_screen
    sys.argv[1:] = json.loads(os.environ["REPOSE_RENDER"])

# Where the camera stands as seen from the head: +x patient left, +y posterior, +z up. A profile
# looks to the right.
VIEWS = {"front": (0, -1, 0), "three-quarter": (-0.65, -0.75, 0.1), "profile": (-1, 0, 0),
         "three-quarter-left": (0.65, -0.75, 0.1)}
COLORED = ("movement", "advance", "stress", "region")
ROUNDING = 1e-9  # mm, N/mm² or N: less is shown as nothing
COLUMNS = ("before", "after", *COLORED, "bones")
COLUMN, TITLE, BAR, TEXT = 480, 64, 110, 34  # pixels
SUPER = 2  # pixels drawn for one of the picture, along each axis
SKIN, IVORY, INK = (0.87, 0.68, 0.58), (0.96, 0.92, 0.80), (0.15, 0.15, 0.15)
FLESH, GREY, STEEL = (0.70, 0.36, 0.33), (0.72, 0.74, 0.78), (0.45, 0.55, 0.65)
BOTH = ("2166ac", "92c5de", "f7f7f7", "f4a582", "b2182b")  # inwards to outwards
INSTALL = ("pip install vtk h5py, or apt-get install --no-install-recommends python3-paraview python3-h5py "
           "xvfb xauth")


def words(option, text, known):
    chosen = text.split(",")
    for word in chosen:
        if word not in known:
            refuse(f"{option} {word}: unknown, take some of {','.join(known)}")
    return chosen


def arguments():
    parser = Arguments(__doc__)
    parser.add_argument("name")
    parser.add_argument("other", nargs="?")
    parser.add_argument("-output")
    parser.add_argument("-views", default="front,three-quarter,profile")
    parser.add_argument("-columns", default="before,after,movement,bones")
    parser.add_argument("-step", default="last")
    parser.add_argument("-film")
    parser.add_argument("-frames", type=number_from(2, 1000), default=24)
    parser.add_argument("-scene")
    parser.add_argument("-solved_skin", action="store_true")
    chosen = parser.parse_intermixed_args()
    chosen.names = [os.path.abspath(result_name(name))
                    for name in (chosen.name, chosen.other) if name is not None]
    made = "_and_".join([chosen.names[0], *map(os.path.basename, chosen.names[1:])])
    chosen.views = words("-views", chosen.views, tuple(VIEWS))
    chosen.columns = words("-columns", chosen.columns, COLUMNS)
    if chosen.scene:
        require_file(chosen.scene, "give a scene file (.yaml)", "-scene ")
    if chosen.film and len(chosen.names) > 1:
        refuse("-film shows one result, not two")
    chosen.output = Target(
        os.path.abspath(chosen.film or chosen.output or made + ".png"), ".gif" if chosen.film else ".png",
        [*(name + ending for name in chosen.names for ending in (".h5", "_given_skin.vtp")), chosen.scene])
    return chosen


def vtk_version():
    """(major, minor) of this interpreter's VTK."""
    from vtkmodules.vtkCommonCore import vtkVersion
    return vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()


def find_screen():
    """Finds a way to draw. Without a display VTK draws from 9.4 on, and an older one on a screen in memory.
    Where this interpreter has no VTK, ParaView's draws. That would take options for its own, so they
    travel in the environment."""
    own = importlib.util.find_spec("vtkmodules") is not None
    if own and has_display():
        return
    if own:
        if vtk_version() >= (9, 4):
            for library, window in (("EGL", "vtkEGLRenderWindow"),
                                    ("OSMesa", "vtkOSOpenGLRenderWindow")):
                if ctypes.util.find_library(library):
                    os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = window
                    return
            refuse("neither a display nor libEGL: apt-get install libegl1 libgl1-mesa-dri")
    inside = "REPOSE_RENDER" in os.environ
    for program in ("xvfb-run",) if own else ("pvbatch", "xvfb-run"):
        if not shutil.which(program) or (inside and not own):
            refuse(f"VTK is missing in {sys.executable}: {INSTALL}")
    os.environ["REPOSE_RENDER"] = json.dumps(sys.argv[1:])
    os.execvp("xvfb-run", ["xvfb-run", "-a", sys.executable if own else "pvbatch",
                           os.path.abspath(sys.argv[0])])


def load_modules():
    """After find_screen."""
    global h5py, np, vtk, numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy, shown_skin
    try:
        import h5py
        import numpy as np
        import vtkmodules.all as vtk
        from vtkmodules.util.numpy_support import (numpy_to_vtk, numpy_to_vtkIdTypeArray,
                                                   vtk_to_numpy)
        from sheet import shown_skin
    except ImportError as missing:
        refuse_missing(missing, INSTALL)


# ----- what is drawn


WHAT = "a result of repose-solve"


class Result:
    """The steps of a result: skin and bones before and on their way, and numbers at the skin."""

    def __init__(self, file, solved_skin=False):
        file = str(file)
        self.file, self.name = file, os.path.basename(file).removesuffix(".h5")
        with reading(file, WHAT):
            self.h5 = h5py.File(file)
            if "step" not in self.h5 or not len(self.h5["step"]) or "model/skin/points" not in self.h5:
                raise Unusable(f"{file}: holds no solved skin; solve it with repose-solve first")
            self.take(solved_skin)

    def take(self, solved_skin):
        self.model = self.h5["model"]
        self.steps = [self.h5["step"][name] for name in sorted(self.h5["step"])]
        self.loads = [step.attrs["load"] for step in self.steps]
        solved, self.used = shown_skin.solved_skin(self.h5)
        shown = solved if solved_skin else shown_skin.shown_skin(self.h5)
        self.corners, self.before, self.solved = shown.corners, shown.before, shown.solved
        self.given = None if len(shown.before) == len(solved.before) else shown
        self.near = None if self.given is None else shown_skin.matching_rows(solved, shown)
        self.walls = self.find_walls()
        self.instruments = []
        self.bones_before, self.bone_corners = np.zeros((0, 3)), np.zeros((0, 3), int)
        if bones := self.model.get("bone_surfaces"):
            self.bones_before = shown_skin.read_places(bones, "points")
            self.bone_corners = shown_skin.read_rows(bones, "triangles", len(self.bones_before))

    def find_walls(self):
        """Quadrilaterals at which tissue ends beside other tissue: the sides of cuts and lips. The
        rim has none beside it, and is not drawn."""
        if not len(self.model.get("prism/points", ())):
            return np.zeros((0, 4), int)
        prisms = shown_skin.read_rows(self.model, "prism/points", len(self.model["point/position"]))
        sides = np.concatenate([prisms[:, corners] for corners in
                                ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))])
        _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True,
                                    return_counts=True)
        ends = sides[first[count == 1]]
        middles = self.model["point/position"][:][ends].mean(axis=1).round(4)  # 0.1 µm
        _, place, count = np.unique(middles, axis=0, return_inverse=True, return_counts=True)
        return ends[count[place.ravel()] > 1]

    def wall(self, step):
        return self.points(step)[self.walls.ravel()]

    def points(self, step):
        return shown_skin.read_places(self.steps[step], "point/position", len(self.model["point/position"]))

    def skin(self, step):
        """The shown skin at a step; a given one goes evenly to where it is at the last."""
        if self.given is None:
            return self.points(step)[self.used]
        share = self.loads[step] / self.loads[-1] if self.loads[-1] > 0 else 1.0
        return self.before + share * (self.given.after - self.before)

    def of_skin(self, numbers):
        """Numbers of the solved skin's vertices at those of the shown skin."""
        return numbers if self.near is None else np.where(self.solved > 0, numbers[self.near], 0.0)

    def bones(self, step):
        if "bone_surface/points" not in self.steps[step]:
            return self.bones_before
        return shown_skin.read_places(self.steps[step], "bone_surface/points", len(self.bones_before))

    def stress(self, step):
        """At each point of the skin the mean of the prisms, or the most of the springs, there."""
        total, count = np.zeros(len(self.model["point/layer"])), 0
        layer = self.model["point/layer"][:]
        if "prism/von_mises" in self.steps[step]:
            prisms = self.model["prism/points"][:]
            top = (layer[prisms] == 0).any(1)
            values, count = self.steps[step]["prism/von_mises"][:][top], np.zeros(len(layer))
            for corner in prisms[top].T:
                np.add.at(total, corner, values)
                np.add.at(count, corner, 1)
            return (total / np.maximum(count, 1))[self.used]
        springs = self.model["spring/points"][:]
        top = (layer[springs] == 0).all(1)
        for end in springs[top].T:
            np.maximum.at(total, end, np.abs(self.steps[step]["spring/tension"][:][top]))
        return total[self.used]

    def state(self, step):
        """Skin, bones and the numbers of each colored column, at a step."""
        with reading(self.file, WHAT):
            return self.read_state(step)

    def read_state(self, step):
        skin = self.skin(step)
        numbers = {"movement": np.linalg.norm(skin - self.before, axis=1), "region": self.solved}
        if "point/advance" in self.steps[step]:
            numbers["advance"] = self.of_skin(self.steps[step]["point/advance"][:][self.used])
        if "prism/von_mises" in self.steps[step] or "spring/tension" in self.steps[step]:
            numbers["stress"] = self.of_skin(self.stress(step))
        return {"skin": skin, "bones": self.bones(step), "walls": self.wall(step),
                "load": self.loads[step], **numbers}

    def first(self):
        """Before the bones move."""
        return {"skin": self.before, "bones": self.bones_before, "load": 0.0,
                "walls": self.model["point/position"][:][self.walls.ravel()]}

    def between(self, load):
        """The state at a load: between two steps everything moves evenly."""
        after = min(int(np.searchsorted(self.loads, load)), len(self.steps) - 1)
        before = max(after - 1, 0)
        width = self.loads[after] - self.loads[before]
        share = (load - self.loads[before]) / width if width > 0 else 1.0
        one, two = self.state(before), self.state(after)
        return {name: (1 - share) * one[name] + share * two[name] for name in two}


def head(column, result):
    """The title of a column."""
    unit = "N/mm²" if "prism/von_mises" in result.steps[-1] else "N"
    return {"movement": "movement, mm", "advance": "outwards, mm",
            "stress": ("stress, " if unit != "N" else "tension, ") + unit,
            "difference": "difference, mm", "region": "computed part"}.get(column, column)


# ----- VTK


def surface(points, corners, numbers=None):
    """A surface with smooth normals, and a number a point."""
    cells = vtk.vtkCellArray()
    offsets = np.arange(0, 3 * len(corners) + 1, 3, dtype=np.int64)
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True),
                  numpy_to_vtkIdTypeArray(corners.ravel().astype(np.int64), deep=True))
    drawn = vtk.vtkPolyData()
    drawn.SetPoints(vtk.vtkPoints())
    drawn.GetPoints().SetData(numpy_to_vtk(points, deep=True))
    drawn.SetPolys(cells)
    if numbers is not None:
        drawn.GetPointData().SetScalars(numpy_to_vtk(numbers, deep=True))
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputData(drawn)
    normals.SplittingOff()
    normals.Update()
    return normals.GetOutput()


def read_mesh(file):
    reader = {".ply": vtk.vtkPLYReader, ".stl": vtk.vtkSTLReader, ".obj": vtk.vtkOBJReader}
    source = reader[os.path.splitext(file)[1].lower()]()
    source.SetFileName(str(file))
    source.Update()
    return source.GetOutput()


def read_instruments(file):
    """[(shape, push)] of a scene, the shapes as the scene gives them: before the push."""
    from sheet.scene import read_scene  # needs PyYAML
    with reading(file, "a scene that repose-solve takes"):
        return [(shape_of(entry, os.path.dirname(os.path.abspath(file))), np.array(entry["push"]))
                for entry in read_scene(file).get("instruments") or []]


def shape_of(entry, folder):
    """A closed surface of an instrument, or the plane of a half-space."""
    if "sphere" in entry:
        source = vtk.vtkSphereSource()
        source.SetCenter(*entry["sphere"]["center"])
        source.SetRadius(entry["sphere"]["radius"])
        source.SetThetaResolution(48)
        source.SetPhiResolution(24)
    elif "capsule" in entry:
        line = vtk.vtkLineSource()
        line.SetPoint1(*entry["capsule"]["from"])
        line.SetPoint2(*entry["capsule"]["to"])
        source = vtk.vtkTubeFilter()
        source.SetInputConnection(line.GetOutputPort())
        source.SetRadius(entry["capsule"]["radius"])
        source.SetNumberOfSides(48)
        source.CappingOn()
    elif "box" in entry:
        source = vtk.vtkCubeSource()
        source.SetCenter(*entry["box"]["center"])
        source.SetXLength(entry["box"]["size"][0])
        source.SetYLength(entry["box"]["size"][1])
        source.SetZLength(entry["box"]["size"][2])
    elif "half_space" in entry:
        source = vtk.vtkRegularPolygonSource()
        source.SetCenter(*entry["half_space"]["point"])
        source.SetNormal(*entry["half_space"]["normal"])
        source.SetRadius(60)
        source.SetNumberOfSides(64)
    else:
        return read_mesh(os.path.join(folder, entry["mesh"]))
    source.Update()
    return source.GetOutput()


def beside(bones, skin):
    """The part of the bones in the box of the skin."""
    box = vtk.vtkBox()
    box.SetBounds(skin.GetBounds())
    clip = vtk.vtkClipPolyData()
    clip.SetInputData(bones)
    clip.SetClipFunction(box)
    clip.InsideOutOn()
    clip.Update()
    return clip.GetOutput()


def colors(column, numbers):
    """The color table of a column: from 0, or as far inwards as outwards."""
    peak = float(np.abs(numbers).max())
    largest = 1.0 if column == "region" or peak < ROUNDING else rounded_up(peak)
    ramp, low = {"advance": (BOTH, -largest), "region": (REGION, 0.0)}.get(column, (RAMP, 0.0))
    table = vtk.vtkColorTransferFunction()
    for i, text in enumerate(ramp):
        red, green, blue = (int(text[k:k + 2], 16) / 255 for k in (0, 2, 4))
        table.AddRGBPoint(low + (largest - low) * i / (len(ramp) - 1), red, green, blue)
    return table


def actor(drawn, color, table=None, opacity=1.0):
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(drawn)
    mapper.SetScalarVisibility(table is not None)
    if table:
        mapper.SetLookupTable(table)
    shown = vtk.vtkActor()
    shown.SetMapper(mapper)
    shown.GetProperty().SetColor(color)
    shown.GetProperty().SetOpacity(opacity)
    shown.GetProperty().SetAmbient(0.2)
    shown.GetProperty().SetDiffuse(0.8)
    shown.GetProperty().SetSpecular(0.12)
    shown.GetProperty().SetSpecularPower(25)
    return shown


def renderer(actors):
    """A white scene lit from three sides of the camera."""
    scene = vtk.vtkRenderer()
    scene.SetBackground(1, 1, 1)
    scene.SetUseDepthPeeling(True)
    scene.SetMaximumNumberOfPeels(8)
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


def extent(points, view):
    """Middle, half width and half height of points seen from a view."""
    forward = -np.array(VIEWS[view]) / np.linalg.norm(VIEWS[view])
    right = np.cross(forward, (0, 0, 1)) / np.linalg.norm(np.cross(forward, (0, 0, 1)))
    frame = np.array([right, np.cross(right, forward), forward])
    seen = points @ frame.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    return (low + high) / 2 @ frame, *((high - low)[:2] / 2)


def look(scene, view, middle, half_height):
    camera = scene.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(m + 1000 * v for m, v in zip(middle, VIEWS[view])))
    camera.SetViewUp(0, 0, 1)
    camera.SetParallelScale(half_height)
    scene.ResetCameraClippingRange()


def label(text):
    scene = renderer([])
    drawn = vtk.vtkTextActor()
    drawn.SetInput(text)
    drawn.GetTextProperty().SetColor(INK)
    drawn.GetTextProperty().SetFontSize(SUPER * TEXT)
    drawn.GetTextProperty().SetJustificationToCentered()
    drawn.GetPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
    drawn.GetPositionCoordinate().SetValue(0.5, 0.25)
    scene.AddViewProp(drawn)
    return scene


def color_bar(table):
    scene = renderer([])
    bar = vtk.vtkScalarBarActor()
    bar.SetLookupTable(table)
    bar.SetOrientationToHorizontal()
    bar.SetNumberOfLabels(3)
    bar.SetLabelFormat("{:.2g}" if vtk_version() >= (9, 6) else "%.2g")
    bar.UnconstrainedFontSizeOn()
    text = bar.GetLabelTextProperty()
    text.SetColor(INK)
    text.SetFontSize(SUPER * TEXT)
    text.BoldOff()
    text.ItalicOff()
    text.ShadowOff()
    bar.SetBarRatio(0.35)
    bar.SetPosition(0.12, 0.05)
    bar.SetWidth(0.76)
    bar.SetHeight(0.85)
    scene.AddViewProp(bar)
    return scene


def actors(column, state, result, tables):
    """The skin, and what is seen through it or where it is open: bones, the sides of cuts."""
    if column == "before":
        state = result.first()
    table = tables.get(column)
    skin = surface(state["skin"], result.corners, state[column] if table else None)
    drawn = []
    if len(result.bone_corners):
        bones = beside(surface(state["bones"], result.bone_corners), skin)
        drawn.append(actor(bones, GREY if table else IVORY))
    if column != "bones" and len(result.walls):
        fan = 4 * np.arange(len(result.walls))[:, None, None] + [[0, 1, 2], [0, 2, 3]]
        drawn.append(actor(surface(state["walls"], fan.reshape(-1, 3)), FLESH))
    for shape, push in result.instruments:
        drawn.append(actor(shape, STEEL, opacity=0.6))
        drawn[-1].SetPosition(*(state["load"] * push))
    return [*drawn, actor(skin, SKIN, table, 0.35 if column == "bones" else 1.0)]


class Sheet:
    """A window that scenes are put on, in pixels from the upper left corner."""

    def __init__(self, width, height):
        self.width, self.height = width, int(height)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetAlphaBitPlanes(True)
        self.window.SetMultiSamples(0)
        self.window.SetSize(SUPER * width, SUPER * self.height)

    def put(self, scene, left, top, width, height):
        scene.SetViewport(left / self.width, 1 - (top + height) / self.height,
                          (left + width) / self.width, 1 - top / self.height)
        self.window.AddRenderer(scene)

    def pixels(self):
        """[height, width, 3]; the filter renders."""
        image = vtk.vtkWindowToImageFilter()
        image.SetInput(self.window)
        image.ReadFrontBufferOff()
        small = vtk.vtkImageShrink3D()
        small.SetInputConnection(image.GetOutputPort())
        small.SetShrinkFactors(SUPER, SUPER, 1)
        small.Update()
        flat = vtk_to_numpy(small.GetOutput().GetPointData().GetScalars())
        wide, high, _ = small.GetOutput().GetDimensions()
        return flat.reshape(high, wide, 3)[::-1]


class Panel:
    """A column of the picture: a way to see one result at one state."""

    def __init__(self, column, result, state, title):
        self.column, self.result, self.state, self.title = column, result, state, title


def panels(results, states, columns):
    """The panels of one result, or of two beside each other with their difference."""
    if len(results) == 1:
        return [Panel(column, results[0], states[0], head(column, results[0])) for column in columns]
    made = []
    for column in columns:
        once = column in ("before", "region")
        made += [Panel(column, result, state, head(column, result) if once else
                       f"{result.name}: {head(column, result)}")
                 for result, state in list(zip(results, states))[:1 if once else 2]]
    apart = difference(results, states)
    made.append(Panel("difference", results[1], {**states[1], "difference": apart},
                      head("difference", results[1])))
    return made


def difference(results, states):
    """Distances between the faces of two results, mm, at the vertices of the second."""
    first, second = (state["skin"] - result.before for result, state in zip(results, states))
    near = shown_skin.rows_of_patient(*results, [result.file for result in results])
    return np.linalg.norm(second - first[near], axis=1)


def scales(drawn):
    """The color table of each colored column, one for all panels of it."""
    numbers, stress = {}, {head(panel.column, panel.result): panel.result.name for panel in drawn
                           if panel.column == "stress"}
    if len(stress) > 1:
        raise Unusable(", ".join(f"{name} has {unit}" for unit, name in stress.items()) + ": draw them one by one")
    for panel in drawn:
        if panel.column in (*COLORED, "difference"):
            numbers.setdefault(panel.column, []).append(panel.state[panel.column])
    return {column: colors(column, np.concatenate(values)) for column, values in numbers.items()}


def instrument_points(result):
    """Points of each instrument before and after its push."""
    shapes = [(vtk_to_numpy(shape.GetPoints().GetData()), push)
              for shape, push in result.instruments]
    return [points + share * push for points, push in shapes for share in (0, 1)]


def picture(drawn, views, tables, title=""):
    """A sheet of one row a view, cropped to skin and instruments, and one column a panel."""
    margin, wide, result = 1.05, COLUMN, drawn[0].result
    shown = np.concatenate([result.before, result.skin(-1), *instrument_points(result)])
    frames = [extent(shown, view) for view in views]
    scale = wide / (2 * margin * max(across for _, across, _ in frames))  # pixels per mm
    rows = [2 * margin * up * scale for _, _, up in frames]
    bars = BAR if tables else 0
    sheet = Sheet(wide * len(drawn), TITLE * (1 + bool(title)) + sum(rows) + bars)
    if title:
        sheet.put(label(title), 0, 0, sheet.width, TITLE)
    for i, panel in enumerate(drawn):
        top = TITLE * (1 + bool(title))
        sheet.put(label(panel.title), i * wide, top - TITLE, wide, TITLE)
        seen = actors(panel.column, panel.state, panel.result, tables)
        for view, (middle, _, up), high in zip(views, frames, rows):
            scene = renderer(seen)
            sheet.put(scene, i * wide, top, wide, high)
            look(scene, view, middle, margin * up)
            top += high
        table = tables.get(panel.column)
        sheet.put(color_bar(table) if table else renderer([]), i * wide, top, wide, bars)
    return sheet.pixels()


def write_picture(pixels, target):
    image = vtk.vtkImageData()
    image.SetDimensions(pixels.shape[1], pixels.shape[0], 1)
    flat = np.ascontiguousarray(pixels[::-1].reshape(-1, 3))
    image.GetPointData().SetScalars(numpy_to_vtk(flat, deep=True))
    writer = vtk.vtkPNGWriter()
    writer.SetInputData(image)
    writer.WriteToMemoryOn()
    writer.Write()
    target.write(vtk_to_numpy(writer.GetResult()).tobytes())


def write_film(frames, target):
    try:
        from PIL import Image
    except ImportError:
        refuse("-film needs Pillow: pip install pillow, or apt-get install python3-pil")
    images = [Image.fromarray(np.ascontiguousarray(frame)) for frame in frames]
    hold = [80] * (len(images) - 1) + [1500]  # ms
    film = io.BytesIO()
    images[0].save(film, format="GIF", save_all=True, append_images=images[1:], duration=hold, loop=0)
    target.write(film.getvalue())


def state_of(result, chosen):
    """The state that is drawn of a result; refuses steps and columns that it has not."""
    last = len(result.steps) - 1
    if chosen.step != "last" and not (chosen.step.isdecimal() and int(chosen.step) <= last):
        refuse(f"-step {chosen.step}: {result.name}.h5 has the steps 0 to {last}, or last")
    state = result.state(last if chosen.step == "last" else int(chosen.step))
    for column in chosen.columns:
        if column in COLORED and column not in state:
            refuse(f"-columns {column}: {result.name}.h5 does not have it; solve it again")
    return state


def main():
    chosen = arguments()
    find_screen()
    load_modules()
    results = [Result(file + ".h5", chosen.solved_skin) for file in chosen.names]
    for result, name in zip(results, own_names(chosen.names)):
        result.name = name
    if chosen.scene:
        from sheet.scene import require_same_bones  # needs PyYAML
        require_same_bones(chosen.scene, {result.file: [name.decode() for name in result.model.get("bone", ())]
                                          for result in results})
        for result in results:
            result.instruments = read_instruments(chosen.scene)
    states = [state_of(result, chosen) for result in results]
    drawn = panels(results, states, chosen.columns)
    tables = scales(drawn)
    if chosen.film:
        loads = np.linspace(0, states[0]["load"], chosen.frames)
        write_film([picture(panels(results, [results[0].between(load)], chosen.columns), chosen.views,
                            tables, f"load {load:.2f}") for load in loads], chosen.output)
    else:
        write_picture(picture(drawn, chosen.views, tables), chosen.output)
    print(chosen.output)


if __name__ == "__main__":
    run(main)
