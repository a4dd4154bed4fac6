#!/usr/bin/env python3
"""Ratios of soft to hard tissue of four operations on a real head, against published ones.

    tests/benchmark/ratios.py [-bin build/bin] [-output docs/measurements/ratios.md] [-edge 6]
                              [-ways "default,release 5"]

Needs the head in ../shared/data/head, and
apt-get install --no-install-recommends python3-h5py python3-meshio python3-scipy
"""

import pathlib
import tempfile

import numpy as np

from measure import run
from page import option_parser, print_table
from heads import BONES, DATA  # page knows where it is
from tissue import last, model_of

# Soft landmarks of this head on its midline, mm.
POINTS = {"pronasale": (2.4, -324.3, 412), "subnasale": (2.4, -309.2, 395),
          "labrale superius": (2.4, -313.8, 380), "labrale inferius": (2.4, -310.1, 364),
          "B′": (2.4, -304.0, 351), "pogonion′": (2.4, -303.7, 338)}
# Pieces, the way they go (+ forward), mm, and the landmarks that are told of.
JAW = ("{bone: mandible, piece: part, "
       "planes: [{point: [2.4, -248, 385], normal: [0, -0.947, -0.322]}]}")
CHIN = ("{bone: mandible, piece: part, kerf: 0.5, "
        "planes: [{point: [2, -297, 347], normal: [0, -0.42, -0.91]}]}")
MAXILLA = ("{bone: skull, piece: part, kerf: 3, "
           "planes: [{point: [0, -280, 392], normal: [0, 0, -1]}, "
           "{point: [0, -250, 392], normal: [0, -1, 0]}]}")
LOWER, UPPER = ["labrale inferius", "B′", "pogonion′"], list(POINTS)[:3]
OPERATIONS = {"mandible forward 8": (JAW, 8, LOWER), "mandible back 5": (JAW, -5, LOWER),
              "chin forward 8": (CHIN, 8, LOWER[1:]), "Le Fort I forward 5": (MAXILLA, 5, UPPER)}
LIP, CHIN_OF_TWO = "0.66 [2]", "0.90–1.00 [5]"  # of both directions
PUBLISHED = {("mandible forward 8", "labrale inferius"): LIP,
             ("mandible forward 8", "B′"): "1.00 [5]",
             ("mandible forward 8", "pogonion′"): f"0.80–1.33 [1], {CHIN_OF_TWO}",
             ("mandible back 5", "labrale inferius"): LIP, ("mandible back 5", "B′"): "1.00 [5]",
             ("mandible back 5", "pogonion′"): CHIN_OF_TWO,
             ("chin forward 8", "pogonion′"): "0.77–0.91 [3]",
             ("Le Fort I forward 5", "pronasale"): "0.24–0.35 [4], 0.17 [2]",
             ("Le Fort I forward 5", "subnasale"): "0.60–0.90 [5]",
             ("Le Fort I forward 5", "labrale superius"): "0.36–1.43 [4], 0.60–1.00 [5]"}
MOUTH = ("mouth: {path: [[-23, -299, 366], [-12, -306, 368], [2, -310, 369], [14, -308, 369], "
         "[26, -301, 366]]}\n")
# Tissue and mouth of each way.
WAYS = {"default": ("", MOUTH), "release 5": (", release: 5", MOUTH),
        "lips joined": ("", "")}


def scene_of(piece, forward, way, edge):
    tissue, mouth = WAYS[way]
    bones = ", ".join(f"{{name: {name}, file: {DATA / name}.ply}}" for name in BONES)
    return (f"skin: {DATA / 'face.ply'}\nbones: [{bones}]\n"
            f"tissue: {{layers: 4, edge: {edge:g}{tissue}}}\nosteotomies: [{piece}]\n"
            f"moves: [{{bone: part, translate: [0, {-forward}, 0]}}]\n{mouth}")


def ratios_of(options, folder, operation, way):
    """Landmark → forward way of the skin over that of the bone, or nothing where it is refused."""
    piece, forward, landmarks = OPERATIONS[operation]
    (folder / "scene.yaml").write_text(scene_of(piece, forward, way, options.edge))
    done = run([options.bin / "repose-solve", "scene.yaml"], folder, ends=None)
    if done.status != 0:
        print(done.error + "".join(done.text.splitlines(True)[:1]))
        return {}
    model, rest = model_of(folder / "scene.h5"), last(folder / "scene.h5")["point/position"]
    skin = np.flatnonzero(model["point/layer"] == 0)
    initial = model["point/position"][skin]
    way_of = (rest[skin] - initial)[:, 1] / -forward
    found = {}
    for name in landmarks:
        nearest = np.argsort(np.linalg.norm(initial - POINTS[name], axis=1))[:3]
        found[name] = way_of[nearest].mean()
    return found


def rows(options, folder):
    for operation, (_, _, landmarks) in OPERATIONS.items():
        found = [ratios_of(options, folder, operation, way) for way in options.ways.split(",")]
        for name in landmarks:
            cells = " | ".join(f"{one[name]:.2f}" if one else "–" for one in found)
            yield f"| {operation} | {name} | {PUBLISHED.get((operation, name), '')} | {cells} |"


def main():
    options = option_parser(__doc__, edge=6.0, ways="default").parse_args()
    ways = options.ways.split(",")
    head = ("| operation, mm | landmark | published | " + " | ".join(ways) + " |\n|---|---|---|"
            + "--:|" * len(ways))
    with tempfile.TemporaryDirectory() as name:
        print_table(head, rows(options, pathlib.Path(name)), options.output)


if __name__ == "__main__":
    main()
