#!/usr/bin/env python3
"""Measures how the skin follows moves that are alike: jaw and chin 5 mm forward, the chin by a
little less to a little more; and a chin and an upper jaw that move farther and farther. Writes the
tables of a page.

    tests/benchmark/attachment.py [-bin build/bin] [-head ../shared/data/head] [-accuracy 0.01]
                                  [-output docs/guide/surgery.md] [-heads head,real_head]

Each row of the first table is the change of the skin from the row before; those of the second are
over all steps, in each of which the skin changes by so much at the point that changes most. Needs: apt-get install
--no-install-recommends python3-h5py python3-numpy
"""

import pathlib
import tempfile

import numpy as np

from measure import run
from page import PROJECT, option_parser, print_table
from tissue import last, model_of

FORWARD = 5  # mm
MORE = [-2, -1.5, -1, -0.5, -0.25, -0.1, -0.001, 0, 0.001, 0.1, 0.25, 0.5, 1, 1.5, 2]  # mm
HEAD = ("| head | chin farther than the jaw by, mm | step, mm | released columns | skin changes by, mm: "
        "largest, 95 % |\n|---" + "|--:" * 4 + "|")

GROWING = [0.5 + 0.1 * k for k in range(36)]  # mm
OPERATIONS = {"genioplasty": "chin", "le_fort": "maxilla"}
GROWING_HEAD = ("| scene | forward, mm | steps | skin changes at most by, mm a mm: median step, 90 % of steps, "
                "all steps |\n|---" + "|--:" * 3 + "|")


def scene_of(head, more):
    text = (PROJECT / f"meshes/{head}_genioplasty.yaml").read_text().partition("moves:\n")[0]
    return (f"{text}moves:\n  - {{bone: mandible, translate: [0, {-FORWARD}, 0]}}\n"
            f"  - {{bone: chin, translate: [0, {-FORWARD - more}, 0]}}\n")


def scene_of_operation(head, operation, forward):
    text = (PROJECT / f"meshes/{head}_{operation}.yaml").read_text().partition("moves:\n")[0]
    bone = OPERATIONS[operation]
    return f"{text}moves:\n  - {{bone: {bone}, translate: [0, {-forward:g}, 0]}}\n"


def solve(chosen, folder, scene, *options):
    """Released columns and the displacement of the skin."""
    (folder / "scene.yaml").write_text(scene)
    done = run([chosen.bin / "repose-solve", "scene.yaml", "-output", "face", "-accuracy",
                chosen.accuracy, *options], folder, ends=[0])
    released = done.message["columns"].partition("(")[2].partition(" ")[0]
    on_skin = model_of(folder / "face.h5")["point/layer"] == 0
    return released, last(folder / "face.h5")["point/displacement"][on_skin]


def rows(chosen, folder):
    for head in chosen.heads.split(","):
        before = None
        for more in MORE:
            released, skin = solve(chosen, folder, scene_of(head, more))
            if before is not None:
                change = np.linalg.norm(skin - before[1], axis=1)
                yield (f"| {head} | {more:g} | {more - before[0]:.3g} | {released} | "
                       f"{change.max():.3f}, {np.quantile(change, 0.95):.3f} |")
            before = more, skin


def growing(chosen, folder):
    for head in chosen.heads.split(","):
        for operation in OPERATIONS:
            skins = [solve(chosen, folder, scene_of_operation(head, operation, forward),
                           "-skip_other_rest")[1] for forward in GROWING]
            change = [np.linalg.norm(after - before, axis=1).max()
                      for before, after in zip(skins, skins[1:])] / np.diff(GROWING)
            yield (f"| {head}_{operation} | {GROWING[0]:g} to {GROWING[-1]:g} | {len(change)} | "
                   f"{np.median(change):.2f}, {np.quantile(change, 0.9):.2f}, {change.max():.2f} |")


def main():
    chosen = option_parser(__doc__, accuracy=0.01, heads="head,real_head",
                           head=str(PROJECT.parent / "shared/data/head")).parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file in [*(PROJECT / "meshes").glob("head_*"),
                     *pathlib.Path(chosen.head).glob("[sm]*.ply")]:
            (folder / file.name).symlink_to(file.resolve())
        print_table(HEAD, rows(chosen, folder), chosen.output, "attachment")
        print_table(GROWING_HEAD, growing(chosen, folder), chosen.output, "growing")


if __name__ == "__main__":
    main()
