#!/usr/bin/env python3
"""The histogram of repose-compare, drawn without a screen.

    drivers/plot_compare.py NAME

Reads NAME.csv and writes NAME.png beside it.
Needs: apt-get install --no-install-recommends python3-matplotlib
"""

from sheet.script import refuse_missing, run, words
from sheet.whole_file import Target, write_figure

try:
    import matplotlib

    from sheet.columns import read_columns
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-matplotlib")

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def read(file):
    """Lower and upper end of each bin, mm, and its share of the area; what lies beyond the ends is
    in the outermost bins."""
    return read_columns(file, "a histogram of repose-compare", ("low_mm", "high_mm", "share_of_area")).values()


def draw(low, high, share, target):
    figure, axes = plt.subplots(figsize=(5.5, 3.2))
    reach = high[-1]
    colors = plt.get_cmap("coolwarm")((low + high) / (4 * reach) + 0.5)
    axes.bar(low, 100 * share, high - low, align="edge", color=colors, edgecolor="0.4", lw=0.2)
    axes.axvline(0, color="0.3", lw=0.7)
    axes.set(xlabel="signed distance, mm (beyond the ends: in the outermost bars)",
             ylabel="share of the area, %", xlim=(low[0], reach))
    write_figure(figure, target)


def main():
    name = words(__doc__, 1, 1)[0].removesuffix(".csv")
    draw(*read(name + ".csv"), Target(name + ".png", ".png", [name + ".csv"]))


run(main)
