#!/usr/bin/env python3
"""Measures options of the solver on two shipped scenes: the table of the solver cookbook.

    tests/benchmark/cookbook.py [-bin build/bin] [-recipes "-load_steps 4;-tao_type ntr;…"]
                                [-scenes head_solid,head_springs_genioplasty]
                                [-output docs/guide/solver.md]

The first recipe, no options, is what the CPU time of the others is compared with. Counts are those
of repose-solve and of PETSc's log on one rank.
"""

import pathlib
import tempfile

from measure import run
from page import PROJECT, option_parser, print_table

RECIPES = ["", "-accuracy 0.001", "-accuracy 0.000001", "-load_steps 4", "-profile preview",
           "-tao_type lmvm", "-tao_type ntr", "-tao_type bnls", "-pc_renewal_price -1",
           "-pc_type cholesky -pc_factor_mat_solver_type mumps", "-verify_path", "-stability"]


def counts(log):
    """Calls of PETSc's events over all stages."""
    found = {}
    for line in log.read_text().splitlines():
        words = line.split(",")
        if len(words) > 4 and words[1].startswith(("Rp", "PC")):
            found[words[1]] = found.get(words[1], 0) + int(words[3])
    return found


def measure(scene, recipe, folder, tools):
    """Evaluations, products with the Hessian, applications of the preconditioner, and CPU s."""
    log = folder / "log.csv"
    done = run([tools / "repose-solve", PROJECT / f"meshes/{scene}.yaml", *recipe.split(),
                "-log_view", f":{log}:ascii_csv", "-output", folder / "result"])
    events = counts(log)
    return (events["RpEvaluate"], events["RpHessianAction"], events.get("PCApply", 0),
            done.seconds, done.status)


def rows_of(chosen):
    first = {}
    with tempfile.TemporaryDirectory() as name:
        for recipe in chosen.recipes.split(";"):
            row = f"| {f'`{recipe}`' if recipe else 'none'} |"
            for scene in chosen.scenes.split(","):
                *numbers, seconds, status = measure(scene, recipe, pathlib.Path(name), chosen.bin)
                first.setdefault(scene, seconds)
                row += " {} | {} | {} |".format(*numbers)
                row += f" {seconds / first[scene]:.2g} |" if status == 0 else " not converged |"
            yield row


def main():
    chosen = option_parser(__doc__, recipes=";".join(RECIPES),
                           scenes="head_solid,head_springs_genioplasty").parse_args()
    scenes = chosen.scenes.split(",")
    head = "| options |" + "".join(f" {scene}: evaluations | Hessian products | preconditioner | CPU |"
                                   for scene in scenes) + "\n|---|" + "--:|" * 4 * len(scenes)
    print_table(head, rows_of(chosen), chosen.output)


main()
