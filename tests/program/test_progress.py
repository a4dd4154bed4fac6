"""Long work shows where it is on a terminal, under mpirun too, and nothing of that in a log."""

import os
import pty
import re
import subprocess

import pytest

import volumes
from conftest import PROJECT, TIME_LIMIT, programs


def seen(command, folder, environment):
    """What a terminal shows that is the command's stderr."""
    try:
        ours, its = pty.openpty()
    except OSError as none:
        pytest.skip(f"this machine gives no terminal to look at: {none}")
    process = subprocess.Popen(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=its)
    os.close(its)
    text = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        text += part
    os.close(ours)
    assert process.wait(TIME_LIMIT) == 0
    return text.decode(errors="replace")


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_terminal_shows_load_iteration_and_distance(environment, tmp_path, ranks):
    command = [programs() / "repose-solve", PROJECT / "meshes/paper_jaw_advance.yaml"]
    if ranks > 1:
        version = subprocess.run(["mpirun", "--version"], env=environment, capture_output=True, text=True)
        if "Open MPI) 4" not in version.stdout:
            pytest.skip("seen under mpirun with Open MPI 4 only")
        command = ["mpirun", "-n", str(ranks), *command]
    text = seen(command, tmp_path, environment)
    assert re.search(r"\[#*\.+\] load", text)
    for word in ("load", "iteration", "largest force", "mm to go"):
        assert word in text
    assert text.endswith("\r\x1b[K"), "the line is cleared at the end"


def test_a_search_of_one_load_step_tells_the_time_left(environment, tmp_path):
    text = seen([programs() / "repose-solve", PROJECT / "meshes/head_springs_advance.yaml", "-tao_type",
                 "lmvm", "-accuracy", "1e-6", "-load_steps", "1"], tmp_path, environment)
    assert "load 1.000" in text and "load 0.5" not in text
    assert " s left" in text


def test_a_model_that_takes_long_shows_that_it_is_built(environment, tmp_path):
    subprocess.run([programs() / "repose-phantom", "-skin_vertices", "40000", "-output", "head"],
                   cwd=tmp_path, env=environment, check=True, stdout=subprocess.DEVNULL)
    text = seen([programs() / "repose-solve", "head_jaw_advance.yaml", "-dry_run"], tmp_path, environment)
    assert "building the model  " in text and text.endswith("\r\x1b[K")
    assert re.search(r"\[#+\.+\] building the model  \d+ s  about \d+ s left", text)


def test_estimates_have_a_bar_with_the_time_left(environment, tmp_path):
    subprocess.run([programs() / "repose-phantom", "-skin_vertices", "4000", "-output", "head"],
                   cwd=tmp_path, env=environment, check=True, stdout=subprocess.DEVNULL)
    text = seen([programs() / "repose-solve", "head_jaw_advance.yaml", "-sensitivity", "-verify_path",
                 "-accuracy", "1"],
                tmp_path, environment)
    assert re.search(r"\[#*\.+\] verifying the path: load \d", text)
    assert re.search(r"\[#+\.+\] estimating sensitivities  \d+ s  about \d+ s left", text)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_log_stays_quiet(run, ranks):
    result = run("repose-solve", PROJECT / "meshes/paper_jaw_advance.yaml", ranks=ranks)
    assert result.stderr == "" and "mm to go" not in result.stdout


def test_a_volume_shows_its_steps(environment, tmp_path):
    volume = volumes.write_meta(tmp_path / "ct.mha", volumes.samples())
    text = seen([programs() / "repose-isosurface", volume, "-level", "1000"], tmp_path, environment)
    assert "reading" in text and "isosurface" in text
    assert text.endswith("\r\x1b[K"), "the line is cleared at the end"
