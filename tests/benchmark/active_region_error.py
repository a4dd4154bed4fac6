#!/usr/bin/env python3
"""Whether the error that a search in an active region says can be leaned on: a table.

    tests/benchmark/active_region_error.py [-bin build/bin] [-accuracies 0.3,0.1,0.02]
                                           [-output docs/measurements/active_region.md]

Scenes of the shipped head with springs, changed in part, solved with -active_region on and compared with
-active_region off at 1e-5 mm.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import pathlib
import tempfile

from measure import run
from page import PROJECT, option_parser, print_table
from tissue import apart, as_springs, steps

CHIN = "head_genioplasty"
TURGOR = [("layers: 4", "layers: 4\n  turgor: 0.05\n  mass: [.1, .1, .1, .1]")]
STIFF_SKIN = [("{default: {", '{"layer 0": {stiffness: 20.0}, default: {')]
SOFT = [("stiffness: 1.0", "modulus: 0.05")]
GRAVITY = "\ngravity: [0, 0, -9.80665]\n"
# What it is, scene, changes of its text, what is added, options.
CASES = [
    ("chin forward", CHIN, [], "", []),
    ("no volume term", CHIN, [], "", ["-volume", "none"]),
    ("bulk modulus 30 N/mm²", CHIN, [], "", ["-bulk_modulus", "30"]),
    ("volume term paper, λ = 0.9", CHIN, [], "", ["-volume", "paper", "-lambda", "0.9"]),
    ("skin 20 times as stiff", CHIN, STIFF_SKIN, "", []),
    ("turgor 0.05 and weight", CHIN, TURGOR, GRAVITY, []),
    ("instrument", "head_instrument", SOFT, "", []),
    ("Le Fort I", "head_le_fort", [], "", []),
    ("jaw forward", "head_jaw_advance", [], "", []),
]
HEAD = ("| case | accuracy, mm | active columns | rounds | error said, mm | true, mm | said / true | "
        "least said / true of a step |\n|---" + "|--:" * 7 + "|")


def solve(program, folder, name, *options):
    """The steps of a solve by their loads, and the words of its row about the region."""
    solved = run([program, "scene.yaml", "-output", name, *options], folder,
                 ends=[0])
    found = {step["load"]: step for step in steps(folder / f"{name}.h5")}
    return found, solved.said.get("active region", "").split()


def rows_of(case, accuracies, program):
    what, scene, changes, more, options = case
    text = as_springs((PROJECT / f"meshes/{scene}.yaml").read_text()) + more
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
            true = {load: apart(step, exact[load]) for load, step in found.items()
                    if load in exact and load > 0}
            error = {load: found[load]["displacement_error"] for load in true}
            least = min(error[load] / true[load] for load in true)
            yield (f"| {what} | {accuracy} | {region[0]} of {region[2]} | {region[5]} | "
                   f"{error[1]:.2g} | {true[1]:.2g} | {error[1] / true[1]:.1f} | {least:.1f} |")


def main():
    chosen = option_parser(__doc__, accuracies="0.3,0.1,0.02").parse_args()
    program, accuracies = chosen.bin / "repose-solve", chosen.accuracies.split(",")
    print_table(HEAD, (line for case in CASES for line in rows_of(case, accuracies, program)),
                chosen.output, "estimates")


main()
