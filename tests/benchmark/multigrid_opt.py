#!/usr/bin/env python3
"""Nonlinear multigrid against the default and L-BFGS: a table.

    tests/benchmark/multigrid_opt.py [-bin build/bin] [-sizes 500,2500,12500] [-coarsening 2,2,3]
                                     [-methods default,lbfgs,cycles,…] [-smoothing 10]
                                     [-accuracy 0.01] [-limit 2000] [-seconds 60]
                                     [-output docs/measurements/nonlinear_multigrid.md] [-mark multigrid] [SCENE.yaml …]

The scenes given (coarsened by 2), and those of growth.py for synthetic heads of the given numbers of
skin vertices, each with its coarsening of the edges; run by benchmark_multigrid_opt, with -smoothing
evaluations before and after each correction.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import json
import pathlib

from growth import SCENE
from measure import run, synthetic
from page import option_parser, print_table

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
    done = run([chosen.bin / "benchmark_multigrid_opt", scene, "-coarsening", coarsening, "-methods",
                chosen.methods, "-smoothing", chosen.smoothing, "-accuracy", chosen.accuracy,
                "-limit", chosen.limit, "-seconds", chosen.seconds], ends=[0])
    return map(json.loads, done.text.splitlines())


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
        with synthetic(chosen.bin, size, SCENE) as folder:
            yield from rows_of(chosen, f"{size} skin vertices", folder / "scene.yaml", coarsening)


def main():
    parser = option_parser(__doc__, sizes="500,2500,12500", coarsening="2,2,3",
                           methods=",".join(NAMES), smoothing=10, accuracy=0.01, limit=2000,
                           seconds=60.0, mark="multigrid")
    parser.add_argument("scenes", nargs="*", type=pathlib.Path, metavar="SCENE")
    chosen = parser.parse_args()
    print_table(HEAD, all_rows(chosen), chosen.output, chosen.mark)


main()
