#!/usr/bin/env python3
"""Synthetic heads of random proportions, with beards of noise and open or closed mouths, through the
scene of ten lines.

    tests/benchmark/phantom_heads.py [-bin build/bin] [-heads 10] [-first 1]

Needs: apt-get install --no-install-recommends python3-h5py python3-meshio python3-scipy
"""

import pathlib
import tempfile

import meshio
import numpy as np

from measure import run
from page import option_parser, print_table
from tissue import last, model_of  # page knows where it is

SCENE = """skin: skin.ply
bones:
  - {name: skull, file: skull.ply}
  - {name: mandible, file: mandible.ply}
tissue:
  layers: 4
  edge: 5
moves:
  - {bone: mandible, rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: 6}}
  - {bone: mandible, translate: [0, -4, 0]}
"""
HEAD = ("| head | proportions x, y, z | chin, mm | mouth | beard, mm | vertices | least angle "
        "| shortened | exit | inverted | chin's way over the bone's |\n|--:|---|--:|---|"
        + "--:|" * 7)


class Shape:
    """A random change of proportions: scales, and a chin pushed forward or back."""

    def __init__(self, random):
        self.scale = random.uniform([0.85, 0.88, 0.88], [1.15, 1.12, 1.12])
        self.chin = random.uniform(-8, 8)  # mm
        self.mouth_open = random.random() < 0.5
        self.beard = random.choice([0.0, 0.5, 1.0])  # mm

    def of(self, points):
        """Points of the shipped head in this one; the hinge axis stays where it is."""
        low = np.clip(-points[:, 2] / 60, 0, 1) * np.clip(-points[:, 1] / 80, 0, 1)
        return points * self.scale - np.outer(low, [0, self.chin, 0])


def loops(triangles):
    """Border loops of a surface, each as its vertices in order, longest first."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    there = set(map(tuple, edges))
    after = {int(b): int(a) for a, b in there if (b, a) not in there}
    found = []
    while after:
        start = next(iter(after))
        loop = [start]
        while (vertex := after.pop(loop[-1])) != start:
            loop.append(vertex)
        found.append(loop)
    return sorted(found, key=len, reverse=True)


def skin_of(shape, mesh, random):
    """Points and triangles: a mouth that is closed is a fan, a beard is noise below the nose."""
    points, triangles = shape.of(mesh.points), mesh.cells_dict["triangle"]
    if not shape.mouth_open:
        mouth = loops(triangles)[-1]
        middle = len(points)
        points = np.vstack([points, points[mouth].mean(axis=0)])
        fan = [[a, b, middle] for a, b in zip(mouth, np.roll(mouth, -1))]
        triangles = np.vstack([triangles, fan])
    beard = (points[:, 2] < -5 * shape.scale[2]) & (points[:, 1] < -20)
    points[beard] += random.normal(scale=shape.beard, size=(beard.sum(), 3))
    return points, triangles


def write_surfaces(folder, shape, base, random):
    """Skin, skull and mandible of a shape, made of the head in the folder `base`."""
    points, triangles = skin_of(shape, meshio.read(base / "head_skin.ply"), random)
    meshio.Mesh(points, [("triangle", triangles.astype("int32"))]).write(folder / "skin.ply")
    for bone in ("skull", "mandible"):
        mesh = meshio.read(base / f"head_{bone}.ply")
        meshio.Mesh(shape.of(mesh.points), mesh.cells).write(folder / f"{bone}.ply")


def follows(folder):
    """Ratio of the movement of the foremost skin of the chin to that of the bone below it."""
    model, rest = model_of(folder / "scene.h5"), last(folder / "scene.h5")["point/position"]
    initial, layer = model["point/position"], model["point/layer"]
    deep = np.flatnonzero(layer == layer.max())
    low = deep[initial[deep, 2] < initial[deep, 2].min() * 0.75]
    chin = low[np.argmin(initial[low, 1])]
    skin = np.flatnonzero((model["point/column"] == model["point/column"][chin]) & (layer == 0))[0]
    way = np.linalg.norm(rest - initial, axis=1)
    return way[skin] / way[chin]


def rows(options, base):
    for seed in range(options.first, options.first + options.heads):
        random = np.random.default_rng(seed)
        shape = Shape(random)
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            write_surfaces(folder, shape, base, random)
            (folder / "scene.yaml").write_text(SCENE)
            done = run([options.bin / "repose-solve", "scene.yaml"], folder, ends=None)
            message = done.text.split()
            number = (lambda word: message[message.index(word) - 1] if word in message else "0")
            inverted = done.message.get("inverted prisms", "–").split(":")[0]
            ratio = f"{follows(folder):.2f}" if done.status in (0, 2) else done.error.strip()
            angle = done.text.split("no angle below ")[-1].split("°")[0] if message else "–"
            yield (f"| {seed} | {', '.join(f'{s:.2f}' for s in shape.scale)} | {shape.chin:+.1f} "
                   f"| {'open' if shape.mouth_open else 'closed'} | {shape.beard:g} "
                   f"| {number('vertices,')} | {angle}° | {number('shortened')} | {done.status} "
                   f"| {inverted} | {ratio} |")


def main():
    options = option_parser(__doc__, heads=10, first=1).parse_args()
    with tempfile.TemporaryDirectory() as name:
        base = pathlib.Path(name)
        run([options.bin / "repose-phantom", "-skin_vertices", 20000, "-bone_edge", 2, "-output",
             "head"], base, ends=[0])
        print_table(HEAD, rows(options, base), options.output, "phantoms")


if __name__ == "__main__":
    main()
