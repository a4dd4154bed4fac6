#!/usr/bin/env python3
"""Nonlinear multigrid against the default and L-BFGS: a table.

    tests/benchmark/multigrid_opt.py [-bin build/bin] [-sizes 500,2500,12500] [-coarsening 2,2,3]
                                     [-methods default,lbfgs,cycles,…] [-smoothing 10]
                                     [-accuracy 0.01] [-limit 2000] [-seconds 60]
                                     [-output docs/growth.md] [-mark multigrid] [SCENE.yaml …]

The scenes given (coarsened by 2), and those of growth.py for synthetic heads of the given numbers of
skin vertices, each with its coarsening of the edges; run by benchmark_multigrid_opt.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

from growth import SCENE
from page import PROJECT, print_table

NAMES = {"default": "default", "lbfgs": "L-BFGS", "cycles": "MG/OPT", "injected": "MG/OPT, injected",
         "default_end": "default, to its own estimate",
         "cycles_newton": "MG/OPT, then the default, to its estimate",
         "lbfgs_newton": "L-BFGS, then the default, to its estimate"}
SHOWN = (1, 2, 4, 8, 16)  # cycles after which the distance is told
HEAD = ("| scene | unknowns, coarse | method | evaluations | coarse ones, in fine | Hessians | CPU | "
        "corrections, refused | mm to go after " + ", ".join(map(str, SHOWN)) + " cycles | end |\n"
        "|---|--:|---" + "|--:" * 5 + "|---|---|")


def race(chosen, scene, coarsening):
    """What the start took, and the entries of the methods."""
    program = chosen.bin.resolve() / "benchmark_multigrid_opt"
    options = ["-coarsening", coarsening, "-methods", chosen.methods, "-smoothing",
               chosen.smoothing, "-accuracy", chosen.accuracy, "-limit", chosen.limit, "-seconds",
               chosen.seconds]
    done = subprocess.run([program, scene, *map(str, options)], text=True, capture_output=True,
                          stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    return map(json.loads, done.stdout.splitlines())


def ending(entry):
    """What came of it, in words."""
    if entry["end"] == "reached":
        return "there"
    if entry["end"] == "own_minimum":
        return f"at another minimum, {entry['distance']:.2g} mm away, Φ {100 * entry['excess']:+.2g} %"
    if entry["method"] in ("default_end", "cycles_newton", "lbfgs_newton"):
        return f"{entry['distance']:.2g} mm from the default's"
    why = "no evaluation or time left" if entry["end"] == "limit" else "stopped"
    return f"{why}, {entry['distance']:.2g} mm from the default's"


def rows_of(chosen, name, scene, coarsening):
    start, *entries = race(chosen, scene, coarsening)
    unit = entries[0]["seconds"]
    size = f"{start['unknowns']}, {start['coarse_unknowns']}"
    for e in entries:
        to_go = [f"{e['distances'][k - 1]:.2g}" for k in SHOWN if k <= len(e["distances"])]
        refused = f"{e['corrections']}, {e['refused']}" if e["corrections"] else "–"
        yield (f"| {name} | {size} | {NAMES[e['method']]} | {e['evaluations']} | {e['coarse']:.0f} | "
               f"{e['assemblies']} | {e['seconds'] / unit:.2f} | {refused} | "
               f"{', '.join(to_go) or '–'} | {ending(e)} |")


def all_rows(chosen):
    for scene in chosen.scenes:
        yield from rows_of(chosen, scene.stem, scene, 2)
    sizes = chosen.sizes.split(",") if chosen.sizes else []
    for size, coarsening in zip(sizes, chosen.coarsening.split(",")):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            subprocess.run([chosen.bin.resolve() / "repose-phantom", "-skin_vertices", size,
                            "-bone_edge", "2", "-output", "head"], cwd=folder, check=True,
                           capture_output=True)
            (folder / "scene.yaml").write_text(SCENE)
            yield from rows_of(chosen, f"{size} skin vertices", folder / "scene.yaml", coarsening)


def arguments():
    parser = argparse.ArgumentParser(prog="multigrid_opt.py", description=__doc__, add_help=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("-bin", type=pathlib.Path, default=PROJECT / "build/bin")
    parser.add_argument("-sizes", default="500,2500,12500")
    parser.add_argument("-coarsening", default="2,2,3", help="of the edges, for each size")
    parser.add_argument("-methods", default=",".join(NAMES))
    parser.add_argument("-smoothing", type=int, default=10,
                        help="evaluations before and after each correction")
    parser.add_argument("-accuracy", type=float, default=0.01)
    parser.add_argument("-limit", type=int, default=2000)
    parser.add_argument("-seconds", type=float, default=60.0)
    parser.add_argument("-output", type=pathlib.Path)
    parser.add_argument("-mark", default="multigrid")
    parser.add_argument("scenes", nargs="*", type=pathlib.Path, metavar="SCENE")
    return parser.parse_args()


if __name__ == "__main__":
    chosen = arguments()
    print_table(HEAD, all_rows(chosen), chosen.output, chosen.mark)
