#!/usr/bin/env python3
"""Measures errors of maps at plans that they do not know, and how often their bound holds.

    tests/benchmark/map.py [-bin build/bin] [-head ../shared/data/head] [-samples 25,50,100]
                           [-held_out 60] [-processes 1] [-cache FOLDER]
                           [-output docs/measurements/live.md]

The shipped head with one piece (the mandible) and with two (mandible and chin), and a real head with
parted lips and the mandible where it is there. Boxes: ±8 mm forward and back, ±4 mm and ±4° else.
Held-out plans are random in the box. -cache keeps solved plans between runs; -processes solvers run at
a time. Needs: apt-get install --no-install-recommends python3-numpy python3-scipy
"""

import importlib.util
import pathlib
import re
import shutil
import sys
import tempfile

import numpy as np

from page import PROJECT, option_parser, print_table

sys.path[:0] = [str(PROJECT / "drivers/python"), str(PROJECT / "drivers")]
import repose  # noqa: E402
from repose.samples import PlanBox, SampleStore, solve_all  # noqa: E402

HEAD = ("| | plans solved | error at held-out plans, mm: 95 % of the skin, median and 95 % of plans | "
        "largest, median of plans | bound holds, % | gray, % of the skin | page, MB |\n"
        "|---|--:|--:|--:|--:|--:|--:|")
BOX = "  box: {translate: [4, 8, 4], rotate: [4, 4, 4]}\n"
ACCURACY = 0.02  # mm


def scenes(folder, head):
    """Name and path of each scene, with its meshes in a folder."""
    text = (PROJECT / "meshes/head_live.yaml").read_text()
    text = text[:text.index("moves:")]
    chin = text.replace("  - bone: skull", "  - bone: none")
    chin = re.sub(r"  - bone: none.*?(?=  - bone: mandible)", "", chin, flags=re.S)
    for name, start, pieces in (("shipped head, one piece", text[:text.index("osteotomies:")], ["mandible"]),
                                ("shipped head, two pieces", chin, ["mandible", "chin"])):
        path = folder / f"{name.replace(',', '').replace(' ', '_')}.yaml"
        path.write_text(f"{start}moves:\n  - {{bone: [{', '.join(pieces)}], translate: [0, -4, 0]}}\nplan:\n"
                        f"  pieces: [{', '.join(pieces)}]\n{BOX}")
        yield name, path
    if (head / "skin.ply").is_file():
        for mesh in head.glob("*.ply"):
            (folder / mesh.name).symlink_to(mesh)
        path = folder / "real_head_mouth.yaml"
        text = path.read_text()
        path.write_text(f"{text[:text.index('moves:')]}moves:\n  - {{bone: mandible, translate: [0, -4, 0]}}\n"
                        f"plan:\n  pieces: [mandible]\n{BOX}")
        yield "real head, one piece", path


def driver():
    """drivers/map.py as a module."""
    specification = importlib.util.spec_from_file_location("map_driver", PROJECT / "drivers/map.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def measure(name, path, chosen, cache):
    """A row of the table for each number of samples."""
    program, counts = chosen.bin / "repose-live", [int(n) for n in chosen.samples.split(",")]
    with repose.Session(path, program=program) as session:
        box = PlanBox([piece.name for piece in session.pieces], session.box)
        store = SampleStore(cache, repose.Scene(path).fingerprint(program))
        tell = lambda done, total, text: done % 10 or print(f"{name}: {text}", file=sys.stderr)
        solve = lambda points, tangents: solve_all(path, box, points, store, ACCURACY, session,
                                                   chosen.processes, program, tell, tangents)
        held = [one for one in solve(box.held_out(chosen.held_out), False) if one.converged]
        samples = solve(box.points(max(counts)), True)
        for count in counts:
            made, text = driver().fitted_page(path, session, box, samples[:count], ACCURACY)
            error = np.array([np.linalg.norm(made.displacement_at(one.u) - one.displacement, axis=1)
                              for one in held])
            bound = np.array([made.bound_at(one.u) for one in held])
            most = np.percentile(error, 95, axis=1)
            failed = f" ({len(made.failed)} not converged)" * bool(len(made.failed))
            yield (f"| {name} | {count}{failed} | {np.median(most):.3f}, {np.percentile(most, 95):.3f} | "
                   f"{np.median(error.max(axis=1)):.2f} | {100 * np.mean(error <= bound):.1f} | "
                   f"{100 * np.mean(bound > 0.5):.1f} | {len(text) / 1e6:.2f} |")


def rows(chosen):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file in (PROJECT / "meshes").glob("*head*"):
            shutil.copy(file, folder)
        for scene, path in scenes(folder, chosen.head):
            yield from measure(scene, path, chosen, chosen.cache or folder / "solved")


def main():
    parser = option_parser(__doc__, samples="25,50,100", held_out=60, processes=1)
    parser.add_argument("-head", type=pathlib.Path, default=PROJECT.parent / "shared/data/head")
    parser.add_argument("-cache", type=pathlib.Path)
    chosen = parser.parse_args()
    print_table(HEAD, rows(chosen), chosen.output, "maps")


if __name__ == "__main__":
    main()
