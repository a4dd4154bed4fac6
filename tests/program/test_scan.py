"""repose-scan on the range images of a real scanner. They are not shipped: they lie beside the
project, in ../shared/data/range."""

import re

import meshio
import numpy as np
import pytest

from conftest import PROJECT, expect_refusal

pytestmark = pytest.mark.quick

DATA = PROJECT.parent / "shared/data/range"

real = pytest.mark.skipif(not DATA.is_dir(), reason=f"no range images: {DATA} is missing")

GRID = """ply
format ascii 1.0
obj_info num_cols 3
obj_info num_rows 2
element vertex 6
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element range_grid 6
property list uchar int vertex_indices
end_header
"""
BODY = "".join(f"{x} {y} 0 {100 * x} {90 * y} 5\n" for y in range(2) for x in range(3))
CELLS = "".join(f"1 {i}\n" for i in range(6))


@real
@pytest.mark.parametrize("name, cells", [("bun000", 40256), ("bun090", 30379)])
def test_a_real_scan_becomes_a_mesh(run, tmp_path, name, cells):
    result = run("repose-scan", DATA / f"{name}.ply")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert f"512 × 400 cells, {cells} of them with a point" in result.stdout
    assert "taken as m (" in result.stdout
    assert "non-manifold" not in result.stdout
    mesh = meshio.read(tmp_path / "scan.ply")
    corners = mesh.points[mesh.cells_dict["triangle"]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0).all()
    assert 0.99 * cells < len(mesh.points) <= 1.01 * cells
    longest = float(re.search(r"edge > ([\d.]+) mm", result.stdout)[1])
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert sides.max() <= longest + 1e-2


@real
@pytest.mark.long
def test_a_scan_can_be_decimated(run):
    """Its sheets touch in points, which are doubled."""
    made = run("repose-scan", DATA / "bun000.ply", "-output", "scan.ply")
    assert made.returncode == 0 and int(re.search(r"(\d+) doubled", made.stdout)[1]) > 0
    result = run("repose-decimate", "scan.ply", "-distance", 1, "-output", "less.ply")
    assert (result.returncode, result.stderr) == (0, ""), result


@real
def test_the_largest_component_alone(run):
    result = run("repose-scan", DATA / "bun000.ply", "-largest")
    assert result.returncode == 0
    assert "1 component" in result.stdout and "smaller components left out" in result.stdout


def flat_scan(step, stray=None):
    """A grid of 21 × 21 points in a square of 20 steps; the first is `stray`."""
    points = [[x * step, y * step, 0] for y in range(21) for x in range(21)]
    points[0] = stray or points[0]
    text = GRID.replace("_cols 3", "_cols 21").replace("_rows 2", "_rows 21")
    text = re.sub("(vertex|range_grid) 6", r"\1 441", text)
    return text + "".join(f"{x} {y} {z} 9 9 9\n" for x, y, z in points) + "".join(f"1 {i}\n" for i in range(441))


@pytest.mark.parametrize("unit, scale, options", [
    ("m", 1000, []), ("mm", 1, []), ("m", 1000, ["-unit", "m"]), ("cm", 10, ["-unit", "cm"]),
    ("in", 25.4, ["-unit", "in"])])
def test_one_stray_point_does_not_change_the_unit(run, tmp_path, unit, scale, options):
    (tmp_path / "range.ply").write_text(flat_scan(10 / scale, [10000, 0, 0]))
    result = run("repose-scan", "range.ply", *options)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert options or f"units across: taken as {unit} (" in result.stdout
    assert np.ptp(meshio.read(tmp_path / "scan.ply").points, axis=0)[:2] == pytest.approx(200, rel=1e-3)


@pytest.mark.parametrize("across", [5, 10, 40])
def test_a_scan_neither_in_mm_nor_in_m_needs_its_unit(run, tmp_path, across):
    (tmp_path / "range.ply").write_text(flat_scan(across / 20 / 2**0.5 * 1.001))
    result = run("repose-scan", "range.ply")
    assert result.returncode == 1 and "-unit cm, in, mm or m" in result.stderr, result
    assert not (tmp_path / "scan.ply").exists()


def test_colors_are_kept(run, tmp_path):
    (tmp_path / "range.ply").write_text(GRID + BODY + CELLS)
    result = run("repose-scan", "range.ply", "-unit", "mm")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "with colors" in result.stdout
    mesh = meshio.read(tmp_path / "scan.ply")
    red = np.asarray(mesh.point_data["red"]).astype(np.uint8)  # read as signed
    assert sorted(red) == [0, 0, 100, 100, 200, 200]


CASES = {
    "missing": (None, [], ["range.ply", "no such file"]),
    "no PLY": ("solid\n", [], ["range.ply"]),
    "a mesh": (GRID.replace("obj_info num_cols 3\n", "") + BODY + CELLS, [], ["num_cols"]),
    "truncated": (GRID + BODY + CELLS[:-4], [], ["range.ply", "truncated", "range_grid"]),
    "too many cells": (GRID.replace("num_rows 2", "num_rows 3") + BODY + CELLS, [], ["3 rows"]),
    "a point that is not there": (GRID + BODY + CELLS[:-2] + "7\n", [], ["names point 7"]),
    "all cut": (GRID + BODY + CELLS, ["-unit", "mm", "-max_edge", "0.5"], ["range.ply", "0.5"]),
    "unknown ending": (GRID + BODY + CELLS, ["-output", "scan.off"], ["scan.off"]),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_refused(run, tmp_path, case):
    text, options, words = CASES[case]
    if text is not None:
        (tmp_path / "range.ply").write_text(text)
    expect_refusal(run, tmp_path, words, "repose-scan", "range.ply", *options)
