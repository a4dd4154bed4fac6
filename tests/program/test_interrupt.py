"""A run that is told to end keeps the state it has, says how far that is from rest, and can go on."""

import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest

from conftest import PROJECT, TIME_LIMIT, programs
from tissue import apart, last, steps

SCENE = PROJECT / "meshes/head_springs_opening.yaml"


def begin(folder, environment, *arguments, ranks=1):
    """Starts a solve that prints a line for every iteration."""
    command = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    return subprocess.Popen(
        [*command, programs() / "repose-solve", *map(str, arguments), "-monitor_mm"], cwd=folder,
        env=environment, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE)


def iterations(process, count):
    """Reads until so many lines of iterations have come; returns what was read."""
    lines, seen = [], 0
    while seen < count:
        lines.append(process.stdout.readline())
        assert lines[-1], "the run ended before"
        seen += "evaluations" in lines[-1] and "iteration" in lines[-1]
    return "".join(lines)


def interrupted(folder, environment, command, sent):
    """Runs a solve and sends it a signal once it has written a first line for an iteration."""
    process = begin(folder, environment, SCENE, "-output", "early", ranks=2 if command else 1)
    text = iterations(process, 1)
    process.send_signal(sent)
    rest, _ = process.communicate(timeout=TIME_LIMIT)
    return process.returncode, text + rest


def ranks_of(process):
    """Process ids of what mpirun has started."""
    children = f"/proc/{process.pid}/task/{process.pid}/children"
    return [int(pid) for pid in open(children).read().split()]


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


def building(folder, environment, **settings):
    """Starts a solve and waits until it has begun to build its model."""
    process = subprocess.Popen([programs() / "repose-solve", SCENE, "-output", "early"], cwd=folder, env=environment,
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **settings)
    lock = folder / "early.lock"
    while not (lock.exists() and lock.stat().st_size):
        assert process.poll() is None, process.stderr.read()
    return process


@pytest.mark.quick
@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_before_the_search_leaves_no_file(environment, tmp_path, sent):
    """But for the folder of its own that Open MPI 5 makes in any case. With that, UCX takes SIGHUP."""
    if sent == signal.SIGHUP and "libucs" in subprocess.check_output(["ldd", programs() / "repose-solve"], text=True):
        pytest.skip("UCX takes the signal, which ends no program then")
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    process = building(tmp_path, {**environment, "TMPDIR": str(temporary)})
    process.send_signal(sent)
    process.communicate(timeout=TIME_LIMIT)
    assert process.returncode == -sent
    assert [path for path in tmp_path.rglob("*") if "/ompi." not in str(path)] == [temporary]


def test_a_run_that_ignores_hang_ups_goes_on(environment, tmp_path):
    """nohup makes a run ignore them."""
    process = building(tmp_path, environment, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=TIME_LIMIT)
    assert process.returncode == 0 and (tmp_path / "early.h5").exists()


@pytest.fixture
def busy():
    """Two processes that take what they get of the processors; the function that ends them."""
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]

    def end():
        for loop in loops:
            loop.kill()
            loop.wait()
    yield end
    end()


@pytest.mark.parametrize("lines", [1, *[pytest.param(lines, marks=pytest.mark.long)
                                        for lines in (6, 1, 1, 1, 6, 6, 6)]])
def test_ctrl_c_at_mpirun_leaves_a_result_though_ranks_are_killed(run, environment, tmp_path, busy,
                                                                  lines):
    process = begin(tmp_path, environment, SCENE, "-output", "early", ranks=2)
    iterations(process, lines)
    process.send_signal(signal.SIGINT)
    text, _ = process.communicate(timeout=TIME_LIMIT)
    busy()
    assert process.returncode != 0
    step = last(tmp_path / "early.h5")
    assert step["converged"] == (step["load"] == 1)  # it may end before it is killed
    assert run("repose-check", "early.h5").returncode == 0
    again = run("repose-solve", SCENE, "-restart", "early.h5", "-output", "early")
    assert (again.returncode, again.stderr) == (0, "")
    assert not list(tmp_path.glob("*.part")) + list(tmp_path.glob("*.lock"))


def test_a_batch_system_that_ends_the_ranks_is_heard(run, environment, tmp_path):
    process = begin(tmp_path, environment, SCENE, "-output", "early", ranks=2)
    iterations(process, 1)
    assert len(ranks_of(process)) == 2
    for rank in ranks_of(process):
        os.kill(rank, signal.SIGTERM)
    text, _ = process.communicate(timeout=TIME_LIMIT)
    assert process.returncode == 2 and "NOT CONVERGED" in text
    assert run("repose-check", "early.h5").returncode == 0


FORCES = "forces:\n  - {at: [47, -80, 8], radius: 8, force: [0, -3, 0]}\ntearing: {limit: 0.5}\n"
BALL = ("instruments:\n  - {sphere: {center: [63, -98, -10], radius: 20}, push: [-9, 12, 0], "
        "skin: slide}\n")


def in_rounds(folder, rounds):
    """A scene whose search goes in rounds, of contact or of tearing."""
    head = (PROJECT / "meshes/paper_jaw_advance.yaml").read_text().partition("moves:")[0]
    head = head.replace("{stiffness: 1.0,", "{modulus: 0.05,")
    (folder / "rounds.yaml").write_text(head + rounds + "solve:\n  volume: {form: penalty}\n")
    return folder / "rounds.yaml"


@pytest.mark.parametrize("rounds, row, lines", [
    (BALL, "stopped before it was done", 1),
    (FORCES, "tearing +NOT SETTLED.*, STOPPED BY A SIGNAL OR THE TIME LIMIT", 1)],
    ids=["contact", "tearing"])
def test_a_signal_ends_all_rounds(run, environment, folder, rounds, row, lines):
    process = begin(folder, environment, in_rounds(folder, rounds), "-output", "early",
                    "-accuracy", 1e-9)
    iterations(process, lines)
    process.send_signal(signal.SIGTERM)
    text, errors = process.communicate(timeout=TIME_LIMIT)
    assert (process.returncode, errors) == (2, "") and "NOT CONVERGED" in text
    assert re.search(row, text)
    end = last(folder / "early.h5")
    assert end["converged"] == 0 and re.search(b"stopped before|signal", end["reason"])
    assert text.count("iteration") - text.count("iterations") < 5
    assert run("repose-check", "early.h5").returncode == 0


def test_a_time_limit_is_that_of_all_rounds(run, folder):
    scene = in_rounds(folder, FORCES)
    result = run("repose-solve", scene, "-time_limit", 0, "-output", "early")
    assert result.returncode == 2
    assert re.search(r"tearing +NOT SETTLED.*, STOPPED", result.stdout)
    assert last(folder / "early.h5")["converged"] == 0


def test_a_time_limit_does_the_same_and_the_run_can_go_on(run, solved, tmp_path):
    result = run("repose-solve", SCENE, "-time_limit", 0, "-output", "early")
    assert result.returncode == 2 and "stopped before it was done" in result.stdout
    early = last(tmp_path / "early.h5")
    assert early["load"] < 1 and early["displacement_error"] > 0
    again = run("repose-solve", SCENE, "-restart", "early.h5", "-output", "late", "-accuracy", 1e-4)
    assert again.returncode == 0, again
    whole = solved(SCENE, "-accuracy", 1e-4)
    assert apart(last(tmp_path / "late.h5"), last(whole)) < 2e-4


@pytest.mark.quick
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
    assert to_go[-1] < 1e-6 * to_go[0] and to_go[-1] < 1e-3
    assert steps(tmp_path / "seen.h5")[-1]["displacement_error"] <= 1e-6


def test_without_the_monitor_nothing_is_said_about_iterations(run):
    result = run("repose-solve", PROJECT / "meshes/paper_jaw_advance.yaml", "-output", "quiet")
    assert "mm to go" not in result.stdout and result.stderr == ""

