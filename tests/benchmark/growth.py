#!/usr/bin/env python3
"""How the work of a whole solve grows with the mesh: a table.

    tests/benchmark/growth.py [-bin build/bin] [-sizes 500,2500,12500] [-methods ntr,lmvm,stiffness]
                              [-layers 4,…] [-turgor 0] [-nested auto] [-ranks 1]
                              [-output docs/growth.md] [-mark measured]

Synthetic heads of the given numbers of skin vertices, each with its number of layers, springs by
moduli with s_ref = r_0, penalty volume term, the jaw 6 mm forward; solved to 0.01 mm by each method: TAO's
types, and stiffness for L-BFGS from the stiffness. Says how far each ends from the first method's
rest position. Preconditioners made and applied are PETSc's counts, those on coarser models included.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import argparse
import pathlib
import subprocess
import tempfile

import h5py
import numpy as np

from page import PROJECT, children, events, print_table

SCENE = """skin: head_skin.ply
bones:
  - {name: skull, file: head_skull.ply}
  - {name: mandible, file: head_mandible.ply}
tissue:
  layers: 4
  turgor: 0
  springs:
    default: {modulus: 0.05, law: quartic, reference: initial}
moves:
  - {bone: mandible, translate: [0, -6, 0]}
solve:
  volume: {form: penalty}
  accuracy: 0.01
"""
HEAD = ("| skin vertices | layers | unknowns | method | load steps | iterations | evaluations | Hessians | "
        "made | applied | CPU, µs/unknown | memory, B/unknown | from the first, mm |\n" + "|--:" * 3
        + "|---" + "|--:" * 9 + "|")
OPTIONS = {"stiffness": ["-tao_type", "lmvm", "-tao_lmvm_initial", "stiffness"]}


def measure(command, folder, method):
    """One solve: its attributes summed over steps, CPU s, and the positions at rest."""
    before = children().ru_utime
    options = OPTIONS.get(method, ["-tao_type", method])
    done = subprocess.run([*command, "scene.yaml", *options, "-output", method, "-log_view", ":log"],
                          cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    seconds = children().ru_utime - before
    if done.returncode == 1:
        raise SystemExit(done.stderr)
    peak = max(float(line.split()[-4]) for line in done.stdout.splitlines() if "MiB so far" in line)
    logged = events(folder / "log")
    with h5py.File(folder / f"{method}.h5") as h5:
        steps = [h5["step"][k] for k in sorted(h5["step"])]
        total = {key: sum(int(step.attrs[key]) for step in steps)
                 for key in ("iterations", "evaluations")}
        unknowns = 3 * int((h5["model/point/set"][()] == 0).sum())
        work = next(line for line in done.stdout.splitlines() if "of the Hessian" in line)
        return (total | {"steps": len(steps) - 1, "hessians": int(work.split("gradient,")[1].split()[0]),
                         "made": logged["PCRenew"][0], "applied": logged["PCApply"][0],
                         "seconds": seconds, "memory": peak * 2**20 / unknowns, "unknowns": unknowns,
                         "converged": done.returncode == 0}, steps[-1]["point/position"][()])


def rows_of(size, layers, chosen):
    tools, ranks = chosen.bin.resolve(), chosen.ranks
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([tools / "repose-phantom", "-skin_vertices", size, "-bone_edge", "2",
                        "-output", "head"], cwd=folder, check=True, capture_output=True)
        (folder / "scene.yaml").write_text(SCENE.replace("layers: 4", f"layers: {layers}")
                                           .replace("turgor: 0", f"turgor: {chosen.turgor}"))
        first = None
        command = [*(["mpirun", "-n", str(ranks)] if ranks > 1 else []), tools / "repose-solve",
                   "-nested", chosen.nested]
        for method in chosen.methods.split(","):
            found, position = measure(command, folder, method)
            first = position if first is None else first
            apart = np.linalg.norm(position - first, axis=1).max()
            said = f"{apart:.1g}" if found["converged"] else "NOT CONVERGED"
            yield (f"| {size} | {layers} | {found['unknowns']} | {method} | {found['steps']} | "
                   f"{found['iterations']} | {found['evaluations']} | {found['hessians']} | "
                   f"{found['made']} | {found['applied']} | "
                   f"{1e6 * found['seconds'] / found['unknowns']:.0f} | {found['memory']:.0f} | {said} |")


def arguments():
    parser = argparse.ArgumentParser(prog="growth.py", description=__doc__, add_help=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("-bin", type=pathlib.Path, default=PROJECT / "build/bin")
    parser.add_argument("-sizes", default="500,2500,12500")
    parser.add_argument("-methods", default="ntr,lmvm,stiffness")
    parser.add_argument("-layers", default="4", help="one number, or one for each size")
    parser.add_argument("-turgor", type=float, default=0)
    parser.add_argument("-nested", default="auto")
    parser.add_argument("-ranks", type=int, default=1)
    parser.add_argument("-output", type=pathlib.Path)
    parser.add_argument("-mark", default="measured")
    return parser.parse_args()


def main():
    chosen = arguments()
    sizes = chosen.sizes.split(",")
    layers = chosen.layers.split(",")
    layers = layers * (len(sizes) if len(layers) == 1 else 1)
    print_table(HEAD, (row for size, count in zip(sizes, layers, strict=True)
                       for row in rows_of(size, count, chosen)), chosen.output, chosen.mark)


if __name__ == "__main__":
    main()
