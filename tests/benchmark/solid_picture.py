#!/usr/bin/env python3
"""The rest positions of a solid and of springs of one head, side by side: how far the skin moves in
each, how far the two are apart, and the largest principal stretch of the solid.

    tests/benchmark/solid_picture.py SOLID.h5 SPRINGS.h5 docs/images/solid_and_springs.png

Needs: apt-get install --no-install-recommends python3-h5py python3-matplotlib
"""

import sys

import h5py
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection

RIGHT, UP = np.array([0.83, 0.56, 0.0]), np.array([0.06, -0.09, 0.99])  # of the picture, LPS
TOWARDS = np.cross(RIGHT, UP)                                           # the eye
SHADE = 0.55


def read(file):
    """Skin triangles, initial and final positions, and of each prism its upper triangle's points and
    largest stretch where there is one."""
    with h5py.File(file) as h5:
        step = h5["step"][max(h5["step"])]
        found = {"triangles": h5["model/skin/points"][()],
                 "initial": h5["model/point/position"][()], "final": step["point/position"][()]}
        if "prism/principal_stretch" in step:
            layer, prisms = h5["model/point/layer"][()], h5["model/prism/points"][()]
            top = layer[prisms[:, 0]] == 0
            stretch = np.zeros(len(layer))
            np.maximum.at(stretch, prisms[top, :3],
                          np.repeat(step["prism/principal_stretch"][()][top, :1], 3, axis=1))
            found["stretch"] = stretch
    return found


def draw(axes, face, values, title, unit, limits, colors="viridis"):
    x, triangles = face["final"], face["triangles"]
    corners = x[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    facing = normal @ TOWARDS
    seen = np.flatnonzero(facing > 0)
    order = seen[np.argsort((corners.mean(axis=1) @ TOWARDS)[seen])]
    scale = plt.Normalize(*limits)
    color = plt.get_cmap(colors)(scale(values[triangles].mean(axis=1)))[:, :3]
    color *= (SHADE + (1 - SHADE) * np.clip(facing, 0, 1))[:, None]
    flat = np.stack([corners @ RIGHT, corners @ UP], axis=-1)
    axes.add_collection(PolyCollection(flat[order], facecolors=color[order],
                                       edgecolors=color[order], linewidths=0.3))
    axes.autoscale()
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(title, fontsize=15)
    bar = plt.colorbar(plt.cm.ScalarMappable(scale, colors), ax=axes, shrink=0.6, pad=0.02)
    bar.set_label(unit, fontsize=13)
    bar.ax.tick_params(labelsize=12)


def main():
    solid, springs = read(sys.argv[1]), read(sys.argv[2])
    way = [np.linalg.norm(face["final"] - face["initial"], axis=1) for face in (solid, springs)]
    apart = np.linalg.norm(solid["final"] - springs["final"], axis=1)
    skin = np.unique(solid["triangles"])
    most = max(way[0][skin].max(), way[1][skin].max())
    figure, axes = plt.subplots(1, 4, figsize=(19, 5.5), constrained_layout=True)
    draw(axes[0], solid, way[0], "solid: displacement", "mm", (0, most))
    draw(axes[1], springs, way[1], "springs: displacement", "mm", (0, most))
    draw(axes[2], solid, apart, "their distance", "mm", (0, np.quantile(apart[skin], 0.999)),
         "magma")
    draw(axes[3], solid, solid["stretch"], "solid: largest principal stretch", "",
         (1, np.quantile(solid["stretch"][skin], 0.99)), "cividis")
    figure.savefig(sys.argv[3], dpi=80)


main()
