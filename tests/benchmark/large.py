#!/usr/bin/env python3
"""Measures each stage of a large model in time and memory: two tables.

    tests/benchmark/large.py [-bin build/bin] [-sizes 477,2500,25000,250000,750000] [-ranks 1]
                             [-output docs/measurements/growth.md] [-mark large]

Synthetic heads of the given numbers of skin vertices, four layers, penalty volume term, the jaw 6 mm
forward: benchmark_large builds, writes, reads and shares out the model of each, evaluates it,
makes 20 iterations of L-BFGS and writes a step. The table of memory goes below the mark "MARK memory".
Needs: cmake --preset release -DREPOSE_BENCHMARKS=ON
"""

import tempfile

from measure import run
from page import option_parser, print_table

STAGES = ("build", "write", "read", "distribute", "objective", "search", "result")
TIME = ("| points | springs | " + ", µs/point | ".join(STAGES) + ", µs/point | evaluation, ns/spring |\n"
        + "|--:" * (3 + len(STAGES)) + "|")
MEMORY = ("| points | " + ", B/spring | ".join(STAGES) + ", B/spring | most on rank 0, B/spring |\n"
          + "|--:" * (2 + len(STAGES)) + "|")


def measure(program, size, ranks):
    """Numbers of each line that the program prints for one size, by its first word."""
    with tempfile.TemporaryDirectory() as folder:
        text = run([program, size, "model"], folder, ranks, ends=[0]).text
    return {line.split()[0]: [float(number) for number in line.split()[1:]]
            for line in text.splitlines()}


def row_of_time(found):
    points, springs = found["counts"]
    stages = " | ".join(f"{1e6 * found[stage][0] / points:.2f}" for stage in STAGES)
    evaluation = 1e9 * found["evaluation"][0] / springs
    return f"| {points:.0f} | {springs:.0f} | {stages} | {evaluation:.1f} |"


def row_of_memory(found):
    points, springs = found["counts"]
    stages = " | ".join(f"{found[stage][1] / springs:.0f}" for stage in STAGES)
    first = max(found[stage][2] for stage in STAGES) / springs
    return f"| {points:.0f} | {stages} | {first:.0f} |"


def main():
    chosen = option_parser(__doc__, sizes="477,2500,25000,250000,750000", ranks=1,
                           mark="large").parse_args()
    program = chosen.bin / "benchmark_large"
    found = [measure(program, size, chosen.ranks) for size in chosen.sizes.split(",")]
    print_table(TIME, map(row_of_time, found), chosen.output, chosen.mark)
    print_table(MEMORY, map(row_of_memory, found), chosen.output, f"{chosen.mark} memory")


if __name__ == "__main__":
    main()
