#!/usr/bin/env python3
"""Measures contact on a real head, its cost, and agreement of faces: tables and a picture.

    tests/benchmark/contact.py [-bin build/bin] [-head ../shared/data/head] [-accuracy 0.01]
                               [-output docs/measurements/contact.md] [-cases "jaw 8 mm back,…"]
                               [-tables cost,runs,estimates,searches,ways] [-picture contact.png]
                               [-dilatation prism]

cost: each move with parted and with fused lips, with contact and without it. runs: the same on 1, 2, 3
and 5 ranks and in 2, 5 and 10 load steps, against one rank and automatic steps. estimates: the stated
distance to rest against the largest of all points to the same rest position, found far finer. searches: the present
search and a logarithmic barrier (benchmark_barrier), lips parted. ways: tissue near the moved bone let
go (neither contact nor any hold there), tied to the bones, sliding on them, and touching them, the
default; lips are parted. Points inside bone are free ones that are deeper in one of the moved surfaces
than at the start, by more than 0.1 mm, against the triangles themselves (VTK), not the smoothed
distances that the program uses; points inside the other lip are deeper than 0.2 mm in its prisms.
Regions are balls on the skin. Times are of the search alone.
Needs: pip install vtk h5py matplotlib
"""

import concurrent.futures
import pathlib
import re
import tempfile

import h5py
import numpy as np
import vtk

from measure import run
from page import PROJECT, option_parser, print_table
from overlap import depths
from tissue import last, model_of, skin

SURFACES = ["skin.ply", "skull.ply", "mandible.ply"]
JAW = "mouth"  # the scene whose moves the three of the jaw replace
TURN = ("  - {{bone: mandible, rotate: {{axis: [0.9995, 0.0038, -0.0327], center: [2.4, -208.2, 398.3], "
        "angle: {}}}}}\n")
SHIFT = "  - {{bone: mandible, translate: [0, {}, 0]}}\n"
CASES = {
    "jaw 6 mm forward": (JAW, SHIFT.format(-6)),
    "jaw 8 mm back": (JAW, SHIFT.format(8)),
    "jaw opened by 8°": (JAW, TURN.format(8)),
    "jaw opened by 15°": (JAW, TURN.format(15)),
    "8° and 6 mm forward": (JAW, TURN.format(8) + SHIFT.format(-6)),
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
COST = ("| move | lips | evaluations, Hessians | without contact | search's time | … with another rest "
        "position | inside bone: points, deepest mm | inside the other lip: points, deepest mm "
        "| another rest position, mm |\n|---|---" + "|--:" * 7 + "|")
AGREE = ("| move | lips | evaluations, one step | ten steps | ranks 2, 3, 5: mm | load steps 2, 5, 10: mm "
         "| not converged |\n|---|---" + "|--:" * 5 + "|")
ESTIMATES = ("| move | lips | stated, mm | true, mm | true / stated | evaluations | … to the finer one |\n"
             "|---|---" + "|--:" * 5 + "|")
SEARCHES = ("| move | search | evaluations | Hessians or Newton systems | search's time | exact penetration, "
            "mm | skin from the present search's, mm |\n|---|---" + "|--:" * 5 + "|")
KINDS = {"ranks": [(2, 0), (3, 0), (5, 0)], "steps": [(1, 2), (1, 5), (1, 10)]}
LIPS = ["parted", "fused"]


def scene_of(case, way="contact", lips="parted"):
    name, moves = CASES[case]
    text = (PROJECT / f"meshes/real_head_{name}.yaml").read_text()
    if moves:
        text = text.partition("moves:\n")[0] + "moves:\n" + moves
    if lips == "fused":
        text = re.sub(r"mouth:.*\n  path:.*\n", "", text)
    text = text.replace("  layers: 4", WAYS[way] + "  layers: 4")
    return text + OFF * (way == "let go")


def solve(text, chosen, folder, ranks=1, steps=0, options=(), program=None):
    """Solves a scene in a folder of its own."""
    own = pathlib.Path(tempfile.mkdtemp(dir=folder))
    for file in folder.iterdir():
        if file.is_symlink():
            (own / file.name).symlink_to(file.resolve())
    dilatation = f"preset: face, dilatation: {chosen.dilatation}"
    (own / "scene.yaml").write_text(text.replace("preset: face", dilatation))
    steps = ["-load_steps", steps] if steps else []
    done = run([(program or chosen.bin) / "repose-solve", "scene.yaml", "-output", "face",
                "-accuracy", chosen.accuracy, *steps, *options], own, ranks)
    return done, own / "face.h5"


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


def encloses(points, triangles, place):
    """Returns whether the solid angles of a closed surface add up to a whole turn: VTK's sign, from the nearest
    triangle's normal, is wrong beside slivers."""
    a, b, c = np.moveaxis(points[triangles] - place, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    angle = np.arctan2(volume, la * lb * lc + np.einsum("ij,ij->i", a, b) * lc
                       + np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb)
    return abs(angle.sum()) > np.pi


def inside_bone(file):
    """Number of free points that are deeper in a bone than at the start, and the difference, mm."""
    with h5py.File(file) as result:
        surfaces = {k: v[:] for k, v in result["model/bone_surfaces"].items()}
        moves = result["model/bone_transform"][:]
    model, step = model_of(file), last(file)
    free = model["point/set"] == 0
    before, now = model["point/position"][free], step["point/position"][free]
    deeper = np.zeros(len(now))
    for bone, move in enumerate(moves):
        triangles = surfaces["triangles"][surfaces["bone"] == bone]
        distance = implicit(surfaces["points"], triangles)
        beside = (now - move[:3, 3]) @ move[:3, :3]
        low, high = (f(surfaces["points"][triangles].reshape(-1, 3), axis=0) for f in (np.min, np.max))
        for row in np.flatnonzero(((beside > low) & (beside < high)).all(axis=1)):
            depth = -distance(beside[row])
            if depth > 0.1 and encloses(surfaces["points"], triangles, beside[row]):
                deeper[row] = max(deeper[row], depth - max(0, -distance(before[row])))
    return np.count_nonzero(deeper > 0.1), deeper.max()


def by_region(places, difference):
    size = np.linalg.norm(difference, axis=1)
    return ", ".join(f"{size[np.linalg.norm(places - center, axis=1) < radius].mean():.2f}"
                     for center, radius in REGIONS.values())


def compare_ways(chosen, folder, faces):
    """Rows of the table of ways; keeps all displacements of the skin in `faces`."""
    for case in chosen.cases.split(","):
        found = {}
        for way in WAYS:
            done, file = solve(scene_of(case, way), chosen, folder, options=["-skip_other_rest"])
            message = done.message.get("penetration", "–").split()[0]
            found[way] = (done.evaluations, done.stages["solve"][0], inside_bone(file), message,
                          *skin(file))
            faces[case, way] = found[way][4:]
        places, reference = found["contact"][4:]
        for way, (work, seconds, (count, deepest), message, _, moved) in found.items():
            yield (f"| {case} | {way} | {work[0]} | {work[1]} | "
                   f"{seconds / found['let go'][1]:.1f} | {count}, {deepest:.2f} | {message} | "
                   f"{by_region(places, moved - reference) if way != 'contact' else '–'} |")


def compare_cost(chosen, folder):
    for case in chosen.cases.split(","):
        for lips in LIPS:
            text = scene_of(case, lips=lips)
            alone, file = solve(text, chosen, folder, options=["-skip_other_rest"])
            full, _ = solve(text, chosen, folder)
            off, _ = solve(text + OFF, chosen, folder)
            count, deepest = inside_bone(file)
            passed = depths(file) if lips == "parted" else np.zeros(0)
            other = re.search(r"up to (\S+) mm", full.message.get("other rest position", ""))
            least = off.stages["solve"][0]
            yield (f"| {case} | {lips} | {alone.evaluations[0]}, {alone.evaluations[1]} | "
                   f"{off.evaluations[0]}, {off.evaluations[1]} | "
                   f"{alone.stages['solve'][0] / least:.1f} | {full.stages['solve'][0] / least:.1f} | "
                   f"{count}, {deepest:.2f} | {np.count_nonzero(passed > 0.2)}, {passed.max(initial=0):.2f} | "
                   f"{other.group(1) if other else '–'} |")


def compare_runs(chosen, folder):
    def skin_of(text, ranks, steps):
        done, file = solve(text, chosen, folder, ranks, steps)
        return done, skin(file)[1]

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for case in chosen.cases.split(","):
            for lips in LIPS:
                text = scene_of(case, lips=lips)
                runs = {kind: [pool.submit(skin_of, text, *run) for run in KINDS[kind]]
                        for kind in KINDS}
                one, first = skin_of(text, 1, 0)
                failed, worst = int(one.status != 0), {}
                for kind, results in runs.items():
                    good = [moved for done, moved in (r.result() for r in results)
                            if done.status == 0]
                    failed += len(results) - len(good)
                    apart = [np.linalg.norm(moved - first, axis=1) for moved in good]
                    far = max(apart, key=np.max, default=np.full(1, np.nan))
                    worst[kind] = f"{far.max():.4f}, 99 % {np.quantile(far, 0.99):.4f}"
                ten = runs["steps"][-1].result()[0]
                yield (f"| {case} | {lips} | {one.evaluations[0]} | {ten.evaluations[0]} | "
                       f"{worst['ranks']} | {worst['steps']} | {failed} |")


def compare_estimates(chosen, folder):
    for case in chosen.cases.split(","):
        for lips in LIPS:
            found = [solve(scene_of(case, lips=lips), chosen, folder,
                           options=["-accuracy", accuracy, "-skip_other_rest"])
                     for accuracy in (0.02, 0.0005)]
            rough, fine = (last(file) for _, file in found)
            apart = np.linalg.norm(rough["point/position"] - fine["point/position"], axis=1).max()
            stated = rough["displacement_error"]
            yield (f"| {case} | {lips} | {stated:.4f} | {apart:.4f} | {apart / stated:.2f} | "
                   + " | ".join(str(done.evaluations[0]) for done, _ in found) + " |")


def compare_searches(chosen, folder):
    for case in chosen.cases.split(","):
        text = scene_of(case)
        done, file = solve(text, chosen, folder, options=["-skip_other_rest"])
        yield (f"| {case} | present | {done.evaluations[0]} | {done.evaluations[1]} | 1.0 | "
               f"{last(file)['penetration_exact']:.2f} | – |")
        barrier = run([chosen.bin / "benchmark_barrier", "scene.yaml", "-result", file], file.parent,
                      ends=None)
        row = re.search(r"\| barrier \| (\d+) \| (\d+) \| \d+ \| \d+ \| \S+ \((\S+)\) \| (\S+) \| (\S+) \| (.*) \|",
                        barrier.text)
        cells = list(row.groups()) if row else ["–"] * 5 + ["failed"]
        ended = cells.pop()
        if ended.startswith("failed"):
            cells[3:] = [ended.partition(",")[0], "–"]
        yield f"| {case} | barrier | " + " | ".join(cells) + " |"


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
        axis.set(title=case, aspect="equal", xlim=(278, 322), ylim=(325, 395))
    axes[0][0].legend(loc="lower left")
    figure.tight_layout()
    figure.savefig(chosen.picture, dpi=110)


def main():
    chosen = option_parser(__doc__, cases=",".join(CASES),
                           tables="cost,runs,estimates,searches,ways",
                           accuracy=0.01, head=str(PROJECT.parent / "shared/data/head"),
                           picture="", dilatation="prism").parse_args()
    faces = {}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file in [*(pathlib.Path(chosen.head) / f for f in SURFACES),
                     PROJECT / "meshes/real_head_split.obj"]:
            (folder / file.name).symlink_to(file.resolve())
        tables = {"cost": (COST, lambda: compare_cost(chosen, folder)),
                  "runs": (AGREE, lambda: compare_runs(chosen, folder)),
                  "estimates": (ESTIMATES, lambda: compare_estimates(chosen, folder)),
                  "searches": (SEARCHES, lambda: compare_searches(chosen, folder)),
                  "ways": (HEAD, lambda: compare_ways(chosen, folder, faces))}
        for table in chosen.tables.split(","):
            head, rows = tables[table]
            print_table(head, rows(), chosen.output, table)
    if chosen.picture:
        draw(faces, chosen)


if __name__ == "__main__":
    main()
