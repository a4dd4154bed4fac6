"""A run that is told to end keeps the state it has, says how far that is from rest, and can go on."""

import re
import signal
import subprocess

import numpy as np
import pytest

from conftest import PROJECT, programs
from tissue import apart, last, steps

SCENE = PROJECT / "meshes/head_jaw_opening.yaml"


def interrupted(folder, environment, command, sent):
    """Runs a solve and sends it a signal once it has written a first line for an iteration."""
    process = subprocess.Popen(
        [*command, programs() / "repose-solve", SCENE, "-monitor_mm", "-output", "early"], cwd=folder,
        env=environment, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE)
    lines = []
    for line in process.stdout:
        lines.append(line)
        if "evaluations" in line and "iteration" in line:
            process.send_signal(sent)
            break
    rest, _ = process.communicate(timeout=60)
    return process.returncode, "".join(lines) + rest


@pytest.mark.parametrize("command, sent", [([], signal.SIGINT), ([], signal.SIGTERM),
                                           (["mpirun", "-n", "2"], signal.SIGUSR1)],
                         ids=["ctrl-c", "term", "batch"])
def test_a_signal_ends_the_run_and_keeps_its_state(run, environment, tmp_path, command, sent):
    status, text = interrupted(tmp_path, environment, command, sent)
    assert status == 2 and "NOT CONVERGED" in text and "stopped before it was done" in text
    step = last(tmp_path / "early.h5")
    assert step["converged"] == 0 and step["load"] < 1 and b"stopped" in step["reason"]
    assert run("repose-check", "early.h5").returncode == 0
    assert not list(tmp_path.glob("*.part"))


def test_a_time_limit_does_the_same_and_the_run_can_go_on(run, solved, tmp_path):
    result = run("repose-solve", SCENE, "-time_limit", 0, "-output", "early")
    assert result.returncode == 2 and "stopped before it was done" in result.stdout
    early = last(tmp_path / "early.h5")
    assert early["load"] < 1 and early["displacement_error"] > 0
    again = run("repose-solve", SCENE, "-restart", "early.h5", "-output", "late", "-accuracy", 1e-4)
    assert again.returncode == 0, again
    whole = solved(SCENE, "-accuracy", 1e-4)
    assert apart(last(tmp_path / "late.h5"), last(whole)) < 2e-4


def test_the_monitor_shows_the_estimate_falling(run, tmp_path):
    scene = PROJECT / "meshes/paper_jaw_advance.yaml"
    result = run("repose-solve", scene, "-monitor_mm", "-accuracy", 1e-6, "-load_steps", 1,
                 "-tao_type", "lmvm", "-output", "seen")
    assert result.returncode == 0
    rows = re.findall(r"^ +([\d.]+) s  load ([\d.]+)  iteration +(\d+) +(\d+) evaluations  ([\d.e+-]+)"
                      r" mm to go$", result.stdout, re.M)
    seconds, load, iteration, evaluations, to_go = np.array(rows, float).T
    assert len(rows) > 20 and (load <= 1).all()
    assert (np.diff(seconds) >= 0).all() and (np.diff(evaluations) >= 0).all()
    assert to_go[-1] < 1e-4 * to_go[0] and to_go[-1] < 1e-4
    assert steps(tmp_path / "seen.h5")[-1]["displacement_error"] <= 1e-6


def test_without_the_monitor_nothing_is_said_about_iterations(run):
    result = run("repose-solve", PROJECT / "meshes/paper_jaw_advance.yaml", "-output", "quiet")
    assert "mm to go" not in result.stdout and result.stderr == ""

