#!/usr/bin/env python3
"""Do long load steps lead where many short ones do? Many small solves against the end of a path in
many steps; writes the table of a page.

    tests/benchmark/load_path.py [-bin build/bin] [-seeds 30] [-output docs/measurements/load_path.md]

Problems are the shipped heads of the paper's size and as many synthetic heads as there are seeds,
with random size, layers, springs, moves and loads (estimate.py), each with three volume terms.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import dataclasses
import pathlib
import statistics
import subprocess
import tempfile

import estimate
import measure
from page import PROJECT, option_parser, print_table
from tissue import apart, last

ACCURACY, REFERENCE = 0.01, 1e-5  # mm
MANY = 24
SHIPPED = ["paper_jaw_advance", "paper_jaw_opening"]
WAYS = {"automatic": [], "four steps": ["-load_steps", 4], "one step": ["-load_steps", 1]}
PATIENCE = 60  # s


@dataclasses.dataclass
class Way:
    """One solve: what it took, and how far its end is from that of many steps, mm."""
    problem: str
    evaluations: int
    seconds: float
    away: float


def solve(tools, folder, scene, volume, *options):
    """Runs a scene; returns the run and its last step, None if it was not at rest in time."""
    command = [tools / "repose-solve", scene, "-volume", volume, "-output", "run",
               *options]
    try:
        done = measure.run(command, folder, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return None
    return (done, last(folder / "run.h5")) if done.status == 0 else None


def problems(chosen, folder):
    scenes = [(name, PROJECT / f"meshes/{name}.yaml") for name in SHIPPED]
    scenes += [(f"seed {seed}", estimate.random_scene(seed, folder, chosen.bin / "repose-phantom"))
               for seed in range(chosen.seeds)]
    return [(f"{name}, {volume}", scene, volume)
            for name, scene in scenes for volume in estimate.VOLUMES]


def compare(chosen, folder):
    """Solves of each way, nothing for one that did not come to rest; how many problems had no end of
    many steps."""
    ways, unknown = {name: [] for name in WAYS}, 0
    for name, scene, volume in problems(chosen, folder):
        known = solve(chosen.bin, folder, scene, volume, "-load_steps", MANY, "-accuracy", REFERENCE)
        unknown += known is None
        for way, options in WAYS.items() if known else ():
            found = solve(chosen.bin, folder, scene, volume, "-accuracy", ACCURACY, *options)
            ways[way].append(Way(name, found[0].evaluations[0], found[0].seconds,
                                 apart(found[1], known[1])) if found else None)
    return ways, unknown


def row(name, runs, first):
    there = [run for run in runs if run and run.away <= 2 * ACCURACY]
    both = [(run, other) for run, other in zip(runs, first) if run and other]
    times = statistics.median(run.seconds / other.seconds for run, other in both)
    total = sum(run.seconds for run, _ in both) / sum(other.seconds for _, other in both)
    usual = statistics.median(run.evaluations for run, _ in both)
    elsewhere = [f"{run.problem}: {run.away:.2g}" for run in runs if run and run not in there]
    return (f"| {name} | {len(runs)} | {len(there)} | {'; '.join(elsewhere) or '–'} "
            f"| {sum(run is None for run in runs)} | {usual:.0f} | {times:.2f} | {total:.2f} |")


def main():
    parser = option_parser(__doc__, seeds=30)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        ways, unknown = compare(chosen, pathlib.Path(folder))
    head = (f"| load steps | runs | at the end of {MANY} steps | elsewhere, mm | no rest "
            "| evaluations, median | CPU, median | CPU, all |\n|---|--:|--:|---|--:|--:|--:|--:|")
    rows = [row(name, runs, ways["automatic"]) for name, runs in ways.items()]
    print_table(head, rows, chosen.output)
    if unknown:
        print(f"{unknown} problems did not come to rest in {MANY} steps and are left out")


if __name__ == "__main__":
    main()
