#!/usr/bin/env python3
"""Measures the work of a whole solve as the mesh grows: a table.

    tests/benchmark/growth.py [-bin build/bin] [-sizes 500,2500,12500] [-methods ntr,lmvm,stiffness]
                              [-layers 4,…] [-turgor 0] [-ranks 1]
                              [-output docs/measurements/growth.md] [-mark measured]

Synthetic heads of the given numbers of skin vertices, each with its number of layers, springs by
moduli with s_ref = r_0, penalty volume term, the jaw 6 mm forward; solved to 0.01 mm by each method: TAO's
types, and stiffness for L-BFGS from the stiffness. Says how far each ends from the first method's
rest position. Preconditioners made and applied are PETSc's counts, those on coarser models included.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import h5py
import numpy as np

from measure import events, run, synthetic
from page import option_parser, print_table

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
  volume: {form: penalty, poisson: 0.4967}
  accuracy: 0.01
"""
HEAD = ("| skin vertices | layers | unknowns | method | load steps | iterations | evaluations | Hessians | "
        "made | applied | CPU, µs/unknown | memory, B/unknown | from the first, mm |\n" + "|--:" * 3
        + "|---" + "|--:" * 9 + "|")
OPTIONS = {"stiffness": ["-tao_type", "lmvm", "-tao_lmvm_initial", "stiffness"]}


def measure(command, folder, method, ranks):
    """One solve: its attributes summed over steps, what it took, and the positions at rest."""
    ways = OPTIONS.get(method, ["-tao_type", method])
    solved = run([*command, "scene.yaml", *ways, "-output", method, "-log_view", ":log"], folder,
                 ranks)
    logged = events(folder / "log")
    with h5py.File(folder / f"{method}.h5") as h5:
        steps = [h5["step"][k] for k in sorted(h5["step"])]
        total = {key: sum(int(step.attrs[key]) for step in steps)
                 for key in ("iterations", "evaluations")}
        unknowns = 3 * int((h5["model/point/set"][()] == 0).sum())
        return (total | {"steps": len(steps) - 1, "hessians": solved.evaluations[1],
                         "made": logged["PCRenew"][0], "applied": logged["PCApply"][0],
                         "seconds": solved.seconds, "memory": solved.memory * 2**20 / unknowns,
                         "unknowns": unknowns, "converged": solved.status == 0},
                steps[-1]["point/position"][()])


def rows_of(size, layers, chosen):
    scene = SCENE.replace("layers: 4", f"layers: {layers}").replace("turgor: 0",
                                                                    f"turgor: {chosen.turgor}")
    with synthetic(chosen.bin, size, scene) as folder:
        first = None
        command = [chosen.bin / "repose-solve"]
        for method in chosen.methods.split(","):
            found, position = measure(command, folder, method, chosen.ranks)
            first = position if first is None else first
            apart = np.linalg.norm(position - first, axis=1).max()
            message = f"{apart:.1g}" if found["converged"] else "NOT CONVERGED"
            yield (f"| {size} | {layers} | {found['unknowns']} | {method} | {found['steps']} | "
                   f"{found['iterations']} | {found['evaluations']} | {found['hessians']} | "
                   f"{found['made']} | {found['applied']} | "
                   f"{1e6 * found['seconds'] / found['unknowns']:.0f} | {found['memory']:.0f} | {message} |")


def main():
    chosen = option_parser(__doc__, sizes="500,2500,12500", methods="ntr,lmvm,stiffness",
                           layers="4", turgor=0.0, ranks=1,
                           mark="measured").parse_args()
    sizes = chosen.sizes.split(",")
    layers = chosen.layers.split(",")
    layers = layers * (len(sizes) if len(layers) == 1 else 1)
    print_table(HEAD, (row for size, count in zip(sizes, layers, strict=True)
                       for row in rows_of(size, count, chosen)), chosen.output, chosen.mark)


if __name__ == "__main__":
    main()
