#!/usr/bin/env python3
"""What each way to solve the linear systems costs a whole solve: a table.

    tests/benchmark/linear_solver.py [-bin build/bin] [-sizes 3000,12500] [-solvers NAME,…]
                                     [-ranks 1] [-nested off] [-seconds 600]
                                     [-output docs/linear_solver.md]

Synthetic heads as in growth.py, by default without nested iteration, so that each solver does the
same work. Counts are PETSc's: preconditioners made, applications of them, seconds in both.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import argparse
import pathlib
import subprocess
import tempfile

from growth import OPTIONS, SCENE
from page import PROJECT, children, events, print_table

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


def measure(tools, folder, name, chosen):
    """One solve by one linear solver: a row of the table."""
    command = [tools / "repose-solve", "scene.yaml", "-output", "result", "-log_view", ":log",
               "-nested", chosen.nested, *SOLVERS[name]]
    if chosen.ranks > 1:
        command = ["mpirun", "-n", str(chosen.ranks), *command]
    before = children().ru_utime
    done = subprocess.run([*map(str, command), "-time_limit", str(chosen.seconds)], cwd=folder,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True)
    seconds = children().ru_utime - before
    if done.returncode == 1:
        return f"| {name} | – | – | – | – | – | – | {done.stderr.strip().splitlines()[-1]} | |"
    said = {line[:24].strip(): line[25:] for line in done.stdout.splitlines()}
    hessians = said["evaluations"].split("gradient,")[1].split()[0]
    peak = max(float(line.split()[-4]) for line in done.stdout.splitlines() if "MiB so far" in line)
    counted = events(folder / "log")
    (made, making), (applied, applying) = counted["PCRenew"], counted["PCApply"]
    end = "" if done.returncode == 0 else " (not done)"
    return (f"| {name} | {said['load steps'].split()[0]}{end} | {hessians} | {made} | {applied} | "
            f"{1e3 * making / made:.0f} | {1e3 * applying / applied:.1f} | {seconds:.1f} | {peak:.0f} |")


def arguments():
    parser = argparse.ArgumentParser(prog="linear_solver.py", description=__doc__, add_help=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("-bin", type=pathlib.Path, default=PROJECT / "build/bin")
    parser.add_argument("-sizes", default="3000,12500")
    parser.add_argument("-solvers", default=";".join(SOLVERS), help="names, with ; between them")
    parser.add_argument("-ranks", type=int, default=1)
    parser.add_argument("-nested", default="off")
    parser.add_argument("-seconds", type=float, default=600, help="limit of each solve")
    parser.add_argument("-output", type=pathlib.Path)
    return parser.parse_args()


def rows_of(size, chosen):
    tools = chosen.bin.resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([tools / "repose-phantom", "-skin_vertices", size, "-bone_edge", "2",
                        "-output", "head"], cwd=folder, check=True, capture_output=True)
        (folder / "scene.yaml").write_text(SCENE)
        for solver in chosen.solvers.split(";"):
            yield f"| {size} | {chosen.ranks} {measure(tools, folder, solver, chosen)}"


def main():
    chosen = arguments()
    print_table(HEAD, (row for size in chosen.sizes.split(",") for row in rows_of(size, chosen)),
                chosen.output)


main()
