"""Rows and columns of a table of a program (CSV)."""

import csv
import math

import numpy as np

from sheet.script import Unusable, is_number, reading


def read_rows(file, what, names):
    """The rows [n ≥ 1] of a table with a header, {title: text}; refuses one without the named columns and
    rows that do not have a value of each column."""
    with reading(file, what), open(file, newline="", encoding="utf-8-sig") as text:
        table = csv.DictReader(text)
        try:
            rows = list(table)
        except csv.Error as reason:
            raise ValueError(f"line {table.line_num + 1}: {reason}") from None
        if not rows:
            raise Unusable(f"{file}: has no rows, and is not {what}; write it again")
        if missing := [name for name in names if name not in table.fieldnames]:
            raise ValueError(f"it has no column {missing[0]}")
        for place, row in enumerate(rows, 1):
            if None in row or None in row.values():
                raise ValueError(f"row {place} does not have {len(table.fieldnames)} values")
        return rows


def numbers_in(rows, name, low=-math.inf, high=math.inf, kind=float, unknown=()):
    """The numbers in a column of a table; ValueError where one is not finite or out of range, and not one
    of the texts `unknown`."""
    limits = f" from {low:g} to {high:g}" if high < math.inf else f" from {low:g}" if low > -math.inf else ""
    for place, row in enumerate(rows, 1):
        text = row[name]
        if text not in unknown and not (is_number(text) and low <= float(text) <= high
                                        and kind(float(text)) == float(text)):
            what = "whole" if kind is int else "finite"
            raise ValueError(f"row {place} of column {name} holds '{text}', no {what} number{limits}")
    return np.array([float(row[name]) for row in rows]).astype(kind)


def read_columns(file, what, names):
    """The named columns [n ≥ 1] of a table; refuses numbers that are not finite."""
    rows = read_rows(file, what, names)
    with reading(file, what):
        return {name: numbers_in(rows, name) for name in names}
