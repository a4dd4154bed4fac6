"""repose-check on contact: it measures by the bones' triangles, so that a result which is wrong
about them is refused, whatever wrote it."""

import re
import shutil

import h5py
import numpy as np
import pytest

from conftest import PROJECT, runner
from lips import solve_lips


@pytest.fixture(scope="module")
def good(tmp_path_factory, environment):
    """A result with tissue pressed on a bone's mesh."""
    top = tmp_path_factory.mktemp("contact_check")
    done = runner(top, environment)("repose-solve", PROJECT / "meshes/head_solid.yaml", "-output",
                                    "good", "-load_steps", 1)
    assert (done.returncode, done.stderr) == (0, ""), done
    assert "exact penetration" in done.stdout
    with h5py.File(top / "good.h5") as h5:
        assert (h5["step/0001/point/contact_pressure"][:] > 0).any()
    return top / "good.h5"


def last_step(h5):
    return h5[sorted(h5["step"].values(), key=lambda step: step.name)[-1].name]


def state(attribute, change):
    def spoil(h5):
        last_step(h5).attrs[attribute] = change(last_step(h5).attrs[attribute])
    return spoil


def in_array(name, change):
    def spoil(h5):
        step = last_step(h5)
        pressed = int(np.argmax(step["point/contact_pressure"][:]))
        values = step[f"point/{name}"][:]
        values[pressed] = change(values[pressed])
        step[f"point/{name}"][...] = values
    return spoil


def no_pressures(h5):
    last_step(h5)["point/contact_pressure"][...] = 0


def grown_bones(h5):
    """Bones 3 mm thicker than those that the solver kept tissue off."""
    for bone in h5["model/bone_surface"].values():
        points, triangles = bone["points"][:], bone["triangles"][:]
        a, b, c = (points[triangles[:, k]] for k in range(3))
        normals = np.zeros_like(points)
        for k in range(3):
            np.add.at(normals, triangles[:, k], np.cross(b - a, c - a))
        bone["points"][...] = points + 3 * normals / np.linalg.norm(normals, axis=1)[:, None]


def moved_bone(h5):
    transform, point = h5["model/bone_transform"][:], h5["model/point"]
    transform[1, 1, 3] += 1
    h5["model/bone_transform"][...] = transform
    target = point["target"][:]
    target[(point["set"][:] == 2) & (point["bone"][:] == 1), 1] += 1
    point["target"][...] = target


def larger_pressures(h5):
    pressure = last_step(h5)["point/contact_pressure"]
    pressure[...] = pressure[:] * 1.01


def larger_areas(h5):
    area = h5["model/contact/area"]
    area[...] = area[:] * 1.01


def deeper(h5):
    """The most pressed point 0.05 mm inside, and the penetration as stated."""
    step = last_step(h5)
    gap = step["point/contact_gap"]
    gap[int(np.argmax(step["point/contact_pressure"][:]))] = -0.05
    step.attrs["penetration"] = 0.05


SPOILED = {
    "penetration stated 0.1 mm too deep": (state("penetration", lambda v: v + 0.1), "penetration"),
    "exact penetration stated as none": (state("penetration_exact", lambda v: 0.0),
                                         "penetration_exact"),
    "exact penetration that is not there": (state("penetration_exact", lambda v: v + 0.01),
                                            "penetration_exact"),
    "exact penetration off by 1e-5 mm": (state("penetration_exact", lambda v: v + 1e-5), "penetration_exact"),
    "a gap and a penetration of 0.05 mm": (deeper, "contact_gap of point"),
    "a gap where tissue presses": (in_array("contact_gap", lambda v: v + 4), "contact_gap of point"),
    "a force that is turned by a degree": (in_array("contact_force", lambda v: v + 0.0175 * np.cross(v, (0.6, 0.8, 0))),
                                           "contact_force of point"),
    "a force that pulls": (in_array("contact_force", lambda v: -v), "force"),
    "a force twice as large": (in_array("contact_force", lambda v: 2 * v), "contact_pressure of point"),
    "no pressures": (no_pressures, "contact_pressure of point"),
    "a pressure twice as large": (in_array("contact_pressure", lambda v: 2 * v), "contact_pressure of point"),
    "pressures a hundredth larger": (larger_pressures, "contact_pressure of point"),
    "areas a hundredth larger": (larger_areas, "contact_pressure of point"),
    "thicker bones": (grown_bones, "contact_gap of point"),
    "a bone elsewhere": (moved_bone, "position"),
}


def refused(result, folder, environment, spoil, words):
    """A spoiled copy of the result is refused with these words."""
    file = folder / "spoiled.h5"
    shutil.copyfile(result, file)
    with h5py.File(file, "r+") as h5:
        spoil(h5)
    done = runner(folder, environment)("repose-check", file)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
    wrong = [line for line in done.stdout.splitlines() if "DISAGREE" in line or "NOT SO" in line]
    assert any(words in line for line in wrong), wrong


@pytest.mark.parametrize("case", SPOILED)
def test_a_result_that_is_wrong_about_contact_is_refused(good, tmp_path, environment, case):
    refused(good, tmp_path, environment, *SPOILED[case])


def test_a_state_that_is_not_converged_may_press_across_gaps(good, tmp_path, environment):
    def state_with(converged):
        def change(h5):
            last_step(h5).attrs.update(converged=converged, displacement_error=0.0)
        return change

    refused(good, tmp_path, environment, state_with(1), "pressure is where gaps are closed")
    with h5py.File(tmp_path / "spoiled.h5", "r+") as h5:
        state_with(0)(h5)
    result = runner(tmp_path, environment)("repose-check", "spoiled.h5")
    assert (result.returncode, result.stderr) == (0, ""), result


@pytest.fixture(scope="module")
def parted(tmp_path_factory, environment):
    """A result with a cut through the skin."""
    top = tmp_path_factory.mktemp("parted")
    done = runner(top, environment)("repose-solve", PROJECT / "meshes/head_incision.yaml", "-output",
                                    "parted", "-load_steps", 1)
    assert (done.returncode, done.stderr) == (0, ""), done
    return top / "parted.h5"


def test_a_wrong_gap_between_the_sides_of_a_cut_is_refused(parted, tmp_path, environment):
    run = runner(tmp_path, environment)
    good = run("repose-check", parted)
    assert (good.returncode, good.stderr) == (0, ""), good
    file = tmp_path / "spoiled.h5"
    shutil.copyfile(parted, file)
    with h5py.File(file, "r+") as h5:
        wall = h5["model/contact/wall"]
        columns, rows = wall["net"][0]
        touching = np.flatnonzero(wall["area"][:columns * rows] > 0)
        point = wall["point"][wall["begin"][touching[len(touching) // 2]]]
        gap = last_step(h5)["point/contact_gap"]
        gap[point] = gap[point] + 1e-3
    result = run("repose-check", file)
    assert result.returncode == 1, result.stdout
    assert any("contact_gap" in line for line in result.stdout.splitlines() if "DISAGREE" in line)


def test_a_good_result_is_accepted_with_its_exact_penetration_and_without(good, tmp_path,
                                                                          environment):
    """Results of earlier versions do not state it."""
    run = runner(tmp_path, environment)
    result = run("repose-check", good)
    assert (result.returncode, result.stderr) == (0, ""), result
    file = tmp_path / "earlier.h5"
    shutil.copyfile(good, file)
    with h5py.File(file, "r+") as h5:
        for step in h5["step"].values():
            del step.attrs["penetration_exact"]
    result = run("repose-check", file)
    assert (result.returncode, result.stderr) == (0, ""), result


def test_skin_that_stays_apart_is_not(run, tmp_path):
    done = run("repose-solve", PROJECT / "meshes/head_solid.yaml", "-output", "apart")
    assert done.returncode == 0 and "self-contact" not in done.stdout, done


@pytest.fixture(scope="module")
def adhering(tmp_path_factory, environment):
    """A result with lips that adhere to a jaw which moves away from them."""
    top = tmp_path_factory.mktemp("adhering")
    solve_lips(top, environment, "-load_steps", 1)
    good = runner(top, environment)("repose-check", "lips.h5")
    assert (good.returncode, good.stderr) == (0, ""), good
    return top / "lips.h5"


def elements(change, term="adhesion"):
    def spoil(h5):
        group, = (one for one in h5["model/element"].values() if one.attrs["term"].decode() == term)
        points = group["points"][:].reshape(-1, 1)
        numbers = group["numbers"][:].reshape(len(points), -1)
        points, numbers = change(points, numbers)
        for name, values in (("points", points), ("numbers", numbers)):
            del group[name]
            group[name] = values.ravel()
    return spoil


def scaled(column, factor):
    def change(points, numbers):
        numbers[:, column] *= factor
        return points, numbers
    return elements(change)


def other_side(points, numbers):
    """Planes that face into the teeth: the tension pushes."""
    numbers[:, :4] *= -1
    return points, numbers


def next_points(points, numbers):
    points[-2:, 0] = points[[-1, -2], 0]
    return points, numbers


def weak_film(h5):
    h5["model/adhesion"].attrs["tension"] *= 0.9


def lower_lips(h5):
    line = h5["model/adhesion/lip_line"]
    line[...] = line[:] - [0, 0, 9]


def no_rule(h5):
    del h5["model/adhesion"]


SPOILED_ADHESION = {
    "a point less": (elements(lambda points, numbers: (points[1:], numbers[1:])),
                     "does not adhere, but by its place it does"),
    "a point twice": (elements(lambda points, numbers: (
        points[[0, *range(len(points))]], numbers[[0, *range(len(numbers))]])), "adheres twice"),
    "planes of other points": (elements(next_points), "adhesion, "),
    "planes that face the teeth": (elements(other_side), "adhesion, normals"),
    "planes half a millimeter off": (elements(lambda points, numbers: (
        points, numbers + [0, 0, 0, 0.5, 0, 0, 0])), "adhesion, initial openings"),
    "the other jaw": (elements(lambda points, numbers: (
        points, [0, 0, 0, 0, 0, 0, 1] + numbers * [1, 1, 1, 1, 1, 1, -1])), "but by its place to"),
    "twice the tension": (scaled(4, 2), "adhesion, tensions"),
    "twice the range": (scaled(5, 2), "adhesion, ranges"),
    "another tension in the rule": (weak_film, "residual_force"),
    "another line between the lips": (lower_lips, "but by its place"),
    "no rule": (no_rule, "the model states where lips adhere"),
    "another energy": (state("f_e", lambda v: v + 1e-3), "f_e"),
}


@pytest.mark.parametrize("case", SPOILED_ADHESION)
def test_a_result_that_is_wrong_about_adhesion_is_refused(adhering, tmp_path, environment, case):
    refused(adhering, tmp_path, environment, *SPOILED_ADHESION[case])


def supports(change):
    return elements(change, "elastic_support")


SPOILED_SUPPORTS = {
    "a point less": (supports(lambda points, numbers: (points[1:], numbers[1:])), "residual_force"),
    "a point twice": (supports(lambda points, numbers: (
        points[[0, *range(len(points))]], numbers[[0, *range(len(numbers))]])), "supported twice"),
    "a point above": (supports(lambda points, numbers: (points - 1, numbers)),
                      "supported elsewhere than it begins"),
    "places a micrometer off": (supports(lambda points, numbers: (
        points, numbers + [0, 1e-3, 0, 0, 0])), "supported elsewhere than it begins"),
    "twice the stiffness": (supports(lambda points, numbers: (
        points, numbers * [1, 1, 1, 2, 1])), "residual_force"),
    "no stiffness": (supports(lambda points, numbers: (
        points, numbers * [1, 1, 1, 0, 1])), "supported with 0 N/mm"),
    "the other bone": (supports(lambda points, numbers: (
        points, [0, 0, 0, 0, 2] + numbers * [1, 1, 1, 1, -1])), "residual_force"),
}


@pytest.fixture(scope="module")
def supported(tmp_path_factory, environment):
    """A result of which bone supports points elastically."""
    top = tmp_path_factory.mktemp("supported")
    run = runner(top, environment)
    done = run("repose-solve", PROJECT / "meshes/head_le_fort.yaml", "-output", "supported",
               "-skip_other_rest")
    assert (done.returncode, done.stderr) == (0, ""), done
    assert "are supported elastically" in done.stdout
    good = run("repose-check", "supported.h5")
    assert (good.returncode, good.stderr) == (0, ""), good
    return top / "supported.h5"


@pytest.mark.parametrize("case", SPOILED_SUPPORTS)
def test_a_result_that_is_wrong_about_supports_is_refused(supported, tmp_path, environment, case):
    refused(supported, tmp_path, environment, *SPOILED_SUPPORTS[case])


def test_pressures_that_are_not_checked_are_counted(run, tmp_path):
    done = run("repose-solve", PROJECT / "meshes/head_incision.yaml", "-output", "cut")
    assert done.returncode == 0, done
    with h5py.File(tmp_path / "cut.h5", "r+") as h5:
        walls = np.unique(h5["model/contact/wall/point"][:])
        last_step(h5)["point/contact_pressure"][walls] = 1e-3
    done = run("repose-check", "cut.h5")
    assert re.search(rf"point/contact_pressure +{len(walls)}  NOT CHECKED", done.stdout), done.stdout
