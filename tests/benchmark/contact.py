#!/usr/bin/env python3
"""What contact changes on a real head and what it costs: two tables and a picture.

    tests/benchmark/contact.py [-bin build/bin] [-head ../shared/data/head]
                               [-output docs/measurements/contact.md] [-accuracy 0.01]
                               [-cases jaw_forward,…] [-picture contact.png]

The first table: moves of the jaws, each with tissue near the moved bone let go (neither contact
nor any hold there), tied to the bones, sliding on them, and touching them, the default. Lips are
parted. Points inside bone are free ones that are deeper in one of the moved surfaces than at the
start, by more than 0.1 mm, against the triangles themselves (VTK), not the smoothed distances that
the program uses. Regions are balls on the skin. The second table: the default on 1, 2 and 3 ranks
and in 1, 2 and 5 load steps, against the first. Needs: pip install vtk h5py matplotlib
"""

import pathlib
import tempfile

import h5py
import numpy as np
import vtk

from measure import run
from page import PROJECT, option_parser, print_table
from tissue import last, model_of

SURFACES = ["skin.ply", "skull.ply", "mandible.ply"]
JAW = "mouth"  # the scene whose moves the three of the jaw replace
TURN = "{bone: mandible, rotate: {axis: [0.9995, 0.0038, -0.0327], center: [2.4, -208.2, 398.3], angle: 8}}"
CASES = {
    "jaw 6 mm forward": (JAW, "  - {bone: mandible, translate: [0, -6, 0]}\n"),
    "jaw 8 mm back": (JAW, "  - {bone: mandible, translate: [0, 8, 0]}\n"),
    "jaw opened by 8°": (JAW, f"  - {TURN}\n"),
    "Le Fort I": ("le_fort", None),
    "genioplasty": ("genioplasty", None),
    "sagittal split": ("split", None),
}
WAYS = {
    "let go": "  released: free\n",
    "tied": "  released: fixed\n",
    "slide": "  attach: slide\n  released: slide\n",
    "contact": "",
}
OFF = "contact: {bones: off, cuts: off}\n"
REGIONS = {"upper lip": ([2, -310, 376], 10), "lower lip": ([2, -309, 360], 9),
           "chin": ([3, -304, 343], 12), "cheeks": ([44, -280, 368], 16)}
HEAD = ("| move | tissue | evaluations | Hessians | search's time | inside bone: points, deepest mm "
        "| penetration said, mm | skin from contact's, mm: " + ", ".join(REGIONS)
        + " |\n|---|---" + "|--:" * 6 + "|")
AGREE = ("| move | ranks | load steps | evaluations | Hessians | skin from the first, mm: largest, "
         "99 % | estimate, mm |\n|---" + "|--:" * 6 + "|")
RUNS = [(1, 0), (2, 0), (3, 0), (1, 2), (1, 5)]


def scene_of(case, way):
    name, moves = CASES[case]
    text = (PROJECT / f"meshes/real_head_{name}.yaml").read_text()
    if moves:
        text = text.partition("moves:\n")[0] + "moves:\n" + moves
    text = text.replace("  layers: 4", WAYS[way] + "  layers: 4")
    return text + OFF * (way == "let go")


def solve(case, way, chosen, folder, ranks=1, steps=0):
    scene = folder / "scene.yaml"
    scene.write_text(scene_of(case, way))
    options = ["-load_steps", steps] if steps else []
    done = run([chosen.bin / "repose-solve", scene, "-output", "face", "-accuracy",
                chosen.accuracy, *options], folder, ranks)
    return done, folder / "face.h5"


def skin(file):
    """Vertices of the skin at the start, and their displacements."""
    model, step = model_of(file), last(file)
    on_skin = model["point/layer"] == 0
    return model["point/position"][on_skin], step["point/displacement"][on_skin]


def implicit(points, triangles):
    """The exact signed distance of a closed surface, negative inside."""
    data, corners, faces = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    for point in points:
        corners.InsertNextPoint(point)
    for triangle in triangles:
        faces.InsertNextCell(3, triangle.tolist())
    data.SetPoints(corners)
    data.SetPolys(faces)
    distance = vtk.vtkImplicitPolyDataDistance()
    distance.SetInput(data)
    return distance.EvaluateFunction


def inside_bone(file):
    """How many free points are deeper in a bone than at the start, and by how much, mm."""
    with h5py.File(file) as result:
        surfaces = {k: v[:] for k, v in result["model/bone_surfaces"].items()}
        moves = result["model/bone_transform"][:]
    model, step = model_of(file), last(file)
    free = model["point/set"] == 0
    before, now = model["point/position"][free], step["point/position"][free]
    deeper = np.zeros(len(now))
    for bone, move in enumerate(moves):
        distance = implicit(surfaces["points"], surfaces["triangles"][surfaces["bone"] == bone])
        beside = (now - move[:3, 3]) @ move[:3, :3]
        low, high = (f(surfaces["points"][surfaces["triangles"][surfaces["bone"] == bone]]
                       .reshape(-1, 3), axis=0) for f in (np.min, np.max))
        for row in np.flatnonzero(((beside > low) & (beside < high)).all(axis=1)):
            depth = -distance(beside[row])
            if depth > 0.1:
                deeper[row] = max(deeper[row], depth - max(0, -distance(before[row])))
    return np.count_nonzero(deeper > 0.1), deeper.max()


def by_region(places, difference):
    size = np.linalg.norm(difference, axis=1)
    return ", ".join(f"{size[np.linalg.norm(places - center, axis=1) < radius].mean():.2f}"
                     for center, radius in REGIONS.values())


def compare_ways(chosen, folder, faces):
    """Rows of the first table; keeps all displacements of the skin in `faces`."""
    for case in chosen.cases.split(","):
        found = {}
        for way in WAYS:
            done, file = solve(case, way, chosen, folder)
            said = done.said.get("penetration", "–").split()[0]
            found[way] = (done.evaluations, done.stages["solve"][0], inside_bone(file), said,
                          *skin(file))
            faces[case, way] = found[way][4:]
        places, reference = found["contact"][4:]
        for way, (work, seconds, (count, deepest), said, _, moved) in found.items():
            yield (f"| {case} | {way} | {work[0]} | {work[1]} | "
                   f"{seconds / found['let go'][1]:.1f} | {count}, {deepest:.2f} | {said} | "
                   f"{by_region(places, moved - reference) if way != 'contact' else '–'} |")


def compare_runs(chosen, folder):
    for case in chosen.cases.split(","):
        first = None
        for ranks, steps in RUNS:
            done, file = solve(case, "contact", chosen, folder, ranks, steps)
            _, moved = skin(file)
            first = moved if first is None else first
            far = np.linalg.norm(moved - first, axis=1)
            yield (f"| {case} | {ranks} | {steps or 'automatic'} | {done.evaluations[0]} | "
                   f"{done.evaluations[1]} | {far.max():.3f}, {np.quantile(far, 0.99):.3f} | "
                   f"{last(file)['displacement_error']:.3f} |")


def draw(faces, chosen):
    """The mean plane's profile of each move: at the start, let go, tied, sliding, touching."""
    from matplotlib import pyplot
    cases = chosen.cases.split(",")
    figure, axes = pyplot.subplots(1, len(cases), figsize=(3.2 * len(cases), 5.2), squeeze=False)
    for axis, case in zip(axes[0], cases):
        for way in ["start", *WAYS]:
            places, moved = faces[case, "contact" if way == "start" else way]
            now = places + moved * (way != "start")
            middle = np.abs(places[:, 0] - 2.5) < 3
            profile = now[middle & (places[:, 1] < -285)]
            profile = profile[np.argsort(places[middle & (places[:, 1] < -285)][:, 2])]
            axis.plot(-profile[:, 1], profile[:, 2], label=way,
                      color="0.6" if way == "start" else None)
        axis.set(title=case, aspect="equal", ylim=(325, 395))
    axes[0][0].legend(loc="lower left")
    figure.tight_layout()
    figure.savefig(chosen.picture, dpi=110)


def main():
    chosen = option_parser(__doc__, cases=",".join(CASES), accuracy=0.01,
                           head=str(PROJECT.parent / "shared/data/head"), picture="").parse_args()
    faces = {}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file in [*(pathlib.Path(chosen.head) / f for f in SURFACES),
                     PROJECT / "meshes/real_head_split.obj"]:
            (folder / file.name).symlink_to(file.resolve())
        print_table(HEAD, compare_ways(chosen, folder, faces), chosen.output, "ways")
        print_table(AGREE, compare_runs(chosen, folder), chosen.output, "runs")
    if chosen.picture:
        draw(faces, chosen)


if __name__ == "__main__":
    main()
