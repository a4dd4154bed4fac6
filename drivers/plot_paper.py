#!/usr/bin/env python3
"""The pictures of repose-paper's page, drawn without a screen from the files it wrote.

    drivers/plot_paper.py DIR

Reads laws.csv, equilibrium.csv, opening.h5, forward.h5, turned.h5 in DIR and writes paper_laws.png,
paper_equilibrium.png, paper_opening.png and paper_options.png beside them.
Needs: apt-get install --no-install-recommends python3-matplotlib python3-h5py
"""

import os

from sheet.script import reading, refuse, refuse_missing, run, words
from sheet.whole_file import Target, write_figure

try:
    import h5py
    import matplotlib
    import numpy as np

    from sheet.columns import read_columns
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-matplotlib python3-h5py")

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection

from plot_equilibrium import draw_forces

# Where the camera stands as seen from the head: +x patient left, +y posterior, +z up.
VIEWS = {"front": (0, -1, 0), "side": (1, 0, 0)}
LIGHT = np.array([0.35, -0.75, 0.55]) / np.linalg.norm([0.35, -0.75, 0.55])
SKIN = np.array([0.87, 0.68, 0.58])
COLUMN = 3.2  # inches
TABLE = "a table of repose-paper"
SOURCES = ("laws.csv", "equilibrium.csv", "opening.h5", "forward.h5", "turned.h5")


def draw_laws(source, target):
    """Fig. 3: tension over elongation."""
    styles = {"linear": ":", "quadratic": "--", "quartic": "-"}
    laws = read_columns(source, TABLE, ("s", *styles))
    figure, axes = plt.subplots(figsize=(5, 3.4))
    for name, style in styles.items():
        axes.plot(laws["s"], laws[name], "k" + style, label=name)
    axes.set(xlabel="elongation s, mm", ylabel="tension T / k0, mm")
    axes.axhline(0, color="0.8", lw=0.7, zorder=0)
    axes.axvline(0, color="0.8", lw=0.7, zorder=0)
    axes.legend(frameon=False)
    write_figure(figure, target)


def draw_equilibrium(source, target):
    """Fig. 2: the forces on the points of the skin seen from the side, before and after."""
    names = [[state + k for k in "xyz"] for state in ("", "before_", "after_")]
    columns = read_columns(source, TABLE, ("layer", *sum(names, [])))
    skin = columns["layer"] == 0
    draw_forces(*(np.stack([columns[name][skin] for name in three], axis=1) for three in names), target)


def read(file):
    """Skin triangles and bones of the last step of a result; points before and after."""
    with reading(file, "a result of repose-paper"), h5py.File(file) as h5:
        before = h5["model/point/position"][()]
        steps = [h5["step"][name] for name in sorted(h5["step"])]
        after = steps[-1]["point/position"][()]
        return {"before": before, "after": after, "skin": h5["model/skin/points"][()]}


def faces(points, triangles, view):
    """Triangles as a camera sees them, back to front, with their brightness."""
    toward = np.array(VIEWS[view], float)
    right = np.cross((0, 0, 1), toward)
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    order = np.argsort((corners @ toward).mean(axis=1))
    flat = np.stack([corners @ right, corners[..., 2]], axis=-1)
    light = LIGHT if view == "front" else np.array([0.75, -0.4, 0.5])
    bright = 0.35 + 0.65 * np.clip(normal @ light, 0, 1)
    return flat[order], bright[order], order


def draw_face(axes, result, state, view, largest=None):
    """The skin before or after; colored by displacement up to `largest` mm where that is given."""
    flat, bright, order = faces(result[state], result["skin"], view)
    color = np.tile(SKIN, (len(order), 1))
    if largest:
        moved = np.linalg.norm(result["after"] - result["before"], axis=1)
        color = plt.cm.magma_r(0.9 * moved[result["skin"]].mean(axis=1)[order] / largest)[:, :3]
    shaded = np.clip(color * bright[:, None], 0, 1)
    axes.add_collection(PolyCollection(flat, facecolors=shaded, edgecolors=shaded, lw=0.3))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_axis_off()


def largest_move(results):
    return max(np.linalg.norm((r["after"] - r["before"])[r["skin"].ravel()], axis=1).max()
               for r in results)


def draw_states(panels, target):
    """A picture of panels (title, result, state, color) as columns and the views as rows."""
    largest = largest_move([result for _, result, _, _ in panels])
    figure, axes = plt.subplots(len(VIEWS), len(panels), squeeze=False,
                                figsize=(COLUMN * 0.8 * len(panels), 0.8 * COLUMN * len(VIEWS)))
    for row, view in zip(axes, VIEWS):
        for place, (title, result, state, colored) in zip(row, panels):
            draw_face(place, result, state, view, largest if colored else None)
            if view == next(iter(VIEWS)):
                place.set_title(title, fontsize=9)
    scale = plt.cm.ScalarMappable(plt.Normalize(0, largest / 0.9), plt.cm.magma_r)
    figure.colorbar(scale, ax=axes, shrink=0.5, label="displacement, mm")
    write_figure(figure, target)


def main():
    folder = words(__doc__, 1, 1)[0]
    path = lambda name: os.path.join(folder, name)
    target = lambda name: Target(path(f"paper_{name}.png"), ".png", map(path, SOURCES))
    for name in SOURCES:
        if not os.path.isfile(path(name)):
            refuse(f"{path(name)} is missing: give the folder that repose-paper wrote")
    draw_laws(path("laws.csv"), target("laws"))
    draw_equilibrium(path("equilibrium.csv"), target("equilibrium"))
    opening, forward, turned = (read(path(f"{n}.h5")) for n in ("opening", "forward", "turned"))
    draw_states([("before", opening, "before", False),
                 ("jaw opened by 8°", opening, "after", False),
                 ("displacement", opening, "after", True)], target("opening"))
    draw_states([("6 mm forward", forward, "after", False),
                 ("displacement", forward, "after", True),
                 ("forward and turned by 4°", turned, "after", False),
                 ("displacement", turned, "after", True)], target("options"))


run(main)
