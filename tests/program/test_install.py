"""Files that cmake --install places, and that they work from there."""

import os
import re
import shutil
import sys

import h5py
import numpy as np
import pytest

from conftest import PROJECT, finish, programs
from tissue import last, model_of

SCENE = "paper_jaw_advance.yaml"


@pytest.fixture(scope="module")
def prefix(tmp_path_factory, environment):
    if not shutil.which("cmake"):
        pytest.skip("cmake is not installed")
    folder = tmp_path_factory.mktemp("installed")
    result = finish(["cmake", "--install", programs().parent, "--prefix", folder], PROJECT,
                    environment, 120)
    assert result.returncode == 0, result.stderr
    return folder


@pytest.fixture
def call(prefix, environment, tmp_path):
    """call(command …) → CompletedProcess, in an empty folder, installed programs on the path."""

    def run(*command, **more):
        path = f"{prefix / 'bin'}:{environment['PATH']}"
        here = {name: value for name, value in environment.items() if name != "REPOSE_BUILD"}
        return finish([*map(str, command)], tmp_path, {**here, "PATH": path, **more}, 400)

    return run


@pytest.mark.quick
def test_everything_is_there(prefix):
    sources = {p.stem.replace("_", "-") for p in (PROJECT / "drivers").glob("*.cpp")}
    assert {p.name for p in (prefix / "bin").iterdir()} == {f"repose-{name}" for name in sources}
    headers = PROJECT / "include"
    for header in headers.rglob("*.h"):
        assert (prefix / "include" / header.relative_to(headers)).is_file()
    shared = prefix / "share/repose"
    for name in ("report.py", "sheet/page.py", "planning/operation.py", "web/viewer.js", "live.py", "map.py",
                 "render.py", "repose.slurm", "slicer/ReposeLive.py", "slicer/Repose.xml", f"meshes/{SCENE}"):
        assert (shared / name).is_file(), name
    assert os.access(shared / "slicer/Repose", os.X_OK) and os.access(shared / "report.py", os.X_OK)


def test_manual_pages_and_completion_hold_every_option(prefix, call):
    for program in sorted(path.name for path in (prefix / "bin").iterdir()):
        page = (prefix / f"share/man/man1/{program}.1").read_text(encoding="utf-8")
        options = re.findall(r"^  (-\w+)", call(program, "-help").stdout, re.M)
        assert re.findall(r"^\.B \\(-\w+)", page, re.M) == options and len(options) > 1
        script = prefix / f"share/bash-completion/completions/{program}"
        offered = call("bash", "-c", f"source {script}; COMP_WORDS=({program} -); COMP_CWORD=1; "
                       f"_{program}; echo ${{COMPREPLY[@]}}").stdout
        assert offered.split() == options
    offered = call("bash", "-c", f"source {prefix}/share/bash-completion/completions/repose-solve; "
                   "COMP_WORDS=(repose-solve -volume p); COMP_CWORD=2; _repose-solve; "
                   "echo ${COMPREPLY[@]}").stdout
    assert offered.split() == ["paper", "penalty"]


def test_the_paper_finds_its_heads(call, tmp_path):
    result = call("repose-paper", "-layers", 2, "-limit", 1, "-seconds", 0.001, "-path_seconds",
                  0.001)
    assert (result.returncode, result.stderr) == (0, "")
    assert (tmp_path / "paper/paper.md").is_file()


@pytest.mark.quick
def test_the_panel_finds_its_program(prefix, call, tmp_path):
    meshes = prefix / "share/repose/meshes"
    result = call(prefix / "share/repose/slicer/Repose", "--skin", meshes / "paper_skin.ply",
                  "--bone1", meshes / "paper_skull.ply", "--processors", 1,
                  "--resultFile", tmp_path / "face.h5", PATH="/usr/bin:/bin")
    assert (result.returncode, result.stderr) == (0, "")
    with h5py.File(tmp_path / "face.h5") as h5:
        assert h5.attrs["command"].decode().startswith(str(prefix / "bin/repose-solve"))


@pytest.mark.quick
def test_a_plan_finds_its_programs(prefix, call, tmp_path):
    (tmp_path / "ct.mhd").touch()
    result = call(sys.executable, prefix / "share/repose/plan.py", "ct.mhd", "-operation", "jaw, 5 mm forward",
                  PATH="/usr/bin:/bin")
    assert f"$ {prefix / 'bin/repose-isosurface'} ct.mhd" in result.stdout and result.returncode == 1


@pytest.mark.long
def test_a_program_of_ones_own_builds_against_it(prefix, call, tmp_path):
    example = prefix / "share/repose/examples/own_energy"
    result = call("cmake", "-S", example, "-B", "own", f"-DCMAKE_PREFIX_PATH={prefix}")
    assert result.returncode == 0, result.stderr
    result = call("cmake", "--build", "own")
    assert result.returncode == 0, result.stdout + result.stderr
    scene = prefix / "share/repose/meshes" / SCENE
    result = call("mpirun", "-n", 2, "own/own_energy", scene, "-pressure", 0.002)
    assert (result.returncode, result.stderr) == (0, "")
    model = model_of(tmp_path / "own_energy.h5")
    assert (model["element/0/points"].reshape(-1, 3) == model["skin/points"]).all()
    assert last(tmp_path / "own_energy.h5")["converged"]
    unknown = call("repose-check", "own_energy.h5")
    assert unknown.returncode == 1 and 'an energy "pressure", which this program' in unknown.stderr
    moved = last(tmp_path / "own_energy.h5")["point/displacement"][model["point/layer"] == 0]
    assert call("mpirun", "-n", 2, "own/own_energy", scene).returncode == 0
    still = last(tmp_path / "own_energy.h5")["point/displacement"][model["point/layer"] == 0]
    assert np.linalg.norm(moved - still, axis=1).max() > 0.01


@pytest.fixture
def batch(prefix, call, tmp_path):
    """batch(arguments …, variable=value …) runs the batch script, with an srun that notes its calls."""
    (tmp_path / "srun").write_text('#!/bin/sh\necho "$@" >> calls\nexec "$@" $MORE\n')
    (tmp_path / "srun").chmod(0o755)
    path = f"{tmp_path}:{prefix / 'bin'}:/usr/bin:/bin"
    return lambda *scenes, **more: call("bash", prefix / "share/repose/repose.slurm", *scenes, PATH=path, **more)


def test_the_batch_script_takes_an_unfinished_run_up_again(prefix, batch, tmp_path):
    scene = prefix / "share/repose/meshes" / SCENE
    first = batch(scene, MORE="-time_limit 0")
    assert first.returncode == 2, first.stderr
    assert batch(scene, "missing.yaml").returncode == 1
    calls = (tmp_path / "calls").read_text().splitlines()
    assert [" -restart " in line for line in calls] == [False, True, False]
    assert last(tmp_path / "paper_jaw_advance.h5")["load"] == 1


def test_the_batch_script_overwrites_no_result_of_another_scene(prefix, batch, tmp_path):
    shutil.copytree(prefix / "share/repose/meshes", tmp_path / "a")
    result = tmp_path / "paper_jaw_advance.h5"
    twice = batch(f"a/{SCENE}", f"b/{SCENE}")
    assert twice.returncode == 1 and "more than one scene has the name paper_jaw_advance" in twice.stderr
    assert batch().returncode == 1 and not result.exists()
    (tmp_path / "a b").symlink_to("a")
    assert batch(f"a b/{SCENE}", MORE="-time_limit 0").returncode == 2
    before = result.read_bytes()
    other = batch(f"a/{SCENE}")
    assert other.returncode == 1 and f"paper_jaw_advance.h5 is no result of \"repose-solve a/{SCENE}\"" in other.stderr
    assert result.read_bytes() == before
    assert batch(f"a b/{SCENE}").returncode == 0 and last(result)["load"] == 1
