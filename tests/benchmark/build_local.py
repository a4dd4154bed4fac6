#!/usr/bin/env python3
"""Measures each stage of a large solid before its search, by ranks: a table.

    tests/benchmark/build_local.py [-bin build/bin] [-sizes 25000,125000,750000] [-ranks 2]
                             [-output docs/measurements/growth.md]

Synthetic heads of the given numbers of skin vertices, four layers, with contact, the jaw 6 mm forward:
benchmark_build_local builds the model of each whole on rank 0 and shares it out, or lets all ranks build their
parts of it. Bytes are those of the most that was in use during a stage, beyond the surfaces and the
program. Needs: cmake --preset release -DREPOSE_BENCHMARKS=ON
"""

import tempfile

from measure import run
from page import option_parser, print_table

HEAD = ("| points | model | stage | CPU, µs/point | rank 0, B/point | largest other, B/point |\n"
        "|--:|---|---|--:|--:|--:|")


def rows_of(program, size, ranks):
    for way in ("whole", "raised"):
        with tempfile.TemporaryDirectory() as folder:
            text = run([program, size, "model", way], folder, ranks, ends=[0]).text
        lines = [line.split() for line in text.splitlines()]
        points = next(int(words[1]) for words in lines if words[0] == "points")
        stages = [(words[0], *map(float, words[1:])) for words in lines if words[0] != "points"]
        _, _, _, first, other = stages[0]  # the surfaces
        for name, seconds, _, mine, others in stages[1:]:
            yield (f"| {points} | {way} | {name} | {1e6 * seconds / points:.1f} "
                   f"| {(mine - first) / points:.0f} | {(others - other) / points:.0f} |")


def main():
    chosen = option_parser(__doc__, sizes="25000,125000,750000", ranks=2).parse_args()
    program = chosen.bin / "benchmark_build_local"
    rows = (row for size in chosen.sizes.split(",")
            for row in rows_of(program, size, chosen.ranks))
    print_table(HEAD, rows, chosen.output, "raised")


if __name__ == "__main__":
    main()
