#!/usr/bin/env python3
"""Measures wall times of a whole solve by ranks: a table, for a machine that does nothing else.

    tests/benchmark/ranks.py [-bin build/bin] [-sizes 12500] [-ranks 1,2] [-accuracy 0.01]
                             [-output docs/measurements/growth.md]

The synthetic heads and the move of growth.py. The preconditioner depends on how a model is shared
out, and where tissue buckles so do the steps that are taken; the last columns but two are therefore
the time of an application of the preconditioner and of an action of the Hessian.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import numpy as np

from growth import SCENE
from measure import events, run, synthetic
from page import option_parser, print_table
from tissue import last

HEAD = ("| skin vertices | points | ranks | evaluations | Hessians | applied | before the search, s | "
        "search, s | times faster | apply, ms | times faster | action, ms | times faster | memory, MiB | "
        "from the first, mm |\n" + "|--:" * 15 + "|")


def rows_of(size, chosen):
    with synthetic(chosen.bin, size, SCENE) as folder:
        first = None
        for ranks in map(int, chosen.ranks.split(",")):
            solved = run([chosen.bin / "repose-solve", "scene.yaml", "-accuracy", chosen.accuracy,
                          "-output", "result", "-log_view", ":log"], folder, ranks)
            logged, stages = events(folder / "log"), solved.stages
            times = [stages["solve"][0]] + [1e3 * logged[name][1] / logged[name][0]
                                            for name in ("PCApply", "MatMult")]
            position = last(folder / "result.h5")["point/position"]
            first = first or (times, position)
            before = sum(seconds for stage, (seconds, _) in stages.items()
                         if stage in ("build", "coarser", "distribute"))
            compared = " | ".join(f"{time:.3g} | {alone / time:.2f}"
                                  for alone, time in zip(first[0], times))
            evaluations, hessians = solved.evaluations
            yield (f"| {size} | {len(position)} | {ranks} | {evaluations} | {hessians} | "
                   f"{logged['PCApply'][0]} | {before:.3g} | {compared} | {solved.memory:.0f} | "
                   f"{np.linalg.norm(position - first[1], axis=1).max():.1g} |")


def main():
    chosen = option_parser(__doc__, sizes="12500", ranks="1,2", accuracy=0.01).parse_args()
    print_table(HEAD, (row for size in chosen.sizes.split(",") for row in rows_of(size, chosen)),
                chosen.output, "ranks")


if __name__ == "__main__":
    main()
