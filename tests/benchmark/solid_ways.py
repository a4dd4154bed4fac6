#!/usr/bin/env python3
"""Simpler ways to a solid's rest position, side by side with the default: a table.

    tests/benchmark/solid_ways.py [-bin build/bin] [-scenes SCENE,SCENE] [-poissons 0.45,0.49]
                                  [-ways NAME;NAME] [-seconds 120]
                                  [-output docs/measurements/solid.md]

Every way solves the model of a scene with `preset: face` to 0.01 mm, as the program measures it,
without contact, so that all minimize the same smooth energy. A quasi-Newton method without memory
that begins with the stiffness is Newton's method with a frozen Hessian; with a memory of one pair it
is preconditioned nonlinear conjugate gradients (Shanno 1978). Its stiffness is one cycle of the
columns' multigrid, or MUMPS' factors. Preconditioners made and applied, and products with the
Hessian, are PETSc's counts, error estimates included; CPU is that of the whole program, which reads a
model, and of it the ratio to the first way's. Needs: apt-get install --no-install-recommends
python3-h5py python3-numpy
"""

import pathlib
import tempfile

from measure import events, run
from page import PROJECT, option_parser, print_table
from tissue import apart, last

MEMORY = "-tao_lmvm_mat_lmvm_hist_size"
FACTORS = ["-pc_type", "cholesky", "-pc_factor_mat_solver_type", "mumps"]
ONCE = ["-tao_lmvm_renewal_price", "1e9", "-pc_renewal_price", "1e9"]
WAYS = {
    "**L-BFGS begun with a multigrid cycle** (default)": [],
    "the same, the cycle never renewed": ONCE,
    "the same, begun with one factor": [*FACTORS, *ONCE],
    "Newton, Hessian frozen, multigrid cycle": [MEMORY, "0", *ONCE],
    "Newton, Hessian frozen, one factor": [MEMORY, "0", *FACTORS, *ONCE],
    "nonlinear CG, multigrid cycle": [MEMORY, "1", *ONCE],
    "nonlinear CG, one factor": [MEMORY, "1", *FACTORS, *ONCE],
    "Newton by CG, trust region, multigrid": ["-tao_type", "ntr"],
    "Newton by CG, trust region, point blocks": ["-tao_type", "ntr", "-pc_type", "pbjacobi"],
    "Newton, a factor each": ["-tao_type", "ntr", *FACTORS, "-pc_renewal_price", "-1"],
    "L-BFGS alone": ["-tao_lmvm_initial", "diagonal"],
    "nonlinear CG alone": ["-tao_type", "cg"],
}
HEAD = ("| unknowns | ν | way | evaluations | Hessians | products | made | applied | CPU, s | "
        "of the first | from the first, mm |\n|--:|--:|---" + "|--:" * 8 + "|")


def without_contact(scene, poisson):
    return (scene.read_text().replace("preset: face", f"preset: face, poisson: {poisson}")
            + "\ncontact: {bones: off, cuts: off}\n")


def rows_of(scene, poisson, chosen):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file in (*scene.parent.glob("*.ply"), *scene.parent.glob("*_landmarks.json")):
            (folder / file.name).symlink_to(file.resolve())
        (folder / "scene.yaml").write_text(without_contact(scene, poisson))
        solve = [chosen.bin / "repose-solve"]
        common = ["-accuracy", 0.01, "-time_limit", chosen.seconds]
        made = run([*solve, "scene.yaml", *common, "-output", "model"], folder, ends=[0])
        unknowns = int(made.message["unknowns"].split()[0])
        first = None
        for way in chosen.ways.split(";"):
            solved = run([*solve, "model.h5", *common, "-output", "out", "-log_view", ":log",
                          *WAYS[way]], folder)
            here, counted = last(folder / "out.h5"), events(folder / "log")
            first = (solved.seconds, here) if first is None else first
            message = f"{apart(first[1], here):.1g}" if solved.status == 0 else "not converged"
            products, made, applied = (counted.get(event, (0,))[0]
                                       for event in ("RpHessianAction", "PCRenew", "PCApply"))
            yield (f"| {unknowns} | {poisson} | {way} | {solved.evaluations[0]} | "
                   f"{solved.evaluations[1]} | {products} | {made} | {applied} | "
                   f"{solved.seconds:.2f} | {solved.seconds / first[0]:.1f}× | {message} |")


def main():
    chosen = option_parser(__doc__, scenes=str(PROJECT / "meshes/head_solid.yaml"), seconds=120.0,
                           poissons="0.45,0.49", ways=";".join(WAYS)).parse_args()
    rows = (row for scene in chosen.scenes.split(",") for poisson in chosen.poissons.split(",")
            for row in rows_of(pathlib.Path(scene), poisson, chosen))
    print_table(HEAD, rows, chosen.output, "ways")


if __name__ == "__main__":
    main()
