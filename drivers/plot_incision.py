#!/usr/bin/env python3
"""Fig. 9 of the paper for any results with incisions: how far the skin's tension opens a cut. Prints
the widest gap of each layer and draws the skin around the cut, looked at along its normal.

    drivers/plot_incision.py PICTURE.png NAME [NAME ...]

NAME is a result (NAME.h5, the ending may be left out).

Needs: apt-get install --no-install-recommends python3-matplotlib python3-h5py
"""

import os

from sheet.script import Unusable, reading, refuse_missing, result_name, run, words
from sheet.whole_file import Target, write_figure

try:
    import h5py
    import matplotlib
    import numpy as np

    from sheet.shown_skin import read_places, read_rows
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-matplotlib python3-h5py")

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection

SKIN, EDGE = np.array([0.87, 0.68, 0.58]), (0.45, 0.3, 0.25)
MARGIN = 8  # mm around the cut
LIGHT = np.array([-0.4, 0.5, 0.77])  # right, up, towards the eye


class Result:
    """The last step of a result, and which of its points are doubled."""

    def __init__(self, file):
        self.name = os.path.splitext(os.path.basename(file))[0]
        with reading(file, "a result of repose-solve"), h5py.File(file) as h5:
            layer, column = (h5[f"model/point/{name}"][()] for name in ("layer", "column"))
            self.initial = read_places(h5, "model/point/position", len(layer))
            self.skin = read_rows(h5, "model/skin/points", len(layer))
            self.position = read_places(h5["step"][sorted(h5["step"])[-1]], "point/position", len(layer))
            layers, columns = layer.max() + 1, column.max() + 1
            self.twin = np.arange(columns * layers, len(layer))
            if len(self.twin) == 0:
                raise Unusable(f"{file}: no point is doubled: its scene has no incision")
            self.row = column[self.twin] * layers + layer[self.twin]
            self.layer = layer[self.row]

    def gaps(self):
        """The largest distance between doubled points of each layer, mm."""
        apart = np.linalg.norm(self.position[self.row] - self.position[self.twin], axis=1)
        return [apart[self.layer == a].max() for a in np.unique(self.layer)]


def corners(points, skin):
    return tuple(points[skin[:, k]] for k in range(3))


def frame_of(result):
    """Middle of the cut and axes right, up (along the cut) and outwards, at the initial position."""
    path = np.unique(result.row[result.layer == 0])
    points = result.initial[path]
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    a, b, c = corners(result.initial, result.skin[np.isin(result.skin, path).any(axis=1)])
    out = np.cross(b - a, c - a).sum(axis=0)
    out /= np.linalg.norm(out)
    along = np.linalg.svd(points - points.mean(axis=0))[2][0]
    along -= out * (along @ out)
    along *= np.sign(along @ [0, 0, 1]) or 1
    along /= np.linalg.norm(along)
    return middle, np.array([np.cross(along, out), along, out])


def draw(axes, result, middle, frame, half):
    seen = (result.position - middle) @ frame.T
    a, b, c = corners(seen, result.skin)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    near = (np.abs((a + b + c) / 3)[:, :2] < 1.5 * half).all(axis=1) & (normal[:, 2] > 0)
    bright = 0.55 + 0.45 * np.clip(normal @ LIGHT, 0, 1)
    faces = np.stack([a, b, c], axis=1)[near, :, :2]
    color = bright[near, None] * SKIN
    axes.add_collection(PolyCollection(faces, facecolors=color, edgecolors=EDGE, linewidths=0.3))
    axes.set(xlim=(-0.6 * half, 0.6 * half), ylim=(-half, half), aspect="equal")
    axes.set_facecolor((0.35, 0.08, 0.08))
    axes.set_xticks([]), axes.set_yticks([])
    axes.set_title(f"{result.name}: {result.gaps()[0]:.2f} mm", fontsize=9)


def main():
    picture, *names = words(__doc__, 2)
    files = [f"{result_name(name)}.h5" for name in names]
    target, results = Target(picture, ".png", files), [Result(file) for file in files]
    for result in results:
        gaps = ", ".join(f"{gap:.3f} mm in layer {a}" for a, gap in enumerate(result.gaps()))
        print(f"{result.name}: {gaps}")
    middle, frame = frame_of(results[0])
    cut = results[0].initial[results[0].row]
    half = np.abs((cut - middle) @ frame[1]).max() + MARGIN
    figure, panels = plt.subplots(1, len(results), figsize=(2.4 * len(results), 4), squeeze=False)
    for axes, result in zip(panels[0], results):
        draw(axes, result, middle, frame, half)
    write_figure(figure, target)


if __name__ == "__main__":
    run(main)
