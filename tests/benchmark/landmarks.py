#!/usr/bin/env python3
"""Measures distances of landmarks that repose-landmarks proposes to given ones: of twelve synthetic
heads of other proportions, tilted, and of one real head where it is there, also with noise.

    tests/benchmark/landmarks.py [-bin build/bin] [-heads 12] [-output docs/guide/landmarks.md]

Needs: apt-get install --no-install-recommends python3-h5py python3-meshio python3-scipy
"""

import json
import pathlib
import re
import tempfile

import meshio
import numpy as np

from measure import run
from page import PROJECT, option_parser, print_table
from phantom_heads import Shape, skin_of
from heads import DATA  # page knows where it is

PARTS = ("skin", "skull", "mandible")
HEAD = "| landmark | heads | mean, mm | largest, mm |\n|---|--:|--:|--:|"


def tilt(random):
    """A rotation by up to 8° about each axis."""
    matrix = np.eye(3)
    for axis, angle in enumerate(np.radians(random.uniform(-8, 8, 3))):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
        matrix = turn @ matrix
    return matrix


def points_of(file):
    return {name: point for name, point in json.loads(file.read_text()).items()
            if np.shape(point) == (3,)}


def make_phantom(folder, seed):
    """A head of other proportions, tilted, with its landmarks."""
    random = np.random.default_rng(seed)
    shape = Shape(random)
    shape.beard = 0
    turn = tilt(random)
    for part in PARTS:
        mesh = meshio.read(PROJECT / f"meshes/head_{part}.ply")
        points, triangles = (skin_of(shape, mesh, random) if part == "skin" else
                             (shape.of(mesh.points), mesh.cells_dict["triangle"]))
        meshio.Mesh(points @ turn.T, [("triangle", triangles.astype("int32"))]).write(
            folder / f"{part}.ply")
    known = points_of(PROJECT / "meshes/head_landmarks.json")
    moved = shape.of(np.array(list(known.values()))) @ turn.T
    (folder / "known.json").write_text(json.dumps(dict(zip(known, moved.tolist()))))
    return folder, folder / "known.json"


def distances(options, surfaces, known):
    """Landmark → mm between where the file has it and where it is proposed."""
    skin, skull, mandible = surfaces
    with tempfile.TemporaryDirectory() as name:
        done = run([options.bin / "repose-landmarks", skin, "-skull", skull, "-mandible", mandible,
                    "-landmarks", known], name, ends=None)
    if done.status == 1:
        raise SystemExit(done.error)
    return {found[1]: float(found[2]) for found in
            re.finditer(r"^(\w+) .*proposed ([\d.]+) mm from it", done.text, re.M)}


def write_rough(folder, deviation, random):
    """The real head with noise at its vertices, of this standard deviation in mm."""
    for part in PARTS:
        mesh = meshio.read(DATA / f"{part}.ply")
        mesh.points = mesh.points + deviation * random.standard_normal(mesh.points.shape)
        meshio.Mesh(mesh.points, mesh.cells).write(folder / f"{part}.ply")


def displacements(options, deviation):
    """Landmark → mm by which noise displaces it, of five seeds, or as many as -heads."""
    heads = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        smooth = [DATA / f"{part}.ply" for part in PARTS]
        run([options.bin / "repose-landmarks", smooth[0], "-skull", smooth[1], "-mandible", smooth[2],
             "-output", folder / "smooth"], name)
        for seed in range(min(5, options.heads)):
            write_rough(folder, deviation, np.random.default_rng(seed))
            rough = [folder / f"{part}.ply" for part in PARTS]
            heads.append(distances(options, rough, folder / "smooth.mrk.json"))
    return heads


def table(heads):
    """Rows by landmark, then of all, each of its distances in several heads."""
    names = sorted({name for head in heads for name in head})
    every = {name: [head[name] for head in heads if name in head] for name in names}
    every["**all**"] = [off for several in every.values() for off in several]
    for name, off in every.items():
        yield f"| {name} | {len(off)} | {np.mean(off):.1f} | {np.max(off):.1f} |"


def main():
    options = option_parser(__doc__, heads=12).parse_args()
    heads = []
    for seed in range(1, 1 + options.heads):
        with tempfile.TemporaryDirectory() as name:
            folder, known = make_phantom(pathlib.Path(name), seed)
            heads.append(distances(options, [folder / f"{part}.ply" for part in PARTS], known))
    print_table(HEAD, table(heads), options.output, "phantoms")
    if DATA.exists():
        real = distances(options, [DATA / f"{part}.ply" for part in PARTS], DATA / "landmarks.json")
        print_table(HEAD, table([real]), options.output, "real head")
        print_table(HEAD, table(displacements(options, 0.1)), options.output, "noise")


if __name__ == "__main__":
    main()
