#!/usr/bin/env python3
"""The pictures of repose-tradeoff, drawn without a screen from the tables it wrote.

    drivers/plot_tradeoff.py NAME [NAME …]

For each NAME reads NAME.csv, NAME_map.csv and NAME_triangles.csv and writes NAME.png (error against
evaluations and time, what layers, volume term and load steps change; the cheapest ways are named)
and NAME_map.png (where on the face). Then prints how the program's own estimates compare with the
true errors of all the tables together.
Needs: apt-get install --no-install-recommends python3-matplotlib
"""

from sheet.script import Unusable, reading, refuse_missing, run, words
from sheet.whole_file import Target, write_figure

try:
    import matplotlib
    import numpy as np

    from sheet.columns import numbers_in, read_rows
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-matplotlib")

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap

from sheet import RAMP

# Study → the column that it varies, and how a value of it reads.
STUDIES = {"layers": ("layers", "{} layers"), "springs": ("layers", "{} layers of springs"),
           "volume": ("volume", "{} volume"), "load steps": ("load_steps", "{} load steps"),
           "mesh": ("edge_mm", "{} mm edges")}
MAPPED = ("layers", "springs", "volume", "mesh")  # studies of the discrete model
MARKS = {"ntr": "o", "nls": "s", "lmvm": "^", "cg": "v", "bnls": "D", "bntr": "P"}
COLORS = LinearSegmentedColormap.from_list("distance", [f"#{color}" for color in RAMP])
INK, ACCENT = "#303030", "#b02020"
WORDS = ("study", "method", "volume", "load_steps", "layers", "edge_mm", "converged")
COSTS = ("accuracy_mm", "cpu_s", "evaluations")
DISTANCES = ("estimate_mm", "error_mm", "skin_95_mm", "skin_max_mm")
UNKNOWN = ("nan", "-nan", "inf")
TABLE = "a table of repose-tradeoff"


def read(name):
    """The rows of NAME.csv, numbers as numbers; those of runs that did not end may be unknown."""
    rows = read_rows(name + ".csv", TABLE, (*WORDS, *COSTS, *DISTANCES))
    with reading(name + ".csv", TABLE):
        if unknown := [row["study"] for row in rows if row["study"] not in ("solver", *STUDIES)]:
            raise Unusable(f"{name}.csv: unknown study '{unknown[0]}'; this script draws solver, "
                           f"{', '.join(STUDIES)}")
        numbers_in(rows, "converged", 0, 1, int)
        for key in (*COSTS, *DISTANCES):
            unknown = UNKNOWN if key in DISTANCES else ()
            for row, number in zip(rows, numbers_in(rows, key, 0, unknown=unknown)):
                row[key] = number
    return rows


def front(rows, cost, error):
    """The rows that no other beats in both, cheapest first."""
    best, kept = np.inf, []
    for row in sorted(rows, key=lambda row: (row[cost], row[error])):
        if row[error] < best:
            best = row[error]
            kept.append(row)
    return kept


def draw_methods(axes, rows, cost, label):
    """True error over cost, a line a method; the front is marked and named."""
    rows = [row for row in rows if row["study"] == "solver" and row["error_mm"] > 0]
    axes.set_xlabel(label)
    axes.set_ylabel("true error, mm")
    if not rows:
        return
    unit = min(row["cpu_s"] for row in rows) or 1 if cost == "cpu_s" else 1
    for method in dict.fromkeys(row["method"] for row in rows):
        own = sorted((row for row in rows if row["method"] == method),
                     key=lambda row: -row["accuracy_mm"])
        axes.loglog([row[cost] / unit for row in own], [row["error_mm"] for row in own],
                    MARKS.get(method, "x") + "-", ms=4, lw=0.8, label=method)
    kept = front(rows, cost, "error_mm")
    axes.loglog([row[cost] / unit for row in kept], [row["error_mm"] for row in kept], "o", ms=9,
                mfc="none", mec=ACCENT, label="cheapest")
    if max(row[cost] for row in rows) < 10 * min(row[cost] for row in rows):
        axes.set_xscale("linear")
    axes.legend(fontsize=7)


def draw_choices(axes, rows):
    """Draws the distance of the skin from the reference for each layer count, volume term and load step."""
    names = [STUDIES[row["study"]][1].format(row[STUDIES[row["study"]][0]]) for row in rows]
    place = np.arange(len(rows))
    axes.barh(place, [max(row["skin_max_mm"], 1e-6) for row in rows], color="0.85", label="largest")
    axes.barh(place, [max(row["skin_95_mm"], 1e-6) for row in rows], color="0.6", height=0.5,
              label="95 %")
    unit = min(row["cpu_s"] for row in rows) or 1
    for k, row in enumerate(rows):
        axes.text(0.98, k, f"{row['cpu_s'] / unit:.2g}×", fontsize=6.5, ha="right", va="center",
                  transform=axes.get_yaxis_transform())
    axes.set_yticks(place, names, fontsize=6.5)
    axes.set_xlabel("skin from the reference, mm (right: time)")
    axes.legend(fontsize=7, loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2, frameon=False)
    axes.invert_yaxis()


def draw_study(name, rows):
    others = [row for row in rows if row["study"] != "solver" and np.isfinite(row["skin_95_mm"])]
    methods = not others or any(row["study"] == "solver" and row["error_mm"] > 0 for row in rows)
    count = 2 * methods + bool(others)
    figure, panels = plt.subplots(1, count, figsize=(4 * count, 3.6), squeeze=False)
    if methods:
        draw_methods(panels[0][0], rows, "evaluations", "evaluations of value and gradient")
        draw_methods(panels[0][1], rows, "cpu_s", "time, relative to the fastest")
    if others:
        draw_choices(panels[0][-1], others)
    figure.tight_layout()
    write_figure(figure, Target(name + ".png", ".png"))


def draw_map(name):
    """The reference's face from the side and the front, colored by each way's error."""
    file, what = name + "_map.csv", "a map of repose-tradeoff"
    rows = read_rows(file, what, "xyz")
    titles = [title for title in rows[0] if title not in ("x", "y", "z")]
    with reading(file, what):
        points = np.stack([numbers_in(rows, axis) for axis in "xyz"], axis=1)
        error = np.array([numbers_in(rows, title, 0) for title in titles]).T
    file, what = name + "_triangles.csv", "triangles of repose-tradeoff"
    rows = read_rows(file, what, "abc")
    with reading(file, what):
        triangles = np.stack([numbers_in(rows, corner, 0, len(points) - 1, int) for corner in "abc"], axis=1)
    shown = [k for k, title in enumerate(titles) if title.startswith(MAPPED)]
    if not shown:
        return
    largest = np.percentile(error[:, shown].max(axis=1), 99)
    figure, panels = plt.subplots(1, len(shown), figsize=(1.7 * len(shown), 2.6), squeeze=False)
    order = np.argsort(-points[triangles][:, :, 1].mean(axis=1))
    for axes, k in zip(panels[0], shown):
        faces = PolyCollection(points[triangles][order][:, :, [0, 2]], cmap=COLORS, lw=0)
        faces.set_array(error[:, k][triangles].mean(axis=1)[order])
        faces.set_clim(0, largest)
        axes.add_collection(faces)
        axes.autoscale()
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(titles[k], fontsize=7)
    bar = figure.colorbar(faces, ax=panels[0], shrink=0.8)
    bar.set_label("mm from the reference", fontsize=7)
    bar.ax.tick_params(labelsize=6)
    write_figure(figure, Target(name + "_map.png", ".png"))


def judge_estimates(rows):
    """Markdown rows: how the estimate of each run compares with its true error, by method. A run
    that is ten times its estimate away is taken to have come to another rest position."""
    print("\n| method | runs | estimate below the error | more than 10 times above | ratio, median "
          "(5 … 95 %) | in another rest position |\n|---|--:|--:|--:|--:|--:|")
    methods = list(dict.fromkeys(row["method"] for row in rows))
    for method in [*methods, "all"]:
        own = [row for row in rows if method in ("all", row["method"])
               and row["error_mm"] > 1e-7 and row["converged"] == "1"]
        ratio = np.array([row["estimate_mm"] / row["error_mm"] for row in own])
        elsewhere = np.sum(ratio < 0.1)
        ratio = ratio[ratio >= 0.1]
        if len(ratio) == 0:
            print(f"| {method} | {len(own)} | – | – | – | {elsewhere} |")
            continue
        low, middle, high = np.percentile(ratio, [5, 50, 95])
        print(f"| {method} | {len(own)} | {np.mean(ratio < 1):.1%} | {np.mean(ratio > 10):.1%} | "
              f"{middle:.2f} ({low:.2f} … {high:.2f}) | {elsewhere} |")


def main():
    every = []
    for name in (given.removesuffix(".csv") for given in words(__doc__, 1)):
        rows = read(name)
        draw_study(name, rows)
        draw_map(name)
        every += rows
    judge_estimates(every)


run(main)
