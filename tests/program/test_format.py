"""That formats.md is enough to recompute a result: by a reader that was written from it alone."""

import json
import re

import h5py
import numpy as np
import pytest

from conftest import PROJECT, RUNS_ALL
from format_reader import (Contact, File, adhering, adhesion, advance, motions, prescribed,
                           solid, supports)
from lips import solve_lips

FIELD_ERROR_MM = 1e-4
ROUNDING = 1e-9
SCENE = (PROJECT / "meshes/head_solid.yaml").read_text().partition("moves:")[0].replace(
    ": head_", f": {PROJECT}/meshes/head_").replace("layers: 4", "layers: 3") + """  attach_regions:
    - {sphere: {center: [30, -60, -60], radius: 25}, attach: slide}
mouth: {path: [[-20, -92, -35], [0, -98, -35], [20, -92, -35]]}
instruments:
  - {sphere: {center: [57, -90, -10], radius: 10}, push: [-9, 12, 0], skin: slide}
contact: {grid: 2}
forces:
  - {at: [-50, -75, -30], radius: 10, force: [-0.02, -0.05, 0]}
moves:
  - {bone: mandible, rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: -1}}
"""
NOT_RECOMPUTED = {"load", "functional", "volume", "lambda", "bulk_modulus", "epsilon", "iterations",
                  "evaluations", "seconds", "reason", "converged", "displacement_error"}


@pytest.fixture(scope="module")
def result(tmp_path_factory, environment):
    from conftest import runner
    folder = tmp_path_factory.mktemp("format")
    (folder / "touching.yaml").write_text(SCENE)
    done = runner(folder, environment)("repose-solve", "touching.yaml", "-accuracy", 0.1)
    assert (done.returncode, done.stderr) == (0, ""), done
    for body in ("mandible", "instruments[0]", "the sides of cuts"):
        assert f"points press on {body}" in done.stdout
    return File(folder / "touching.h5")


@pytest.fixture(scope="module")
def lips(tmp_path_factory, environment):
    """A jaw that moves away from a lip, which adheres to it."""
    return File(solve_lips(tmp_path_factory.mktemp("lips"), environment,
                           clinical="set_back: 3, yaw: 1"))


@pytest.fixture(scope="module")
def contact(result):
    return Contact(result)


def close(value, stored, scale, tolerance=ROUNDING):
    return np.abs(value - stored).max(initial=0) <= tolerance * scale


def test_every_number_of_every_step_follows_from_the_page(result, contact):
    for arrays, numbers in result.steps if RUNS_ALL else result.steps[-1:]:
        again = tissue(result, arrays, numbers["load"])
        again |= touching(result, contact, arrays, numbers)
        assert again.keys() - arrays.keys() == numbers.keys() - NOT_RECOMPUTED
        assert arrays.keys() - again.keys() == {"point/position"}
        for name, (value, scale) in again.items():
            stored = arrays[name] if name in arrays else numbers[name]
            assert np.shape(value) == np.shape(stored), name
            assert close(value, stored, scale), (name, np.abs(value - stored).max(), scale)


@pytest.mark.quick
def test_adhesion_follows_from_the_page(lips):
    films = adhering(lips)
    points, numbers = lips.elements["adhesion"]
    assert [film[0] for film in films] == list(points) and len(films) > 10
    assert [film[1] for film in films] == list(numbers[:, 6])
    arrays, numbers = lips.steps[-1]
    energy, _ = adhesion(lips, films, arrays["point/position"], numbers["load"])
    assert energy > 0.01
    for arrays, numbers in lips.steps:
        again = tissue(lips, arrays, numbers["load"], films)
        for name in ("f_e", "point/residual_force", "gradient_max"):
            value, scale = again[name]
            assert close(value, arrays[name] if name in arrays else numbers[name], scale), name


def test_the_rule_of_adhesion_is_that_of_the_landmarks(lips):
    """Along the head's axes 11 mm above and below the edge of the incisors; 12 mm beside the corners
    of the mouth, from 16 mm in front of the upper incisors to 38 mm behind; the gap of the vestibule
    and 0.6 mm."""
    markup, = json.loads((lips.folder / "head.mrk.json").read_text())["markups"]
    axes = lips.model["adhesion/axes"]
    assert np.allclose(axes @ axes.T, np.eye(3), rtol=0, atol=1e-12) and np.linalg.det(axes) > 0
    mark = {point["label"]: axes @ point["position"] for point in markup["controlPoints"]}
    across = mark["condyle_left_center"] - mark["condyle_right_center"]
    hinge = (mark["condyle_left_center"] + mark["condyle_right_center"]) / 2
    rise = sum(np.degrees(np.arctan2(way[2], -way[1])) for way in
               (mark["nasion_bone"] - hinge, mark["upper_incisor_edge"] - hinge))
    assert np.abs(across[1:]).max() < 1e-9 and across[0] > 0 and abs(rise - 14) < 1e-9
    right, left = mark["mouth_right"], mark["mouth_left"]
    upper, lower = mark["upper_incisor_edge"], mark["lower_incisor_edge"]
    line = lips.model["adhesion/lip_line"]
    assert np.allclose(line, [right, mark["stomion"], left], rtol=0, atol=1e-9)
    gap = max(1, min((lower[1] - upper[1]) / 2, 4))
    assert list(lips.model["adhesion/upper"]) == [1, 0]
    for box, edge, reach, far in zip(lips.model["adhesion/box"], (upper, lower),
                                     lips.model["adhesion/reach"], (1.6, gap + 0.6)):
        low = [right[0] - 12, upper[1] - 16, edge[2] - 11]
        high = [left[0] + 12, upper[1] + 38, edge[2] + 11]
        assert np.allclose(box, low + high, rtol=0, atol=1e-9) and abs(reach - far) < 1e-9
    assert lips.adhesion == {"tension": 5e-4, "range": 2}


def tissue(result, arrays, at_load, films=()):
    """{name: (value, scale of its rounding)} of all but contact's own numbers."""
    x, model = arrays["point/position"], result.model
    soft, displacement = model["point/set"] == 0, x - model["point/position"]
    again = solid(result, x)
    energy, pull = adhesion(result, films, x, at_load)
    held, hold = supports(result, x, at_load)
    again["f_e"] += energy + held
    load = model["point/mass"][:, None] * result.gravity + model["point/external_force"]
    force = np.where(soft[:, None],
                     again.pop("force") + pull + hold + load + arrays["point/contact_force"], 0)
    size = np.linalg.norm(force, axis=1)
    found = {name: (value, max(1, np.abs(value).max())) for name, value in again.items()}
    potential = -(load * displacement)[soft].sum()
    return found | {
        "point/displacement": (displacement, 1), "point/residual_force": (force, 1),
        "point/advance": (advance(result, displacement), 1), "f_f": (size.sum(), 1),
        "gradient_max": (size.max(), 1), "potential": (potential, 1), "penalty": (0.0, 1)}


def touching(result, contact, arrays, numbers):
    """Values of contact and of the totals that it is part of."""
    x, load = arrays["point/position"], numbers["load"]
    near = max(FIELD_ERROR_MM, numbers["displacement_error"])
    gap, deepest, acting = contact.measure(x, load, near)
    pressure, scale = pressures(acting, arrays["point/contact_force"])
    of_point = np.zeros(len(x))
    np.add.at(of_point, [entry[0] for entry in acting], pressure)
    energy, slack = energy_of(result, acting, pressure, numbers)
    force = arrays["point/contact_force"]
    bones = moved_bones(result, load)
    found = {
        "point/contact_gap": (gap, FIELD_ERROR_MM / ROUNDING),
        "penetration": (deepest, FIELD_ERROR_MM / ROUNDING),
        "penetration_exact": (contact.exact_penetration(x, load), 1e-6 / ROUNDING),
        "point/contact_pressure": (of_point, scale / ROUNDING),
        "point/contact_force": (force, 1),
        "contact_energy": (energy, slack / ROUNDING),
        "objective": (numbers["f_e"] + numbers["potential"] + numbers["contact_energy"], 1),
        "bone_surface/displacement": (bones - result.model["bone_surfaces/points"], 1)}
    if "bone_surface/points" in arrays:
        found["bone_surface/points"] = (bones, 100)
    return found


def pressures(acting, force):
    """The pressure of each constraint from the forces on the points, whose rows all must agree."""
    rows = sorted({point for *_, unit in acting for point in unit})
    place = {point: 3 * k for k, point in enumerate(rows)}
    matrix = np.zeros((3 * len(rows), len(acting)))
    for k, (*_, unit) in enumerate(acting):
        for point, direction in unit.items():
            matrix[place[point]:place[point] + 3, k] = direction
    given = force[rows].ravel()
    found = np.linalg.lstsq(matrix, given, rcond=None)[0]
    assert np.abs(matrix @ found - given).max() <= FIELD_ERROR_MM / 10 * np.abs(given).max()
    assert np.abs(np.delete(force, rows, 0)).max() == 0
    return found, FIELD_ERROR_MM / 10 * np.abs(found).max()


def energy_of(result, acting, pressure, numbers):
    """The energy of contact from pressures and gaps, and how far the multipliers, which are not in
    the file, may leave it from that."""
    stiffness, left = result.contact["stiffness"], numbers["displacement_error"] / 2
    gap, area = (np.array([entry[k] for entry in acting]) for k in (1, 2))
    presses = np.abs(pressure) > 1e-6 * np.abs(pressure).max()
    energy = -(area * gap * (pressure + stiffness * gap / 2))[presses].sum()
    lag = np.maximum(np.abs(gap), left)
    return energy, 8 * (area * stiffness * lag**2).sum() + (
        FIELD_ERROR_MM * area * np.abs(pressure))[presses].sum()


def moved_bones(result, load):
    points, bone = result.model["bone_surfaces/points"], result.model["bone_surfaces/bone"]
    moved = points.copy()
    for b, (turn, shift) in enumerate(motions(result, load)):
        rows = np.unique(result.model["bone_surfaces/triangles"][bone == b])
        moved[rows] = points[rows] @ turn.T + shift
    return moved


def test_what_is_no_unknown_is_where_the_page_says(result):
    for arrays, numbers in result.steps:
        expected, x = prescribed(result, numbers["load"]), arrays["point/position"]
        fixed = result.model["point/set"] != 0
        assert close(expected[fixed], x[fixed], 100) and np.isnan(expected[~fixed]).all()


SCENES = [("head_solid.yaml", "-stability"), ("head_instrument.yaml",), ("head_incision.yaml",),
          ("paper_jaw_opening.yaml",), ("head_jaw_advance.yaml",)]


@pytest.mark.parametrize("scene", [" ".join(map(str, scene)) for scene in SCENES])
def test_everything_in_a_result_is_named_on_the_page(solved, scene):
    page = (PROJECT / "docs/reference/formats.md").read_text()
    words = set(re.findall(r"[A-Za-z_0-9]+", page))
    name, *options = scene.split()
    found = set()

    def note(path, item):
        parts = [part for part in path.split("/") if not part.isdigit()]
        found.update(parts, item.attrs)

    with h5py.File(solved(name, *options)) as h5:
        note("", h5)
        for top in ("model", "step"):
            note(top, h5[top])
            h5[top].visititems(note)
    assert found - {""} - words == set()
    assert len(found) > 50
