#!/usr/bin/env python3
"""Whether the error that a search in an active region says can be leaned on: a table.

    tests/benchmark/active_region_error.py [-bin build/bin] [-accuracies 0.3,0.1,0.02]
                                           [-output docs/active_region.md]

Scenes of the shipped head, as they are and changed, solved with -active_region on and compared with
-active_region off at 1e-5 mm.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import argparse
import pathlib
import subprocess
import tempfile

import h5py
import numpy as np

from page import PROJECT, print_table

CHIN = "head_genioplasty"
TURGOR = [("layers: 4", "layers: 4\n  turgor: 0.05\n  mass: [.1, .1, .1, .1]")]
STIFF_SKIN = [("default: {", '"layer 0": {stiffness: 20.0}\n    default: {')]
GRAVITY = "\ngravity: [0, 0, -9.80665]\n"
# What it is, scene, changes of its text, what is added, options.
CASES = [
    ("chin forward", CHIN, [], "", []),
    ("no volume term", CHIN, [], "", ["-volume", "none"]),
    ("bulk modulus 30 N/mm²", CHIN, [], "", ["-bulk_modulus", "30"]),
    ("volume term paper, λ = 0.9", CHIN, [], "", ["-volume", "paper", "-lambda", "0.9"]),
    ("skin 20 times as stiff", CHIN, STIFF_SKIN, "", []),
    ("turgor 0.05 and weight", CHIN, TURGOR, GRAVITY, []),
    ("instrument", "head_instrument", [], "", []),
    ("Le Fort I", "head_le_fort", [], "", []),
    ("jaw forward", "head_jaw_advance", [], "", []),
]
HEAD = ("| case | accuracy, mm | active columns | rounds | error said, mm | true, mm | said / true | "
        "least said / true of a step |\n|---" + "|--:" * 7 + "|")


def solve(program, folder, name, *options):
    """The loads, positions and errors of a solve's steps, and its row about the region."""
    done = subprocess.run([program, "scene.yaml", "-nested", "off", "-output", name, *options],
                          cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stderr + done.stdout)
    region = [line.split() for line in done.stdout.splitlines() if "active region" in line]
    with h5py.File(folder / f"{name}.h5") as h5:
        steps = {h5["step"][k].attrs["load"]: (h5["step"][k]["point/position"][()],
                                               h5["step"][k].attrs["displacement_error"])
                 for k in sorted(h5["step"])}
    return steps, region[0] if region else None


def rows_of(case, accuracies, program):
    what, scene, changes, more, options = case
    text = (PROJECT / f"meshes/{scene}.yaml").read_text() + more
    text = text.replace(": head_", f": {PROJECT}/meshes/head_")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "scene.yaml").write_text(text)
        exact, _ = solve(program, folder, "exact", "-active_region", "off", "-accuracy", "1e-5",
                         *options)
        for accuracy in accuracies:
            found, region = solve(program, folder, "found", "-active_region", "on", "-accuracy",
                                  accuracy, *options)
            true = {load: np.linalg.norm(x - exact[load][0], axis=1).max()
                    for load, (x, _) in found.items() if load in exact and load > 0}
            least = min(found[load][1] / true[load] for load in true)
            yield (f"| {what} | {accuracy} | {region[2]} of {region[4]} | {region[7]} | "
                   f"{found[1][1]:.2g} | {true[1]:.2g} | {found[1][1] / true[1]:.1f} | {least:.1f} |")


def arguments():
    parser = argparse.ArgumentParser(prog="active_region_error.py", description=__doc__,
                                     add_help=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("-bin", type=pathlib.Path, default=PROJECT / "build/bin")
    parser.add_argument("-accuracies", default="0.3,0.1,0.02")
    parser.add_argument("-output", type=pathlib.Path)
    return parser.parse_args()


def main():
    chosen = arguments()
    program, accuracies = chosen.bin.resolve() / "repose-solve", chosen.accuracies.split(",")
    print_table(HEAD, (line for case in CASES for line in rows_of(case, accuracies, program)),
                chosen.output, "estimates")


main()
