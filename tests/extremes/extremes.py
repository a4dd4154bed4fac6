#!/usr/bin/env python3
"""Extremes of springs and solids: each row is one run of repose-solve, judged by closed forms or
by an
independent minimizer, or refused in words. Exit status 1 where a row is not as expected.

    tests/extremes/extremes.py -bin build-ci/bin                       # the whole table
    tests/extremes/extremes.py -bin build-ci/bin -fast 1               # without the slow rows
    tests/extremes/extremes.py -bin build-ci/bin -rows 'chain|Poisson'
    tests/extremes/extremes.py -bin build-ci/bin -output docs/measurements/extremes.md
"""

import os
import pathlib
import re
import sys
import tempfile

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "benchmark"), str(HERE.parent / "program")]

import pytest  # noqa: E402

import rows_contact  # noqa: E402
import rows_scenes  # noqa: E402
import rows_solid  # noqa: E402
import rows_springs  # noqa: E402
from conftest import mpi_environment  # noqa: E402
from judge import Verdict, expectation, folder_of, run_row  # noqa: E402
from page import option_parser, print_table  # noqa: E402

GROUPS = {
    "springs": [*rows_springs.ROWS, *rows_scenes.rows_of("springs")],
    "solid": [*rows_solid.ROWS, *rows_scenes.rows_of("solid")],
    "contact": rows_contact.ROWS,
}
HEAD = """| row | tissue | expected | got | evaluations | estimate, mm | error, mm | verdict |
|---|---|---|---|--:|--:|--:|---|"""


def line_of(group, verdict):
    number = lambda value: "" if value is None else f"{value:.2g}"  # noqa: E731
    row = verdict.row
    cells = [
        row.name,
        group,
        expectation(row),
        verdict.got,
        "" if verdict.evaluations is None else str(verdict.evaluations),
        number(verdict.estimate),
        number(verdict.error),
        "; ".join(verdict.faults) or "as expected",
    ]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def expected(arguments):
    for group, rows in GROUPS.items():
        for row in rows:
            if not (arguments.fast and row.slow) and re.search(
                arguments.rows, f"{group}: {row.name}"
            ):
                yield group, row


def run_one(group, row, top, environment):
    try:
        return run_row(row, folder_of(row, pathlib.Path(top) / group), environment)
    except pytest.fail.Exception as late:
        return Verdict(row, "no end", faults=[str(late).split(":")[0]])
    except ArithmeticError as failure:
        return Verdict(row, "a result", faults=[f"the judge gives up: {failure}"])


def main():
    parser = option_parser(__doc__, rows="", fast=0, keep="")
    arguments = parser.parse_args()
    os.environ["REPOSE_BIN"] = str(arguments.bin)
    environment, unexpected = mpi_environment(), []

    def lines(top):
        for group, row in expected(arguments):
            verdict = run_one(group, row, top, environment)
            unexpected.extend([row.name] if verdict.faults else [])
            yield line_of(group, verdict)

    with tempfile.TemporaryDirectory() as scratch:
        print_table(HEAD, lines(arguments.keep or scratch), arguments.output, "table")
    print(f"\n{len(unexpected)} rows not as expected", *unexpected, sep="\n")
    return int(bool(unexpected))


if __name__ == "__main__":
    sys.exit(main())
