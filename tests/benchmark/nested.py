#!/usr/bin/env python3
"""Measures the gain of coarser models: a table of a scene solved with and without them.

    tests/benchmark/nested.py [-bin build/bin] [-output docs/measurements/nested.md] SCENE …

Solves each scene to 0.01 mm along the load path, and with -adapt and as a preview; says what each took, on all levels, in evaluations on the scene's own mesh, and how far its
skin is from that of the first, over the vertices of the scene's skin.
Needs: apt-get install --no-install-recommends python3-h5py python3-scipy
"""

import pathlib
import re
import tempfile

import numpy as np
from scipy.spatial import cKDTree

from measure import run
from page import option_parser, print_table
from tissue import last, model_of

WAYS = [["-accuracy", "0.01"], ["-adapt", "-accuracy", "3"], ["-profile", "preview"]]
HEAD = ("| scene | points | options | coarse models, points | evaluations | Hessians | time | "
        "estimate for the skin, mm | skin from the first, mm: largest, 95 % |\n|---|--:|---|---"
        + "|--:" * 5 + "|")


def skin_of(file):
    """Skin vertices, triangles of them, and displacements at rest; points of the model."""
    model, step = model_of(file), last(file)
    initial, skin = model["point/position"], np.flatnonzero(model["point/layer"] == 0)
    error = step["displacement_error"] + step.get("discretisation_error", 0.0)
    triangles = np.searchsorted(skin, model["skin/points"])
    return (initial[skin], triangles, (step["point/position"] - initial)[skin], error,
            len(initial))


def carried(places, triangles, moved, points):
    """Displacements at `points` by the nearest triangle of a skin, linear on it."""
    corners = places[triangles]
    near = cKDTree(corners.mean(1)).query(points, k=min(12, len(triangles)))[1]
    a, b, c = (corners[near][:, :, k] for k in range(3))
    ab, ac, ap = b - a, c - a, points[:, None] - a
    dots = lambda p, q: (p * q).sum(-1)
    determinant = dots(ab, ab) * dots(ac, ac) - dots(ab, ac) ** 2
    v = (dots(ac, ac) * dots(ap, ab) - dots(ab, ac) * dots(ap, ac)) / determinant
    w = (dots(ab, ab) * dots(ap, ac) - dots(ab, ac) * dots(ap, ab)) / determinant
    weight = np.clip(np.stack([1 - v - w, v, w], -1), 0, None)
    weight /= weight.sum(-1, keepdims=True)
    foot = (weight[..., None] * corners[near]).sum(2)
    best = np.argmin(((foot - points[:, None]) ** 2).sum(-1), axis=1)
    row = np.arange(len(points))
    return (weight[row, best][:, :, None] * moved[triangles[near[row, best]]]).sum(1)


def work(solved, own_points):
    """Evaluations and Hessians of all levels, an evaluation on fewer points counting as many times
    less; points of the coarse models."""
    levels = [tuple(map(int, level)) for level in re.findall(
        r"coarse model +(\d+) points.*: (\d+) evaluations, (\d+) of the", solved.text)]
    points = levels[-1][0] if "solved model" in solved.text else own_points
    levels.append((points, *solved.evaluations))
    totals = [sum(level[0] * level[k] for level in levels) / own_points for k in (1, 2)]
    return totals, [level[0] for level in levels[:-1]]


def rows_of(program, scene):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        first = first_seconds = None
        for k, options in enumerate(WAYS):
            file = folder / f"{k}.h5"
            solved = run([program, scene, *options, "-output", file.with_suffix("")])
            places, triangles, moved, error, points = skin_of(file)
            if first is None:
                first, first_seconds, own_points = (places, moved), solved.seconds, points
            off = np.linalg.norm(carried(places, triangles, moved, first[0]) - first[1], axis=1)
            (evaluations, hessians), coarse = work(solved, own_points)
            yield (f"| {scene.stem} | {own_points} | `{' '.join(options)}` | "
                   f"{', '.join(map(str, coarse)) or '–'} | {evaluations:.0f} | {hessians:.1f} | "
                   f"{solved.seconds / first_seconds:.2f} | {error:.2g} | "
                   f"{off.max():.2g}, {np.percentile(off, 95):.2g} |")


def main():
    parser = option_parser(__doc__)
    parser.add_argument("scenes", nargs="+", type=pathlib.Path, metavar="SCENE")
    chosen = parser.parse_args()
    program = chosen.bin / "repose-solve"
    print_table(HEAD, (row for scene in chosen.scenes for row in rows_of(program, scene)),
                chosen.output)


main()
