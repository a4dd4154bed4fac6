#!/usr/bin/env python3
"""A picture of a scene before it is solved: what is cut, moved, solved and held.

    drivers/proposal.py plan/scene.yaml [-output plan/proposal.png]

Upper row: bones (ivory), the pieces that move where they are (gray) and where they go (orange), planes
of cuts (blue), landmarks with their short names. Lower row: the skin, the part that is solved (green),
its border (black), incisions and the parting of the lips (red), boxes (blue). Needs what drivers/render.py needs, and
PyYAML; surfaces of a scene are files, not volumes.
"""

import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import plan  # noqa: E402
import render  # noqa: E402
from sheet.landmarks import read_landmarks  # noqa: E402
from sheet.scene import named_file, read_scene  # noqa: E402
from sheet.script import Arguments, Unusable, reading, refuse, require_file, start  # noqa: E402
from sheet.script import run as run_script  # noqa: E402
from sheet.whole_file import Target  # noqa: E402

ORANGE, BLUE, GREEN, RED = (0.93, 0.53, 0.18), (0.20, 0.45, 0.80), (0.30, 0.68, 0.55), (0.80, 0.12, 0.15)
WIDE, MARGIN, PLANE = 620, 1.1, 42  # pixels; beside the head; mm, half the side of a plane's square
SHORT = {"nasion_bone": "N", "nasal_spine": "ANS", "a_point": "A", "upper_incisor_edge": "U1",
         "lower_incisor_edge": "L1", "b_point": "B", "pogonion_bone": "Pog", "menton_bone": "Me",
         "condyle_right_center": "Co", "condyle_left_center": "Co", "gonion_right": "Go",
         "gonion_left": "Go"}


def run(*command):
    done = start(*command, capture_output=True, text=True)
    if done.returncode:
        refuse(done.stderr.strip() or f"{command[0]} ended with status {done.returncode}")


def parts_of(file, work):
    """(mesh, mesh where it goes or None) of each bone and piece after the cuts."""
    run(plan.find_program("repose-osteotomy"), file, "-moved", "-output", work / "cut")
    found = {made.stem: render.read_mesh(made) for made in sorted(work.glob("cut_*.ply"))}
    return [(mesh, found.get(f"{name}_moved")) for name, mesh in found.items()
            if not (name.endswith("_moved") and name.removesuffix("_moved") in found)]


def square(at, normal):
    """A plane of a cut as a square about its point."""
    normal = np.array(normal) / np.linalg.norm(normal)
    side = np.cross(normal, (1, 0, 0) if abs(normal[0]) < 0.9 else (0, 1, 0))
    side /= np.linalg.norm(side)
    up = np.cross(normal, side)
    source = vtk.vtkPlaneSource()
    corner = np.array(at) - PLANE * (side + up)
    source.SetOrigin(*corner)
    source.SetPoint1(*(corner + 2 * PLANE * side))
    source.SetPoint2(*(corner + 2 * PLANE * up))
    source.Update()
    return source.GetOutput()


def tube(drawn, radius):
    made = vtk.vtkTubeFilter()
    made.SetInputData(drawn)
    made.SetRadius(radius)
    made.SetNumberOfSides(12)
    made.Update()
    return made.GetOutput()


def polyline(points):
    source = vtk.vtkLineSource()
    line = vtk.vtkPoints()
    for point in points:
        line.InsertNextPoint(*point)
    source.SetPoints(line)
    source.Update()
    return source.GetOutput()


def border(mesh):
    edges = vtk.vtkFeatureEdges()
    edges.SetInputData(mesh)
    edges.BoundaryEdgesOn()
    edges.FeatureEdgesOff()
    edges.NonManifoldEdgesOff()
    edges.ManifoldEdgesOff()
    edges.ColoringOff()
    edges.Update()
    return edges.GetOutput()


def ball(at, radius):
    source = vtk.vtkSphereSource()
    source.SetCenter(*at)
    source.SetRadius(radius)
    source.SetThetaResolution(20)
    source.SetPhiResolution(20)
    source.Update()
    return source.GetOutput()


def name_tag(text, at):
    shown = vtk.vtkBillboardTextActor3D()
    shown.SetInput(text)
    shown.SetPosition(*at)
    shown.SetDisplayOffset(9 * render.SUPER, 2 * render.SUPER)
    style = shown.GetTextProperty()
    style.SetFontSize(16 * render.SUPER)
    style.SetColor(RED)
    style.BoldOn()
    style.SetBackgroundColor(1, 1, 1)
    style.SetBackgroundOpacity(0.6)
    return shown


def box_edges(box):
    source = vtk.vtkOutlineSource()
    source.SetBounds(*(box[side + axis] for axis in range(3) for side in (0, 3)))
    source.Update()
    return source.GetOutput()


def boxes_of(scene):
    entries = [scene.get("skin"), scene.get("tissue", {}).get("face"), *scene["bones"]]
    boxes = [entry["box"] for entry in entries if isinstance(entry, dict) and "box" in entry]
    return [box if len(box) == 6 else [*box[0], *box[1]] for box in boxes]


def bones_drawn(scene, parts, marks):
    """Bones, pieces before and after, planes; and before them the landmarks."""
    drawn = []
    for mesh, moved in parts:
        if moved is None:
            drawn.append(render.actor(mesh, render.IVORY))
        else:
            drawn += [render.actor(mesh, render.GREY, opacity=0.35), render.actor(moved, ORANGE)]
    for cut in scene.get("osteotomies") or []:
        for plane in cut.get("planes") or []:
            side = square(plane["point"], plane["normal"])
            drawn += [render.actor(side, BLUE, opacity=0.25), render.actor(tube(border(side), 0.5), BLUE)]
    return drawn, [shown for name, at in marks.items() if name in SHORT
                   for shown in (render.actor(ball(at, 1.6), RED), name_tag(SHORT[name], at))]


def incisions_of(file):
    """Points along each incision, from the markups that repose-solve -dry_run writes where there are any."""
    lines = {}
    for name, at in sorted(read_landmarks(file).items()) if file.exists() else []:
        lines.setdefault(name.rsplit(" ", 1)[0], []).append(at)
    return lines


def skin_drawn(scene, skin, solved, incisions):
    """The skin, before it what of it is solved and its border, before that incisions and boxes."""
    drawn = [render.actor(solved, GREEN), render.actor(tube(border(solved), 0.8), render.INK)]
    lines = [render.actor(tube(box_edges(box), 0.6), BLUE) for box in boxes_of(scene)]
    lines += [render.actor(tube(polyline(path), 1.0), RED) for path in incisions.values()]
    return [render.actor(skin, render.SKIN)], drawn, lines


def legend_of(scene, incisions):
    """Titles of both rows, which name what is drawn."""
    planes = any(cut.get("planes") for cut in scene.get("osteotomies") or [])
    cut = " and ".join(sorted({"lips" if name.startswith("mouth") else "incisions" for name in incisions}))
    return (f"bones; moved pieces (orange){', cuts (blue)' if planes else ''}, landmarks",
            f"solved skin (green), its border{f', {cut} (red)' if cut else ''}")


def draw(rows, frame, legend, output):
    views = list(render.VIEWS)
    extents = [render.extent(frame, view) for view in views]
    scale = WIDE / (2 * MARGIN * max(across for _, across, _ in extents))
    high = 2 * MARGIN * max(up for _, _, up in extents) * scale
    sheet = render.Sheet(WIDE * len(views), 2 * (render.TITLE + high))
    sheet.window.SetNumberOfLayers(3)
    for r, (make, title) in enumerate(zip(rows, legend)):
        top = r * (render.TITLE + high)
        sheet.put(render.label(title), 0, top, sheet.width, render.TITLE)
        for i, (view, (middle, _, _)) in enumerate(zip(views, extents)):
            for layer, shown in enumerate(make()):
                scene = render.renderer(shown)
                scene.SetLayer(layer)
                sheet.put(scene, i * WIDE, top + render.TITLE, WIDE, high)
                render.look(scene, view, middle, high / scale / 2)
    render.write_picture(sheet.pixels(), output)


def arguments():
    parser = Arguments(__doc__)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("-output", type=pathlib.Path)
    chosen = parser.parse_args()
    require_file(chosen.scene, "give a scene file (.yaml)")
    chosen.output = Target(chosen.output or chosen.scene.with_name("proposal.png"), ".png", [chosen.scene])
    return chosen


def main():
    global np, vtk
    chosen = arguments()
    render.find_screen()
    render.load_modules()
    np, vtk = render.np, render.vtk
    file = chosen.scene
    scene = read_scene(file)
    if not isinstance(scene.get("skin"), str):
        raise Unusable(f"{file}: its skin is no file; make one with repose-isosurface")
    named = named_file(file, "landmarks")
    marks = read_landmarks(named) if named else {}
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        parts = parts_of(file, work)
        run(plan.find_program("repose-solve"), file, "-dry_run", "-output", work / "model")
        solved = render.read_mesh(work / "model_solved_skin.ply")
        incisions = incisions_of(work / "model_incisions.mrk.json")
    skin = render.read_mesh(file.parent / scene["skin"])
    frame = np.concatenate([render.vtk_to_numpy(mesh.GetPoints().GetData())
                            for mesh in (*(mesh for mesh, _ in parts), solved)])
    with reading(file, "a scene that repose-solve takes"):
        rows = (lambda: bones_drawn(scene, parts, marks), lambda: skin_drawn(scene, skin, solved, incisions))
        draw(rows, frame, legend_of(scene, incisions), chosen.output)
    print(chosen.output)


if __name__ == "__main__":
    run_script(main)
