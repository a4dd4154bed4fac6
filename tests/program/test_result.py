"""Which files a run of repose-solve writes, what is in them, and how a run is taken up again."""

import re
import shutil
import xml.etree.ElementTree
import signal
import subprocess

import h5py
import meshio
import numpy as np
import pytest

from conftest import PROJECT, programs
from tissue import apart, last, steps

SCENE = PROJECT / "meshes/paper_jaw_advance.yaml"
VIEWS = ["bones", "skin", "springs", "tissue"]
ACCURACY = 1e-6


@pytest.fixture
def face(solved):
    return solved(SCENE.name, "-accuracy", ACCURACY)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def files_of(name):
    return sorted([f"{name}.h5"] + [f"{name}_{view}.xdmf" for view in (*VIEWS, "blocks")])


def shortened(file, copy, keep):
    """A copy of a result with the first `keep` of its steps."""
    shutil.copy(file, copy)
    with h5py.File(copy, "r+") as h5:
        for name in sorted(h5["step"])[keep:]:
            del h5["step"][name]
    return copy


@pytest.mark.quick
def test_dry_run_writes_nothing(run, tmp_path):
    result = run("repose-solve", SCENE, "-dry_run")
    assert (result.returncode, result.stderr) == (0, "")
    assert "1908" in result.stdout and "14941" in result.stdout and "2622" in result.stdout
    assert names(tmp_path) == []


def test_default_name_is_that_of_the_input_in_this_folder(run, tmp_path):
    assert run("repose-solve", SCENE, "-accuracy", 1).returncode == 0
    assert names(tmp_path) == files_of("paper_jaw_advance")


def test_output_into_another_folder(run, tmp_path):
    (tmp_path / "there").mkdir()
    result = run("repose-solve", SCENE, "-accuracy", 1, "-output", "there/jaw.v2", ranks=2)
    assert (result.returncode, result.stderr) == (0, "")
    assert names(tmp_path) == ["there"]
    assert names(tmp_path / "there") == files_of("jaw.v2")
    with meshio.xdmf.TimeSeriesReader(tmp_path / "there/jaw.v2_skin.xdmf") as reader:
        assert reader.num_steps == len(steps(tmp_path / "there/jaw.v2.h5"))


def test_a_result_is_replaced_by_the_next(run, tmp_path):
    assert run("repose-solve", SCENE, "-accuracy", 1, "-output", "jaw").returncode == 0
    before = last(tmp_path / "jaw.h5")
    assert run("repose-solve", SCENE, "-accuracy", 0.01, "-output", "jaw").returncode == 0
    assert last(tmp_path / "jaw.h5")["displacement_error"] < before["displacement_error"]
    assert names(tmp_path) == files_of("jaw")


def test_a_result_never_replaces_its_input(run, tmp_path):
    assert run("repose-solve", SCENE, "-accuracy", 1, "-output", "jaw").returncode == 0
    before = (tmp_path / "jaw.h5").read_bytes()
    result = run("repose-solve", "jaw.h5", "-accuracy", 0.01)
    assert result.returncode == 1 and "-output" in result.stderr
    assert (tmp_path / "jaw.h5").read_bytes() == before
    assert names(tmp_path) == files_of("jaw")


@pytest.mark.parametrize("keep", [1, 2, 3])
@pytest.mark.parametrize("ranks", [1, 2])
def test_restart_arrives_at_the_same_face(run, face, tmp_path, keep, ranks):
    shortened(face, tmp_path / "part.h5", keep)
    result = run("repose-solve", SCENE, "-accuracy", ACCURACY, "-restart", "part.h5", "-output",
                 "rest", ranks=ranks)
    assert (result.returncode, result.stderr) == (0, "")
    rest = steps(tmp_path / "rest.h5")
    part = steps(tmp_path / "part.h5")
    assert [step["load"] for step in rest[:keep]] == [step["load"] for step in part]
    assert max(apart(*pair) for pair in zip(rest, part)) <= 2 * ACCURACY
    assert rest[-1]["load"] == 1 and apart(rest[-1], last(face)) <= 2 * ACCURACY


@pytest.mark.quick
def test_restart_refines_an_end(run, face, tmp_path):
    assert run("repose-solve", SCENE, "-accuracy", 1, "-output", "rough").returncode == 0
    assert apart(last(tmp_path / "rough.h5"), last(face)) > 0.01
    result = run("repose-solve", SCENE, "-accuracy", ACCURACY, "-restart", "rough.h5", "-output",
                 "fine")
    assert result.returncode == 0
    loads = [step["load"] for step in steps(tmp_path / "rough.h5")]
    assert [step["load"] for step in steps(tmp_path / "fine.h5")] == loads and len(loads) > 1
    assert apart(last(tmp_path / "fine.h5"), last(face)) <= 2 * ACCURACY
    assert run("repose-check", "fine.h5").returncode == 0


FINISHED = ["paper_jaw_advance.yaml", "head_jaw_opening.yaml", "head_incision.yaml",
            "head_instrument.yaml", "head_springs_incision.yaml"]


@pytest.mark.parametrize("scene", FINISHED)
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_finished_result_is_left_alone(run, solved, tmp_path, scene, ranks):
    (tmp_path / "jaw.h5").write_bytes(solved(scene).read_bytes())
    before = (tmp_path / "jaw.h5").read_bytes()
    result = run("repose-solve", PROJECT / "meshes" / scene, "-restart", "jaw.h5", "-output", "jaw",
                 "-allow_folded", ranks=ranks)
    assert (result.returncode, result.stderr) == (0, "")
    assert "nothing is left to do" in result.stdout and "evaluations" not in result.stdout
    assert (tmp_path / "jaw.h5").read_bytes() == before
    assert names(tmp_path) == ["jaw.h5"]


def test_a_finished_result_of_another_name_is_copied(run, face, tmp_path):
    result = run("repose-solve", SCENE, "-accuracy", ACCURACY, "-restart", face, "-output", "jaw")
    assert result.returncode == 0 and "nothing is left to do" in result.stdout
    assert names(tmp_path) == files_of("jaw")
    assert [step["load"] for step in steps(tmp_path / "jaw.h5")] == [
        step["load"] for step in steps(face)]
    assert apart(last(tmp_path / "jaw.h5"), last(face)) == 0


def test_a_finished_result_that_h5py_has_written_to_is_copied(run, face, tmp_path):
    with h5py.File(shutil.copy(face, tmp_path / "noted.h5"), "r+") as file:
        for step in file["step"].values():
            step.attrs["reason"] = "noted"  # of variable length, at which HDF5's copy crashes
    result = run("repose-solve", SCENE, "-accuracy", ACCURACY, "-restart", "noted.h5", "-output", "jaw")
    assert (result.returncode, result.stderr) == (0, "") and "nothing is left to do" in result.stdout
    assert last(tmp_path / "jaw.h5")["reason"] == b"noted"
    assert run("repose-check", "jaw.h5").returncode == 0


def test_a_negative_distance_to_rest_is_no_end(run, face, tmp_path):
    with h5py.File(shutil.copy(face, tmp_path / "odd.h5"), "r+") as file:
        list(file["step"].values())[-1].attrs["displacement_error"] = -1.0
    result = run("repose-solve", SCENE, "-accuracy", ACCURACY, "-restart", "odd.h5", "-output", "jaw")
    assert result.returncode == 0 and "nothing is left to do" not in result.stdout


def test_a_restart_with_other_settings_searches(run, face, tmp_path):
    text = SCENE.read_text().replace(": paper_", f": {PROJECT}/meshes/paper_")
    (tmp_path / "other.yaml").write_text(text.replace("poisson: 0.4967", "poisson: 0.49"))
    result = run("repose-solve", "other.yaml", "-accuracy", ACCURACY, "-restart", face)
    assert result.returncode == 0 and "nothing is left to do" not in result.stdout
    assert "another model or plan" not in result.stdout
    assert apart(last(tmp_path / "other.h5"), last(face)) > 2 * ACCURACY


def test_a_restart_from_another_plan_warns(run, face, tmp_path):
    text = SCENE.read_text().replace(": paper_", f": {PROJECT}/meshes/paper_")
    (tmp_path / "other.yaml").write_text(re.sub(r"translate: .*?]", "translate: [0, -5, 0]", text))
    result = run("repose-solve", "other.yaml", "-restart", face)
    assert result.returncode == 0
    assert re.search("warning .* is of another model or plan: its point/target differs", result.stdout), result


def test_restart_from_another_model_is_refused(run, face, tmp_path):
    result = run("repose-solve", PROJECT / "meshes/head_jaw_advance.yaml", "-restart", face)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1 and str(face) in result.stderr
    assert names(tmp_path) == []


def test_restart_from_springs_for_a_solid_is_refused(run, face, tmp_path):
    text = SCENE.read_text().replace(": paper_", f": {PROJECT}/meshes/paper_")
    head, springs, end = text.partition("  springs:\n")
    material = "  material: {preset: face}\n" + end.split("\n", 1)[1].partition("solve:")[0]
    (tmp_path / "solid.yaml").write_text(head + material)
    result = run("repose-solve", "solid.yaml", "-restart", face)
    assert result.returncode == 1 and len(result.stderr.splitlines()) == 1, result
    assert "the same model, but its springs differ" in result.stderr


def test_checkpoints_are_results(run, face, tmp_path):
    result = run("repose-solve", SCENE, "-accuracy", ACCURACY, "-checkpoint_interval", 1e-9,
                 "-output", "jaw", ranks=2)
    assert (result.returncode, result.stderr) == (0, "")
    assert set(files_of("jaw")) <= set(names(tmp_path))
    checkpoint = tmp_path / "jaw_checkpoint.h5"
    assert len(steps(checkpoint)) == 1
    assert run("repose-check", checkpoint).returncode == 0
    restarted = run("repose-solve", SCENE, "-accuracy", ACCURACY, "-restart", checkpoint, "-output",
                    "rest")
    assert restarted.returncode == 0
    assert apart(last(tmp_path / "rest.h5"), last(face)) <= 2 * ACCURACY
    assert not list(tmp_path.glob("*.part"))


def begin(folder, environment, *arguments):
    """Starts a solve and waits for its first iteration."""
    process = subprocess.Popen(
        [programs() / "repose-solve", *map(str, arguments), "-monitor_mm"], cwd=folder,
        env=environment, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE)
    wait_for(process, "iteration    0")
    return process


def wait_for(process, words):
    for line in process.stdout:
        if words in line:
            return
    pytest.fail(f"the run ended before it said '{words}'")


LONG = ["-load_steps", 1, "-tao_type", "cg", "-accuracy", 1e-9]


def test_a_run_killed_in_a_long_step_goes_on_from_its_checkpoint(run, face, environment, tmp_path):
    process = begin(tmp_path, environment, SCENE, *LONG, "-checkpoint_interval", 1e-9, "-output",
                    "jaw")
    wait_for(process, "load 1.0000  iteration   40")
    process.kill()
    process.communicate()
    checkpoint = tmp_path / "jaw_checkpoint.h5"
    assert [(step["load"], step["converged"]) for step in steps(checkpoint)] == [(0, 1), (1, 0)]
    assert apart(*steps(checkpoint)) > 1, "the search is not lost"
    assert run("repose-check", checkpoint).returncode == 0
    restarted = run("repose-solve", SCENE, "-accuracy", ACCURACY, "-restart", checkpoint, "-output",
                    "jaw")
    assert (restarted.returncode, restarted.stderr) == (0, "")
    assert apart(last(tmp_path / "jaw.h5"), last(face)) <= 2 * ACCURACY
    assert not list(tmp_path.glob("jaw*.part")) + list(tmp_path.glob("*.lock"))


def test_two_runs_of_one_name_do_not_meet(run, environment, tmp_path):
    first = begin(tmp_path, environment, SCENE, *LONG, "-output", "jaw")
    first.send_signal(signal.SIGSTOP)
    for ranks in (1, 2):
        second = run("repose-solve", PROJECT / "meshes/paper_jaw_opening.yaml", "-output", "jaw",
                     ranks=ranks)
        assert second.returncode == 1 and second.stderr.count("\n") == 1, second
        assert f"jaw.h5: process {first.pid} on " in second.stderr and second.stdout == ""
    other = run("repose-solve", SCENE, "-accuracy", 1, "-output", "other")
    assert other.returncode == 0
    first.terminate()
    first.send_signal(signal.SIGCONT)
    assert first.communicate()[1] == "" and first.returncode == 2
    assert names(tmp_path) == sorted(files_of("jaw") + files_of("other"))
    assert run("repose-check", "jaw.h5").returncode == 0


def test_a_reader_that_goes_away_does_not_end_the_run(environment, tmp_path):
    process = begin(tmp_path, environment, SCENE, "-accuracy", 1e-6, "-output", "jaw")
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait() == 0 and names(tmp_path) == files_of("jaw")


@pytest.mark.parametrize("limit", [["-tao_max_it", 1, "-tao_type", "lmvm"],
                                   ["-tao_max_it", 3, "-tao_type", "cg"]], ids=["lmvm", "cg"])
@pytest.mark.parametrize("ranks", [1, 2])
def test_what_is_not_converged_says_so(run, tmp_path, limit, ranks):
    result = run("repose-solve", SCENE, "-accuracy", 1e-9, *limit, "-output", "jaw", ranks=ranks)
    assert (result.returncode, result.stderr) == (2, "")
    assert "NOT CONVERGED" in result.stdout and "iteration limit" in result.stdout
    path = steps(tmp_path / "jaw.h5")
    assert [step["converged"] for step in path] == [1] * (len(path) - 1) + [0]
    assert b"iteration limit" in path[-1]["reason"]
    assert path[-1]["load"] < 1 and path[-1]["displacement_error"] > 1e-9
    assert names(tmp_path) == files_of("jaw")
    assert run("repose-check", "jaw.h5").returncode == 0


CELLS = {"tissue": ("wedge", 2622, 1908), "springs": ("line", 14941, 1908),
         "skin": ("triangle", 874, 1908)}
SHOWN = {"tissue": {"displacement (mm)": "point/displacement", "volume_ratio": "prism/volume_ratio",
                    "residual_force (N)": "point/residual_force"},
         "springs": {"elongation (mm)": "spring/elongation", "tension (N)": "spring/tension"},
         "skin": {"displacement (mm)": "point/displacement"}}


@pytest.mark.quick
@pytest.mark.parametrize("view", VIEWS)
def test_views_open_as_time_series(face, view):
    with meshio.xdmf.TimeSeriesReader(face.with_name(f"{face.stem}_{view}.xdmf")) as reader:
        points, cells = reader.read_points_cells()
        series = [reader.read_data(step) for step in range(reader.num_steps)]
    path = steps(face)
    assert [time for time, _, _ in series] == pytest.approx([step["load"] for step in path])
    if view == "bones":
        with h5py.File(face) as h5:
            surfaces = list(h5["model/bone_surface"].values())
            expected = (sum(len(s["triangles"]) for s in surfaces),
                        sum(len(s["points"]) for s in surfaces))
        assert (cells[0].type, len(cells[0].data), len(points)) == ("triangle", *expected)
        for (_, at_points, _), step in zip(series, path):
            assert np.array_equal(at_points["displacement (mm)"], step["bone_surface/displacement"])
            assert np.isfinite(at_points["displacement (mm)"]).all()
        return
    kind, count, point_count = CELLS[view]
    assert [(block.type, len(block.data)) for block in cells] == [(kind, count)]
    assert len(points) == point_count
    for (_, at_points, at_cells), step in zip(series, path):
        for name, array in SHOWN[view].items():
            shown = at_points[name] if name in at_points else at_cells[name][0]
            assert np.array_equal(shown, step[array])


def rows_of(item, h5):
    """Returns the array of a DataItem of an XDMF file, also of one that is part of a dataset."""
    if item.get("ItemType") != "HyperSlab":
        return h5[item.text.split(":")[1]][:]
    slab, data = item
    begin, stride, count = (int(row) for row in np.array(slab.text.split(), int).reshape(3, -1)[:, 0])
    assert stride == 1
    return rows_of(data, h5)[begin:begin + count]


@pytest.mark.quick
def test_blocks_are_named_and_each_bone_is_one(face):
    root = xml.etree.ElementTree.parse(face.with_name(f"{face.stem}_blocks.xdmf")).getroot()
    collections = {grid.get("Name"): grid for grid in root.findall("Domain/Grid/Grid")}
    with h5py.File(face) as h5:
        bones = [name.decode() for name in h5["model/bone"]]
        assert list(collections) == ["tissue", "springs", "skin", *bones], "one of each name, as VTK shows it"
        assert {len(collection.findall("Grid")) for collection in collections.values()} == {len(h5["step"])}
        for row, step in enumerate(h5["step"].values()):
            grids = {name: collection.findall("Grid")[row] for name, collection in collections.items()}
            assert {float(grid.find("Time").get("Value")) for grid in grids.values()} == {step.attrs["load"]}
            moved = step.get("bone_surface/points", h5["model/bone_surfaces/points"])[:]
            bone = np.zeros(len(moved), int)
            bone[h5["model/bone_surfaces/triangles"][:]] = h5["model/bone_surfaces/bone"][:][:, None]
            for number, name in enumerate(bones):
                shown = rows_of(grids[name].find("Geometry/DataItem"), h5)
                assert np.array_equal(shown, moved[bone == number]), name
                corners = rows_of(grids[name].find("Topology/DataItem"), h5)
                assert corners.min() == 0 and corners.max() == len(shown) - 1
                motion = next(array for array in grids[name].findall("Attribute")
                              if array.get("Name") == "displacement (mm)")
                assert np.array_equal(rows_of(motion.find("DataItem"), h5),
                                      step["bone_surface/displacement"][:][bone == number])
