"""drivers/sheet, what report.py, render.py and others share: surfaces made coarser."""

import sys

import numpy as np
import pytest

from conftest import PROJECT

sys.path.insert(0, str(PROJECT / "drivers"))
from sheet.meshes import coarser  # noqa: E402


def parted_sheet(n, wide):
    """A flat sheet of n × n vertices with a seam along the middle row, doubled but at its ends: states
    before and after, in which the half beyond the seam has moved by `wide`, and corners."""
    y, x = np.divmod(np.arange(n * n), n)
    row, middle = np.arange(n * n).reshape(n, n), n // 2
    seam = row[middle, 2:-2]
    before = np.stack([x, y, 0.0 * x], axis=1)
    before = np.concatenate([before, before[seam]])
    upper = row.copy()
    upper[middle, 2:-2] = np.arange(n * n, len(before))
    after = before.copy()
    after[upper[middle:, 2:-2].ravel(), 1] += wide
    corners = []
    for rows, grid in ((range(middle), row), (range(middle, n - 1), upper)):
        for r in rows:
            a, b, c, d = grid[r, :-1], grid[r, 1:], grid[r + 1, 1:], grid[r + 1, :-1]
            corners += [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    return [before, after], np.concatenate(corners)


def border_of(corners):
    ends = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    found, count = np.unique(ends, axis=0, return_counts=True)
    return found[count == 1]


@pytest.mark.parametrize("wide, open_edges", [(4.0, True), (0.0, False)])
def test_a_coarser_surface_keeps_its_cuts_open_and_welds_other_seams(wide, open_edges):
    (before, after), corners = parted_sheet(41, wide)
    most = len(corners) // 4
    (coarse, moved), faces, (height,) = coarser([before, after], corners, [before[:, 1]], most)
    assert 0.5 * most < len(faces) <= most and faces.max() < len(coarse)
    assert np.allclose(height, coarse[:, 1]), "fields go with the vertices"
    inside = coarse[border_of(faces)].mean(1)
    inside = inside[(inside[:, :2] > 2.5).all(1) & (inside[:, :2] < 37.5).all(1)]
    assert (len(inside) > 10) == open_edges, inside
    assert np.abs(inside[:, 1] - 20).max(initial=0) < 1, "the border is that of the seam"
    sides = (moved - coarse)[np.abs(coarse[:, 1] - 20) < 1][:, 1]
    assert sides.max() == pytest.approx(wide) and sides.min() == pytest.approx(0)
