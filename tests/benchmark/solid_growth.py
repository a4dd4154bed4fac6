#!/usr/bin/env python3
"""Measures the work of solving a solid as the mesh grows, by method: a table.

    tests/benchmark/solid_growth.py [-bin build/bin] [-sizes 500,2500,12500,125000]
                                    [-methods lmvm,ntr] [-poissons 0.45,0.49] [-ranks 1]
                                    [-contacts off,on] [-dilatation prism,nodal]
                                    [-output docs/measurements/solid.md] [-mark growth]
    tests/benchmark/solid_growth.py -sizes 750000 -ranks 2 -stages on

Synthetic heads of the given numbers of skin vertices, four layers, the jaw opened by 8° and brought
6 mm forward, to 0.01 mm, without contact unless -contacts says otherwise. lmvm is the default:
limited-memory BFGS that begins with a multigrid cycle and ends with Newton steps; ntr, nls and cg are
TAO's. Seconds are those of the search on its own model, the estimate of the distance to rest included.

With -stages on: a stiffer skin under tension and gravity, in equilibrium before the jaw moves 6 mm
forward, to 0.1 mm, volumes averaged at the points (dilatation nodal). The table has what each stage takes
and the memory of all ranks until its end; the last row is repose-check on the result.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import time

import h5py
import numpy as np

from measure import run, synthetic
from page import option_parser, print_table

CONTACT = {"off": "contact: {bones: off, cuts: off}", "on": ""}
SURFACES = """skin: head_skin.ply
bones:
  - {name: skull, file: head_skull.ply}
  - {name: mandible, file: head_mandible.ply}
tissue:
  layers: 4
  edge: given
"""
SCENE = SURFACES + """  material: {young: 0.015, poisson: POISSON, dilatation: DILATATION}
moves:
  - {bone: mandible, rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: 8}}
  - {bone: mandible, translate: [0, -6, 0]}
CONTACT
solve: {accuracy: 0.01}
"""
STANDING = SURFACES + """  turgor: 0.02
  density: 1.0e-6
  material: {young: 0.015, poisson: POISSON, dilatation: nodal, skin: {thickness: 1.5, young: 0.08}}
gravity: [0, 0, -9.81]
moves:
  - {bone: mandible, translate: [0, -6, 0]}
""" + CONTACT["off"] + "\n"
HEAD = ("| unknowns | ν | method | evaluations | Hessians | search, s | µs/unknown | memory, MiB | "
        "inverted prisms | from the first, mm |\n|--:|--:|---" + "|--:" * 7 + "|")

STAGE_HEAD = ("| points | ν | ranks | evaluations | stage | elapsed, s | memory, MiB |\n"
              "|--:|--:|--:|--:|---|--:|--:|")


def stage_rows_of(size, poisson, chosen):
    with synthetic(chosen.bin, size, STANDING.replace("POISSON", poisson)) as folder:
        solved = run([chosen.bin / "repose-solve", "scene.yaml", "-output", "rest"], folder, chosen.ranks)
        points = solved.message["points"].split()[0]
        start = f"| {points} | {poisson} | {chosen.ranks} | {solved.evaluations[0]} |"
        words = solved.message["initial equilibrium"].split()
        remark = {"build": f", forces balanced to {words[0]} of {words[4]} N"}
        for name, (seconds, used) in solved.stages.items():
            yield f"{start} {name}{remark.get(name, '')} | {seconds:.0f} | {used:.0f} |"
        begin = time.monotonic()
        checked = run([chosen.bin / "repose-check", "rest.h5"], folder, ends=None)
        yield (f"{start} check: {'passes' if checked.status == 0 else 'FAILS'} "
               f"| {time.monotonic() - begin:.0f} | |")


def rows_of(size, poisson, chosen):
    for dilatation in chosen.dilatation.split(","):
        yield from rows_of_dilatation(size, poisson, dilatation, chosen)


def rows_of_dilatation(size, poisson, dilatation, chosen):
    text = SCENE.replace("POISSON", poisson).replace("DILATATION", dilatation)
    with synthetic(chosen.bin, size, text.replace("CONTACT", "")) as folder:
        for contact in chosen.contacts.split(","):
            (folder / "scene.yaml").write_text(text.replace("CONTACT", CONTACT[contact]))
            first = None
            for method in chosen.methods.split(","):
                solved = run([chosen.bin / "repose-solve", "scene.yaml", "-tao_type", method,
                              "-output", method], folder, chosen.ranks)
                with h5py.File(folder / f"{method}.h5") as h5:
                    step = h5["step"][max(h5["step"])]
                    position, inverted = step["point/position"][()], step.attrs["inverted_prisms"]
                    unknowns = 3 * int((h5["model/point/set"][()] == 0).sum())
                first = position if first is None else first
                apart = np.linalg.norm(position - first, axis=1).max()
                message = f"{apart:.1g}" if solved.status == 0 else "NOT CONVERGED"
                seconds = solved.stages["solve"][0]
                name = (method + ", contact" * (contact == "on") + ", nodal" * (dilatation == "nodal")
                        + f", {chosen.ranks} ranks" * (chosen.ranks > 1))
                yield (f"| {unknowns} | {poisson} | {name} | {solved.evaluations[0]} | "
                       f"{solved.evaluations[1]} | {seconds:.2f} | {1e6 * seconds / unknowns:.0f} | "
                       f"{solved.memory:.0f} | {inverted} | {message} |")


def main():
    chosen = option_parser(__doc__, sizes="500,2500,12500,125000", methods="lmvm,ntr", poissons="0.45,0.49",
                           ranks=1, contacts="off", dilatation="prism", stages="off", mark="growth").parse_args()
    head, make_rows = (STAGE_HEAD, stage_rows_of) if chosen.stages == "on" else (HEAD, rows_of)
    rows = (row for size in chosen.sizes.split(",") for poisson in chosen.poissons.split(",")
            for row in make_rows(size, poisson, chosen))
    print_table(head, rows, chosen.output, chosen.mark)


if __name__ == "__main__":
    main()
