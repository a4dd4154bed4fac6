#!/usr/bin/env python3
"""Measures a whole solve with each linear solver: a table.

    tests/benchmark/linear_solver.py [-bin build/bin] [-sizes 3000,12500] [-solvers NAME;…]
                                     [-ranks 1] [-seconds 600]
                                     [-output docs/measurements/linear_solver.md]

Synthetic heads as in growth.py, so that each solver does the
same work; each solve may take -seconds. Counts are PETSc's: preconditioners made, applications of them, seconds in both.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

from growth import OPTIONS, SCENE
from measure import events, run, synthetic
from page import option_parser, print_table

HEAD = ("| skin vertices | ranks | linear solver | load steps | Hessians | made | applied | "
        "make, ms | apply, ms | all, CPU s | memory, MiB |\n" + "|--:" * 2 + "|---"
        + "|--:" * 8 + "|")
ALWAYS_NEW = ["-pc_renewal_price", "-1"]
FACTORS = ["-pc_type", "cholesky", "-pc_factor_mat_solver_type", "mumps"]
SOLVERS = {
    "default": [],
    "columns, each Hessian": ALWAYS_NEW,
    "factors": [*FACTORS, "-pc_renewal_price", "20"],
    "factors, each Hessian": [*FACTORS, *ALWAYS_NEW],
    "factors, low rank": [*FACTORS, "-mat_mumps_icntl_35", "1", "-mat_mumps_cntl_7", "1e-4"],
    "gamg": ["-pc_type", "gamg", "-mg_levels_ksp_type", "chebyshev", "-mg_levels_pc_type", "jacobi"],
    "L-BFGS from the stiffness": OPTIONS["stiffness"],
    "the same, factors": [*OPTIONS["stiffness"], *FACTORS],
}


def measure(folder, name, chosen):
    """One solve by one linear solver: a row of the table."""
    solved = run([chosen.bin / "repose-solve", "scene.yaml", "-output", "result", "-log_view", ":log",
                  *SOLVERS[name], "-time_limit", chosen.seconds], folder,
                 chosen.ranks, ends=None)
    if solved.status == 1:
        return f"| {name} | – | – | – | – | – | – | {solved.error.strip().splitlines()[-1]} | |"
    counted = events(folder / "log")
    (made, making), (applied, applying) = counted["PCRenew"], counted["PCApply"]
    end = "" if solved.status == 0 else " (not done)"
    return (f"| {name} | {solved.message['load steps'].split()[0]}{end} | {solved.evaluations[1]} | "
            f"{made} | {applied} | {1e3 * making / made:.0f} | {1e3 * applying / applied:.1f} | "
            f"{solved.seconds:.1f} | {solved.memory:.0f} |")


def rows_of(size, chosen):
    with synthetic(chosen.bin, size, SCENE) as folder:
        for solver in chosen.solvers.split(";"):
            yield f"| {size} | {chosen.ranks} {measure(folder, solver, chosen)}"


def main():
    chosen = option_parser(__doc__, sizes="3000,12500", solvers=";".join(SOLVERS), ranks=1,
                           seconds=600.0).parse_args()
    print_table(HEAD, (row for size in chosen.sizes.split(",") for row in rows_of(size, chosen)),
                chosen.output)


main()
