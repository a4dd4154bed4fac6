"""Columns of numbers in a table of a program (CSV)."""

import numpy as np

from sheet.script import Unusable, reading


def read_columns(file, what, names):
    """The named columns [n ≥ 1] of a table with a header; refuses numbers that are not finite."""
    with reading(file, what), open(file, encoding="utf-8") as text:
        if not any(line.strip() for line in list(text)[1:]):
            raise Unusable(f"{file}: has no rows, and is not {what}; write it again")
        table = np.atleast_1d(np.genfromtxt(file, delimiter=",", names=True))
        columns = {name: table[name] for name in names}
        if wrong := [name for name, values in columns.items() if not np.isfinite(values).all()]:
            raise ValueError(f"column {wrong[0]} holds values that are no finite numbers")
        return columns
