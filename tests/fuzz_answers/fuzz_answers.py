#!/usr/bin/env python3
"""Solves random small scenes with repose-solve and judges each result by an independent minimizer.

    tests/fuzz_answers/fuzz_answers.py -bin build-ci/bin -count 1000
    tests/fuzz_answers/fuzz_answers.py -bin build-ci/bin -only 17 -keep DIR

A result disagrees if the constrained minimum nearest to it is farther away than twice its own estimate
and 3e-4 mm, if its energies are not those of its positions, or if it is no minimum. The exit status is
1 if any disagrees, or if a fifth do not come to rest although bodies leave room. Scenes depend on
-seed and their number alone."""

import argparse
import collections
import contextlib
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

from energy import read_result
from minimize import Problem, active_set, from_the_start, place_bodies
from scenes import Writer, plan

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "program"))

from conftest import PROJECT, mpi_environment  # noqa: E402

ACCURACY = 1e-4  # mm, asked of the program
CLOSE = 3e-4  # mm, a rest position is the same
TIME_LIMIT = 400  # s, of a search
PATIENCE = 500 * float(os.environ.get("REPOSE_PATIENCE", 1))  # s, of a run
ENOUGH = 0.8  # of scenes must come to rest or leave no room: others are refused or not converged


def solve(folder, ranks, binaries, variables):
    command = [str(binaries / "repose-solve"), "scene.yaml", "-output", "out", "-allow_folded",
               "-accuracy", str(ACCURACY), "-time_limit", str(TIME_LIMIT)]
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), *command]
    process = subprocess.Popen(command, cwd=folder, env=variables, text=True,
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE)
    try:
        out, err = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        process.terminate()  # mpirun ends its ranks
        process.communicate()
        raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


class Verdict:
    """Outcome of a scene: how it ended, faults, and whether the start leads elsewhere."""

    def __init__(self, ended, faults=(), elsewhere="", distance=np.nan):
        self.ended, self.faults = ended, list(faults)
        self.elsewhere, self.distance = elsewhere, distance


def first_line(text):
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[0] if lines else "no word"


def judge(folder, result, from_start):
    if result.returncode not in (0, 2):
        fault = [] if result.returncode == 1 else [f"exit status {result.returncode}"]
        return Verdict("refused: " + first_line(result.stderr), fault)
    model, step = read_result(folder / "out.h5")
    if b"bodies that overlap" in step["reason"]:
        return judge_overlap(model, step)
    if not step["converged"] or step["load"] < 1:
        return Verdict(f"not converged at load {step['load']:.3g}: {step['reason'].decode()}")
    problem = Problem(model, step)
    place_bodies(problem, model, 1)
    verdict = Verdict("a rest position", wrong_numbers(problem, model, step))
    found, within = step["point/position"], max(2 * step["displacement_error"], CLOSE)
    if (error := problem.derivative_error(found)) > 1e-3:
        verdict.faults.append(f"the judge's derivatives miss differences by {error:.2g}")
    rest = active_set(problem, found)
    verdict.distance = apart(rest.x, found)
    if not rest.found:
        verdict.faults.append(f"no minimum: step {rest.step:.2g} mm, gaps {rest.depth:.2g} mm, "
                              f"least curvature {rest.least:.2g}")
    elif verdict.distance > within:
        verdict.faults.append(f"{verdict.distance:.3g} mm from a minimum, "
                              f"states {step['displacement_error']:.2g} mm")
    if from_start and not verdict.faults:
        verdict.elsewhere = from_the_initial_state(problem, model, rest, within)
    return verdict


def judge_overlap(model, step):
    """Bodies are said to leave no room: gaps must stay open at the nearest constrained minimum."""
    problem = Problem(model, step)
    place_bodies(problem, model, 1)
    verdict = Verdict("bodies overlap", wrong_numbers(problem, model, step))
    rest = active_set(problem, step["point/position"])
    if rest.found:
        verdict.faults.append(f"there is a minimum {apart(rest.x, step['point/position']):.3g} mm away")
    return verdict


def apart(x, y):
    return np.sqrt(((x - y) ** 2).sum(1)).max()


def wrong_numbers(problem, model, step):
    """Positions of known points, and energies that are not those of the positions."""
    x, faults = step["point/position"], []
    known = model["point/set"] > 0
    miss = np.abs(x - model["point/target"])[known].max(initial=0)
    if miss > 1e-9:
        faults.append(f"a known point is {miss:.2g} mm from its target")
    scale = problem.energy.parts(x + 1e-3)  # of what cancels
    for name, value, size in zip(("f_e", "potential", "penalty"), problem.energy.parts(x), scale):
        stated = float(step[name]) if name in step else 0.0
        if name == "penalty" and step["volume"] == b"paper":
            continue
        if abs(value - stated) > 1e-9 * (abs(value) + abs(size)) + 1e-12:
            faults.append(f"{name} {stated:.12g}, is {value:.12g}")
    return faults


def from_the_initial_state(problem, model, rest, within):
    """Where the judge's own way from the initial state leads; empty if it is the same place."""
    try:
        own = from_the_start(problem, model)
    except (np.linalg.LinAlgError, ValueError) as error:
        return f"lost: {error}"
    distance = apart(own.x, rest.x)
    if distance <= max(within, CLOSE):
        return ""
    if not own.found:
        return "lost"
    more = problem.energy.value(own.x) - problem.energy.value(rest.x)
    return f"{'higher' if more > 0 else 'lower'}: {distance:.2g} mm away, {more:+.2g} N mm"


def run_one(number, scene, options, variables):
    """Writes, solves and judges a scene."""
    with contextlib.ExitStack() as stack:
        folder = options.keep
        if folder is None:
            folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(parents=True, exist_ok=True)
        Writer(scene, [options.seed, number], folder).write()
        try:
            result = solve(folder, options.ranks or scene["ranks"], options.bin, variables)
        except subprocess.TimeoutExpired:
            return Verdict("hangs", [f"still running after {PATIENCE:g} s"])
        try:
            return judge(folder, result, number % options.every == 0)
        except (np.linalg.LinAlgError, ValueError) as error:
            return Verdict("not judged", [f"the judge fails: {error}"])


def parse():
    parser = argparse.ArgumentParser(description=__doc__, add_help=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("-bin", type=lambda name: pathlib.Path(name).resolve(),
                        default=PROJECT / "build/bin")
    parser.add_argument("-count", type=int, default=20)
    parser.add_argument("-first", type=int, default=0)
    parser.add_argument("-seed", type=int, default=1)
    parser.add_argument("-only", type=int)
    parser.add_argument("-keep", type=pathlib.Path)
    parser.add_argument("-minutes", type=float, default=np.inf, help="begin no scene after these")
    parser.add_argument("-ranks", type=int, help="for all scenes, in place of their own")
    parser.add_argument("-every", type=int, default=5,
                        help="search from the initial state too in every so many scenes")
    return parser.parse_args()


def main():
    options = parse()
    begin = options.first if options.only is None else options.only
    end = begin + (options.count if options.only is None else 1)
    scenes, every, left, needed = plan(options.seed, end)
    print(f"{every - left} of {every} pairs of features in {end} scenes"
          + (f", all in the first {needed}" if needed else ""), flush=True)
    variables, counts, clock = mpi_environment(), collections.Counter(), time.time()
    for number in range(begin, end):
        if time.time() - clock > 60 * options.minutes:
            end = number
            break
        verdict = run_one(number, scenes[number], options, variables)
        kind = verdict.ended.split(":")[0].split(" at load")[0]
        counts["disagrees" if verdict.faults else kind] += 1
        if verdict.elsewhere:
            counts["from the start: " + verdict.elsewhere.split(":")[0]] += 1
        if verdict.faults or verdict.elsewhere or kind != "a rest position" or options.only is not None:
            report = "; ".join(["DISAGREES"] * bool(verdict.faults) + [verdict.ended] + verdict.faults)
            report += f"; from the start {verdict.elsewhere}" * bool(verdict.elsewhere)
            levels = " ".join(f"{k}={v}" for k, v in scenes[number].items() if v != "-")
            print(f"{number}: {report}\n    {levels}", flush=True)
    for kind, count in counts.most_common():
        print(f"{count:5d}  {kind}")
    print(f"{end - begin} scenes in {time.time() - clock:.0f} s")
    enough = counts["a rest position"] + counts["bodies overlap"] >= ENOUGH * (end - begin)
    return 0 if enough and not counts["disagrees"] else 1


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
