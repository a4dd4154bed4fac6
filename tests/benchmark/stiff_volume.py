#!/usr/bin/env python3
"""Does a κ that grows while the bones stay lead where the bones lead that move in many steps? Small
solves with stiff volume terms; writes the table of a page.

    tests/benchmark/stiff_volume.py [-bin build/bin] [-first 0] [-seeds 14]
                                    [-output docs/measurements/stiff_volume.md]

Problems are the heads of load_path.py, with the penalty at multiples of its usual κ and the paper's
volume term.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import pathlib
import statistics
import tempfile

import estimate
from load_path import SHIPPED, solve
from page import PROJECT, option_parser, print_table
from tissue import apart

ACCURACY, REFERENCE = 0.01, 1e-4  # mm
MANY = 24
TIMES = [3, 10, 100]  # the usual κ
LAMBDAS = [0.5, 0.1]


def volume_terms(usual):
    """Name and options of each stiff volume term of a head with this usual κ."""
    for times in TIMES:
        yield f"penalty, {times} κ", ["penalty", "-bulk_modulus", times * usual]
    for weight in LAMBDAS:
        yield f"paper, λ = {weight}", ["paper", "-lambda", weight]


def compare(tools, folder, scene, options):
    """Whether many steps come to rest, and of automatic and of four equal ones (evaluations, CPU s,
    distance from the end of many steps in mm, whether softer terms led), None for one without rest."""
    known = solve(tools, folder, scene, *options, "-load_steps", MANY, "-accuracy", REFERENCE)
    ways = []
    for steps in [], ["-load_steps", 4]:
        found = solve(tools, folder, scene, *options, "-accuracy", ACCURACY, *steps) if known else None
        ways.append(found and (found[0].evaluations[0], found[0].seconds, apart(found[1], known[1]),
                               "softer volume terms" in found[0].said))
    return known is not None, ways


def row(name, races):
    known = [(name, *ways) for name, there, ways in races if there]
    both = [(auto, four) for _, auto, four in known if auto and four]
    elsewhere = [f"{scene}: {auto[2]:.2g}" for scene, auto, _ in known
                 if auto and auto[2] > 2 * ACCURACY]
    four_elsewhere = sum(four is not None and four[2] > 2 * ACCURACY for *_, four in known)
    ratio = statistics.median(four[1] / auto[1] for auto, four in both)
    total = sum(four[1] for _, four in both) / sum(auto[1] for auto, _ in both)
    evaluations = [statistics.median(way[k][0] for way in both) for k in (0, 1)]
    led = sum(auto is not None and auto[3] for _, auto, _ in known)
    return (f"| {name} | {len(known)} | {led} | {sum(auto is None for _, auto, _ in known)} "
            f"| {'; '.join(elsewhere) or '–'} | {evaluations[0]:.0f} "
            f"| {sum(four is None for *_, four in known)} | {four_elsewhere} "
            f"| {evaluations[1]:.0f} | {ratio:.1f} | {total:.1f} |")


def main():
    chosen = option_parser(__doc__, first=0, seeds=14).parse_args()
    races = {}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scenes = [(name, PROJECT / f"meshes/{name}.yaml") for name in SHIPPED]
        scenes += [(f"seed {seed}", estimate.random_scene(seed, folder, chosen.bin / "repose-phantom"))
                   for seed in range(chosen.first, chosen.first + chosen.seeds)]
        for scene_name, scene in scenes:
            usual = solve(chosen.bin, folder, scene, "penalty", "-accuracy", 1)[1]["bulk_modulus"]
            for term, options in volume_terms(usual):
                there, ways = compare(chosen.bin, folder, scene, options)
                races.setdefault(term, []).append((scene_name, there, ways))
    head = (f"| volume term | heads that rest after {MANY} steps | of these led by softer terms "
            "| automatic: no rest | elsewhere, mm | evaluations, median | four steps: no rest | elsewhere | evaluations, median "
            "| CPU of four steps, median | of all |\n|---|--:|--:|--:|---|--:|--:|--:|--:|--:|--:|")
    print_table(head, [row(term, runs) for term, runs in races.items()], chosen.output)


if __name__ == "__main__":
    main()
