#!/usr/bin/env python3
"""The histogram of repose-compare, drawn without a screen.

    drivers/plot_compare.py NAME

Reads NAME.csv and writes NAME.png beside it.
Needs: apt-get install --no-install-recommends python3-matplotlib
"""

import os
import sys

try:
    import matplotlib
    import numpy as np
except ImportError as missing:
    print(f"plot_compare.py: {missing.name} is missing: "
          "apt-get install --no-install-recommends python3-matplotlib", file=sys.stderr)
    sys.exit(1)

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def read(file):
    """Lower and upper end of each bin, mm, and its share of the area; what lies beyond the ends is
    in the outermost bins."""
    table = np.genfromtxt(file, delimiter=",", names=True)
    return table["low_mm"], table["high_mm"], table["share_of_area"]


def draw(low, high, share, target):
    figure, axes = plt.subplots(figsize=(5.5, 3.2))
    reach = high[-1]
    colors = plt.get_cmap("coolwarm")((low + high) / (4 * reach) + 0.5)
    axes.bar(low, 100 * share, high - low, align="edge", color=colors, edgecolor="0.4", lw=0.2)
    axes.axvline(0, color="0.3", lw=0.7)
    axes.set(xlabel="signed distance, mm (beyond the ends: in the outermost bars)",
             ylabel="share of the area, %", xlim=(low[0], reach))
    figure.savefig(target + ".part", format="png", dpi=110, bbox_inches="tight")
    os.replace(target + ".part", target)
    print(target)


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__.strip(), file=sys.stdout if "-help" in sys.argv else sys.stderr)
        return 0 if "-help" in sys.argv else 1
    name = sys.argv[1].removesuffix(".csv")
    try:
        low, high, share = read(name + ".csv")
    except (OSError, ValueError, IndexError) as problem:
        print(f"plot_compare.py: {name}.csv: not a histogram of repose-compare: {problem}",
              file=sys.stderr)
        return 1
    draw(low, high, share, name + ".png")
    return 0


sys.exit(main())
