#!/usr/bin/env python3
"""How the weight of the volume term changes conditioning, work, time and volume error: a table.

    drivers/weights.py [SCENE] [-bin build/bin] [-output docs/measurements/weights.md]

Solves SCENE (default: meshes/paper_jaw_advance.yaml) once a weight: λ of the paper's term from 1e-9
to 1 − 1e-9, the bulk modulus κ of the penalty from 1e-6 to 1e3 N/mm². Times are ratios to κ = 1;
a search is stopped after 40 s.
Needs: apt-get install --no-install-recommends python3-h5py
"""

import os
import pathlib
import sys
import tempfile

from sheet.script import Arguments, reading, refuse, refuse_missing, require_file, run, start
from sheet.whole_file import Target

try:
    import h5py
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-h5py")

PROJECT = pathlib.Path(__file__).resolve().parents[1]
LAMBDAS = ("1e-9", "1e-6", "1e-3", "0.5", "0.999", "0.999999", "0.999999999")
MODULI = ("1e-6", "1e-4", "1e-2", "1", "1e2", "1e3")
PATIENCE = 40  # s
MARK = "<!-- measured -->\n"  # the tables of a page follow
HEAD = ("| {} | ended | load | condition number | smallest eigenvalue, N/mm | iterations | "
        "evaluations | time | largest volume error | inverted | estimate, mm |")


def solve(program, scene, options):
    """The steps (attributes) of one run. Ends the script where the input is refused."""
    with tempfile.TemporaryDirectory() as folder:
        name = os.path.join(folder, "result")
        done = start(program, scene, *options, "-stability", "-output", name, "-time_limit", PATIENCE,
                     capture_output=True, text=True)
        if done.returncode not in (0, 2):
            print(done.stderr.strip() or f"weights.py: repose-solve ended with status {done.returncode}",
                  file=sys.stderr)
            sys.exit(max(done.returncode, 1))
        with h5py.File(name + ".h5") as h5:
            return [dict(h5["step"][k].attrs) for k in sorted(h5["step"])]


def row(weight, steps, unit):
    last, total = steps[-1], lambda name: sum(step[name] for step in steps)
    smallest = last["smallest_eigenvalue"]
    condition = f"{last['largest_eigenvalue'] / smallest:.1e}" if smallest > 0 else "–"
    ended = "NOT CONVERGED" if not last["converged"] else "folded" if last["inverted_prisms"] else "converged"
    return (f"| {weight} | {ended} | {last['load']:.3g} | {condition} | {smallest:.2e} | "
            f"{total('iterations')} | {total('evaluations')} | {total('seconds') / unit:.2g} | "
            f"{last['volume_error_max']:.2g} | {last['inverted_prisms']} | "
            f"{last['displacement_error']:.1g} |")


def table(heading, rows):
    return "\n".join([HEAD.format(heading), "|---" * 11 + "|", *rows]) + "\n"


def arguments():
    parser = Arguments(__doc__)
    parser.add_argument("scene", nargs="?", default=PROJECT / "meshes/paper_jaw_advance.yaml")
    parser.add_argument("-bin", default=PROJECT / "build/bin")
    parser.add_argument("-output")
    chosen = parser.parse_args()
    chosen.program = os.path.join(chosen.bin, "repose-solve")
    for file in (chosen.program, chosen.scene):
        require_file(file, "-bin names the folder of repose-solve")
    return chosen


def page_to_fill(file):
    """A page (.md) as a target, and its text up to the mark after which the tables stand."""
    page = Target(file, ".md")
    with reading(file, "a page in UTF-8"):
        before, mark, _ = pathlib.Path(file).read_text(encoding="utf-8").partition(MARK)
    if not mark:
        refuse(f"{file}: has no line {MARK.strip()}, after which the tables are to stand; add it")
    return page, before + mark


def main():
    chosen = arguments()
    page = page_to_fill(chosen.output) if chosen.output else None
    solve_by = lambda *options: solve(chosen.program, chosen.scene, options)
    penalties = {k: solve_by("-volume", "penalty", "-bulk_modulus", k) for k in MODULI}
    papers = {l: solve_by("-volume", "paper", "-lambda", l) for l in LAMBDAS}
    unit = sum(step["seconds"] for step in penalties["1"])
    text = table("κ, N/mm²", [row(k, found, unit) for k, found in penalties.items()]) + "\n"
    text += table("λ", [row(l, found, unit) for l, found in papers.items()])
    print(text)
    if page:
        target, before = page
        target.write(f"{before}\n{text}")


run(main)
