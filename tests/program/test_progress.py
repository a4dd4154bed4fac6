"""Long work shows where it is on a terminal, under mpirun too, and nothing of that in a log."""

import contextlib
import os
import pty
import re
import signal
import subprocess
import threading

import pytest

import volumes
from conftest import PROJECT, TIME_LIMIT, programs


class Slowed:
    """A process that runs only a share of the time: what lasts a moment is seen on any machine."""

    def __init__(self, process, share):
        self._process = process
        self._share = share
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self.end()

    def end(self):
        self._over.set()
        self._thread.join()

    def _run(self):
        while not self._over.is_set() and self._process.poll() is None:
            self._process.send_signal(signal.SIGSTOP)
            self._over.wait(0.02 * (1 / self._share - 1))
            self._process.send_signal(signal.SIGCONT)
            self._over.wait(0.02)


def seen(command, folder, environment, slow_until=None, share=1):
    """Text that a terminal shows that is the command's stderr. If a pattern is given, the command
    runs only that share of the time until the text matches it."""
    try:
        ours, its = pty.openpty()
    except OSError as none:
        pytest.skip(f"this machine gives no terminal to look at: {none}")
    process = subprocess.Popen(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=its)
    os.close(its)
    text = b""
    with Slowed(process, share) if slow_until else contextlib.nullcontext() as slowed:
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            text += part
            if slow_until and re.search(slow_until, text.decode(errors="replace")):
                slowed.end()
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


def small_head(environment, folder, vertices=4000):
    subprocess.run([programs() / "repose-phantom", "-skin_vertices", str(vertices), "-output", "head"],
                   cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)


@pytest.mark.long
def test_a_model_that_takes_long_shows_that_it_is_built(environment, tmp_path):
    small_head(environment, tmp_path, 8000)
    built = r"\[#+\.+\] building the model  \d+ s  about \d+ s left"
    text = seen([programs() / "repose-solve", "head_jaw_advance.yaml", "-dry_run"], tmp_path, environment,
                slow_until=built, share=0.04)
    assert re.search(built, text) and text.endswith("\r\x1b[K")


@pytest.mark.long
def test_the_path_that_is_verified_has_a_bar(environment, tmp_path):
    small_head(environment, tmp_path)
    text = seen([programs() / "repose-solve", "head_jaw_advance.yaml", "-verify_path", "-accuracy", "1"],
                tmp_path, environment)
    assert re.search(r"\[#*\.+\] verifying the path: load \d", text)


@pytest.mark.long
def test_estimates_have_a_bar_with_the_time_left(environment, tmp_path):
    small_head(environment, tmp_path)
    estimated = r"\[#+\.+\] estimating sensitivities  \d+ s  about \d+ s left"
    text = seen([programs() / "repose-solve", "head_jaw_advance.yaml", "-sensitivity", "-accuracy", "1"],
                tmp_path, environment, slow_until=estimated, share=0.25)
    assert re.search(estimated, text)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_log_stays_quiet(run, ranks):
    result = run("repose-solve", PROJECT / "meshes/paper_jaw_advance.yaml", ranks=ranks)
    assert result.stderr == "" and "mm to go" not in result.stdout


@pytest.mark.quick
def test_a_volume_shows_its_steps(environment, tmp_path):
    volume = volumes.write_meta(tmp_path / "ct.mha", volumes.samples())
    text = seen([programs() / "repose-isosurface", volume, "-level", "1000"], tmp_path, environment)
    assert "reading" in text and "isosurface" in text
    assert text.endswith("\r\x1b[K"), "the line is cleared at the end"
