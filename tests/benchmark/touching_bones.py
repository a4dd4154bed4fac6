#!/usr/bin/env python3
"""The jaw of a CT whose bones touch, cut off by points and by planes: the table of its page.

    tests/benchmark/touching_bones.py [-bin build/bin] [-head ../shared/data/head]
                                      [-output docs/guide/touching_bones.md]

Needs the head's CT and the reference mesh of its mandible, and: apt-get install
--no-install-recommends python3-meshio python3-scipy
"""

import json
import pathlib
import re
import tempfile

import meshio
import numpy as np
from scipy.spatial import cKDTree

from measure import run
from page import PROJECT, option_parser, print_table

CHIN, BODY = [(2, -297, 338)], [(-25, -270, 345), (28, -270, 345)]
RAMI, CONDYLES = [(-46, -215, 380), (51, -215, 380)], [(-50, -208, 399), (51, -203, 400)]
JAWS = {"1 point in the jaw, in the chin": CHIN,
        "5 points, none in the condyles": CHIN + BODY + RAMI,
        "7 points": CHIN + BODY + RAMI + CONDYLES,
        "points proposed by `-jaw`": []}
SKULL = [(-6, -294, 418), (-37, -250, 424), (43, -249, 420), (0, -209, 430)]
PLANES = [((2, -285, 371), 48), ((-50, -205, 402), 14), ((50, -205, 402), 14)]
HEAD = ("| cut by | voxels share, mm² | jaw, cm³ | of the reference within, mm: 95 % "
        "| farther than 2 mm | CPU, s |\n|---|--:|--:|--:|--:|--:|")


def write_points(file, points):
    controls = [{"label": str(n), "position": point} for n, point in enumerate(points)]
    markup = {"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": controls}
    file.write_text(json.dumps({"markups": [markup]}))


def planes_row(tools, folder, ct):
    run([tools / "repose-isosurface", ct, "-level", 226, "-largest", "-output", "bone.ply"], folder,
        ends=(0,))
    planes = "".join(f"      - {{point: {list(point)}, normal: [0, 0, -1], radius: {radius}}}\n"
                     for point, radius in PLANES)
    (folder / "planes.yaml").write_text(
        "skin: bone.ply\nbones: [{name: skull, file: bone.ply}]\ntissue: {layers: 4}\n"
        f"osteotomies:\n  - bone: skull\n    piece: jaw\n    seed: {list(CHIN[0])}\n    planes:\n"
        + planes)
    done = run([tools / "repose-osteotomy", "planes.yaml", "-output", "plan"], folder, ends=(0,))
    volume = float(re.search(r"piece 'jaw' of (\d+) mm³", done.text)[1])
    return f"| 3 discs, at the teeth and in the joints | – | {volume / 1000:.0f} | – | – | {done.seconds:.1f} |"


def rows(chosen):
    ct = pathlib.Path(chosen.head).resolve() / "head_hu.mhd"
    reference = meshio.read(ct.parent / "mandible.ply").points
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write_points(folder / "skull.mrk.json", SKULL)
        for way, points in JAWS.items():
            write_points(folder / "jaw.mrk.json", points)
            ends = ["-apart", "skull.mrk.json", "jaw.mrk.json"] if points else ["-jaw"]
            done = run([chosen.bin / "repose-isosurface", ct, "-level", 226, *ends, "-largest", "-output",
                        "bone.ply"], folder, ends=(0,))
            shared = re.search(r"voxels share (\d+) mm²", done.text)[1]
            volume = float(re.findall(r"volume (\S+) mm³", done.text)[1])
            off = cKDTree(meshio.read(folder / "bone_2.ply").points).query(reference)[0]
            yield (f"| {way} | {shared} | {volume / 1000:.0f} | {np.quantile(off, 0.95):.2f} "
                   f"| {100 * (off > 2).mean():.1f} % | {done.seconds:.1f} |")
        yield planes_row(chosen.bin, folder, ct)


def main():
    chosen = option_parser(__doc__, head=str(PROJECT.parent / "shared/data/head")).parse_args()
    print_table(HEAD, rows(chosen), chosen.output)


main()
