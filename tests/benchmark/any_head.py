#!/usr/bin/env python3
"""Any skin of one head: what is solved in its place, and how far the answers are apart.

    tests/benchmark/any_head.py [-bin build/bin] [-output docs/measurements/any_head.md]

Makes the skins of tests/program/heads.py from the CT in ../shared/data/head; builds a model of each
with edges of 2, 4 and 8 mm, solves those of 4 mm, and compares the displacements on the given skins.
One more skin is large, with a table and a tube. It and that of the CT, this more accurately, are
solved on 1, 2 and 3 ranks.
Needs: apt-get install --no-install-recommends python3-h5py python3-meshio python3-scipy
"""

import pathlib
import re
import tempfile

import numpy as np

from measure import run
from page import option_parser, print_table
import heads  # page knows where it is

BUILT = ("| skin | edge, mm | vertices | least angle | to the given skin, mm: 95 %, all "
         "| columns bent | shortened |\n|---" + "|--:" * 6 + "|")
APART = ("| skin | CPU, s | memory, MiB | displacement from the CT's, mm: 50 % | 95 % | all |\n|---"
         + "|--:" * 5 + "|")

RANKS = ("| skin | accuracy, mm | ranks | CPU, s | displacement from that on one, mm: 95 % | all |\n|---"
         + "|--:" * 5 + "|")


def number(pattern, text):
    found = re.search(pattern, text)
    return found[1] if found else "0"


def built_row(options, folder, variant, edge):
    done = run([options.bin / "repose-solve", f"{variant}.yaml", "-dry_run"], folder, ends=(0,))
    cells = [number(pattern, done.text) for pattern in (
        r"solved has (\d+) vertices", r"no angle below (\d+)", r"95 % lie within ([\d.]+)",
        r"all within ([\d.]+)", r"(\d+) columns were bent", r"(\d+) columns were shortened")]
    return "| {} | {} | {} | {}° | {}, {} | {} | {} |".format(variant, edge, *cells)


def built_rows(options, folder):
    for edge in (2, 4, 8):
        heads.make_scenes(folder, edge)
        for variant in heads.VARIANTS:
            yield built_row(options, folder, variant, edge)


def apart_rows(options, folder):
    heads.make_scenes(folder)
    faces = {}
    for variant in [*heads.VARIANTS, heads.LARGE]:
        done = run([options.bin / "repose-solve", f"{variant}.yaml", "-output", variant], folder,
                   ends=(0,))
        faces[variant] = heads.face_of(folder, variant)
        distances = heads.apart(faces[variant], faces["volume"])
        half, most, largest = np.quantile(distances, [0.5, 0.95, 1])
        yield (f"| {variant} | {done.seconds:.0f} | {done.memory:.0f} | {half:.2f} | {most:.2f} "
               f"| {largest:.2f} |")


def ranks_rows(options, folder):
    for variant, accuracy in ((heads.LARGE, 0.1), ("volume", 0.001)):
        for ranks in (1, 2, 3):
            done = run([options.bin / "repose-solve", f"{variant}.yaml", "-accuracy", accuracy,
                        "-output", "ranks"], folder, ranks, ends=(0,))
            _, way = heads.face_of(folder, "ranks")
            one = way if ranks == 1 else one
            most, largest = np.quantile(np.linalg.norm(way - one, axis=1), [0.95, 1])
            yield (f"| {variant} | {accuracy} | {ranks} | {done.seconds:.0f} | {most:.4f} "
                   f"| {largest:.4f} |")


def main():
    options = option_parser(__doc__).parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        heads.make_surfaces(folder, lambda program, *arguments: run(
            [options.bin / program, *map(str, arguments)], folder, ends=(0,)))
        print_table(BUILT, built_rows(options, folder), options.output, "built")
        heads.make_large(folder)
        print_table(APART, apart_rows(options, folder), options.output, "apart")
        print_table(RANKS, ranks_rows(options, folder), options.output, "ranks")


if __name__ == "__main__":
    main()
