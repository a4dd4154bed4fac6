#!/usr/bin/env python3
"""Solves operations on the CT of a head by drivers/plan.py: the tables of docs/start/from_ct.md.

    tests/benchmark/plans.py [-bin build/bin] [-head ../shared/data/head/head_hu.mhd]
                             [-operations "Le Fort I impaction 4 mm;jaw, 5 mm forward"]
                             [-output docs/start/from_ct.md]

With -head headsq.mhd the second table, that of the second head. Needs what drivers/plan.py needs.
"""

import os
import pathlib
import sys
import tempfile

import h5py

from measure import run
from page import PROJECT, option_parser, print_table
from heads import DATA  # page knows where it is
from sheet.summary import cautions  # page knows where it is

HEAD = "| `-operation` | status | the face | remarks |\n|---|--:|---|---|"
# Head → mark of its table, arguments of plan.py and operations.
HEADS = {
    "head_hu": ("operations", [], [
        "Le Fort I, 5 mm forward, 2 up", "Le Fort I, 4 mm down, 3 degrees yaw", "Le Fort I impaction 4 mm",
        "sagittal split, 6 mm advance", "sagittal split, 5 mm setback", "BSSO set-back of 4 mm",
        "genioplasty, 8 mm forward", "genioplasty, 4 mm back, 3 mm up", "open the jaw by 8 degrees",
        "jaw 3 mm left, roll 2 degrees", "close the jaw by 3 degrees",
        "Le Fort I 5 mm forward, BSSO 6 mm back, genioplasty 4 mm forward"]),
    "headsq": ("second head", ["-level", 724, "-bone", 1250], [
        "jaw, 5 mm forward", "Le Fort I, 5 mm forward, 2 up", "Le Fort I, 4 mm up", "sagittal split, 6 mm advance",
        "sagittal split, 5 mm setback", "genioplasty, 6 mm forward", "close the jaw by 8 degrees"])}


def summary_of(result):
    with h5py.File(result) as h5:
        return [line.decode() for line in h5["summary"][()]]


def remark(name, told):
    """A caution in few words: the text of a warning up to its remedy, else the name of its row."""
    return told.split(";")[0] if name == "warning" else f"*{name}*"


def row_of(operation, status, summary):
    """A row of the table: how landmarks of the face move, and the cautions of the summary."""
    face = summary[0].split("; largest movement")[0]
    remarks = dict.fromkeys(remark(*caution) for caution in cautions(summary))
    return f"| {operation} | {status} | {face} | {'; '.join(remarks)} |"


def rows(chosen, arguments, operations, folder):
    for operation in operations:
        done = run([sys.executable, PROJECT / "drivers/plan.py", chosen.head, *arguments, "-operation", operation,
                    "-output", folder / "plan"], env={**os.environ, "REPOSE_BUILD": str(chosen.bin.parent)})
        yield row_of(operation, done.status, summary_of(folder / "plan/face.h5"))


def main():
    chosen = option_parser(__doc__, head=str(DATA / "head_hu.mhd"), operations="").parse_args()
    mark, arguments, operations = HEADS[pathlib.Path(chosen.head).stem]
    with tempfile.TemporaryDirectory() as name:
        print_table(HEAD, rows(chosen, arguments, chosen.operations.split(";") if chosen.operations else operations,
                               pathlib.Path(name)), chosen.output, mark)


if __name__ == "__main__":
    main()
