#!/usr/bin/env python3
"""How the weight of the volume term changes conditioning, work, time and volume error: a table.

    drivers/weights.py [SCENE] [-bin build/bin] [-output docs/measurements/weights.md]

Solves SCENE (default: meshes/paper_jaw_advance.yaml) once a weight: λ of the paper's term from 1e-9
to 1 − 1e-9, the bulk modulus κ of the penalty from 1e-6 to 1e3 N/mm². Times are ratios to κ = 1;
a search is stopped after 40 s.
Needs: apt-get install --no-install-recommends python3-h5py
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

try:
    import h5py
except ImportError as missing:
    print(f"weights.py: {missing.name} is missing: "
          "apt-get install --no-install-recommends python3-h5py", file=sys.stderr)
    sys.exit(1)

PROJECT = pathlib.Path(__file__).resolve().parents[1]
LAMBDAS = ("1e-9", "1e-6", "1e-3", "0.5", "0.999", "0.999999", "0.999999999")
MODULI = ("1e-6", "1e-4", "1e-2", "1", "1e2", "1e3")
PATIENCE = 40  # s
HEAD = ("| {} | ended | load | condition number | smallest eigenvalue, N/mm | iterations | "
        "evaluations | time | largest volume error | inverted | estimate, mm |")


def solve(program, scene, options):
    """Exit status and steps (attributes) of one run; no steps where the input was refused."""
    with tempfile.TemporaryDirectory() as folder:
        name = os.path.join(folder, "result")
        done = subprocess.run([program, scene, *options, "-stability", "-output", name,
                               "-time_limit", str(PATIENCE)],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True)
        if done.returncode not in (0, 2):
            print(done.stderr, file=sys.stderr, end="")
            return done.returncode, []
        with h5py.File(name + ".h5") as h5:
            return done.returncode, [dict(h5["step"][k].attrs) for k in sorted(h5["step"])]


def row(weight, status, steps, unit):
    if not steps:
        return f"| {weight} | refused" + " | –" * 9 + " |"
    last, total = steps[-1], lambda name: sum(step[name] for step in steps)
    smallest = last["smallest_eigenvalue"]
    condition = f"{last['largest_eigenvalue'] / smallest:.1e}" if smallest > 0 else "–"
    ended = "converged" if status == 0 else "NOT CONVERGED"
    return (f"| {weight} | {ended} | {last['load']:.3g} | {condition} | {smallest:.2e} | "
            f"{total('iterations')} | {total('evaluations')} | {total('seconds') / unit:.2g} | "
            f"{last['volume_error_max']:.2g} | {last['inverted_prisms']} | "
            f"{last['displacement_error']:.1g} |")


def table(heading, rows):
    return "\n".join([HEAD.format(heading), "|---" * 11 + "|", *rows]) + "\n"


def arguments():
    parser = argparse.ArgumentParser(prog="weights.py", description=__doc__, add_help=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("scene", nargs="?", default=PROJECT / "meshes/paper_jaw_advance.yaml")
    parser.add_argument("-bin", default=PROJECT / "build/bin")
    parser.add_argument("-output")
    return parser.parse_args()


def main():
    chosen = arguments()
    program = os.path.join(chosen.bin, "repose-solve")
    for file in (program, chosen.scene):
        if not os.path.isfile(file):
            print(f"weights.py: {file}: no such file; -bin names the folder of repose-solve",
                  file=sys.stderr)
            sys.exit(1)
    run = lambda *options: solve(program, chosen.scene, options)
    penalties = {k: run("-volume", "penalty", "-bulk_modulus", k) for k in MODULI}
    papers = {l: run("-volume", "paper", "-lambda", l) for l in LAMBDAS}
    unit = sum(step["seconds"] for step in penalties["1"][1])
    text = table("κ, N/mm²", [row(k, *found, unit) for k, found in penalties.items()]) + "\n"
    text += table("λ", [row(l, *found, unit) for l, found in papers.items()])
    print(text)
    if chosen.output:
        page = pathlib.Path(chosen.output)
        before, mark, _ = page.read_text().partition("<!-- measured -->\n")
        page.with_suffix(".part").write_text(before + mark + "\n" + text)
        page.with_suffix(".part").rename(page)


main()
