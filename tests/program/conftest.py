"""Fixtures of the end-to-end tests: programs run as a person runs them, and a hang is a failure."""

import importlib.util
import os
import pathlib
import shutil
import signal
import subprocess

import pytest

RUNS_ALL = bool(os.environ.get("REPOSE_ALL"))  # tests/run.sh --all
RUNS_FEW = bool(os.environ.get("REPOSE_FEW"))  # tests/run.sh
PROJECT = pathlib.Path(__file__).resolve().parents[2]
TIME_LIMIT = 120  # seconds
PATIENCE = float(os.environ.get("REPOSE_PATIENCE", 1))  # limits times this: slow builds


def mpi_environment():
    """The environment that the scripts give mpirun, from the one place where it is written."""
    command = ". drivers/setup.sh && mpi_environment && env -0"
    text = subprocess.check_output(["bash", "-c", command], cwd=PROJECT).decode()
    return dict(entry.split("=", 1) for entry in text.split("\0") if entry)


def shipped(name, layers=4, edge=None):
    """The text of a shipped scene of the synthetic head, for any folder; with `edge` its skin is remeshed, mm."""
    text = (PROJECT / "meshes" / name).read_text().replace(": head_", f": {PROJECT}/meshes/head_")
    return text.replace("  layers: 4", f"  layers: {layers}" + (f"\n  edge: {edge}" if edge else ""), 1)


def programs():
    """The folder of the built programs (REPOSE_BIN, which ctest sets)."""
    if "REPOSE_BIN" not in os.environ:
        pytest.exit("REPOSE_BIN must name the folder of the built programs (build-ci/bin)", 1)
    return pathlib.Path(os.environ["REPOSE_BIN"]).resolve()


def finish(command, cwd, environment, time_limit):
    """Runs a command to its end; past the time limit, stops all it started and fails the test."""
    process = subprocess.Popen(
        command, cwd=cwd, env=environment, text=True, errors="replace", start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        stdout, stderr = process.communicate(timeout=PATIENCE * time_limit)
    except subprocess.TimeoutExpired:
        process.terminate()  # mpirun stops its ranks, which are not in its process group
        try:
            process.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
        waited = f"{PATIENCE * time_limit:g} s"
        pytest.fail(f"still running after {waited}: {' '.join(map(str, command))}")
    return subprocess.CompletedProcess(command, process.returncode, stdout, stderr)


def vtk_version():
    """(major, minor) of the VTK that this interpreter has, (0, 0) of none."""
    if importlib.util.find_spec("vtkmodules") is None:
        return 0, 0
    from vtkmodules.vtkCommonCore import vtkVersion
    return vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()


def can_draw():
    """Returns whether render.py can draw: without a display from VTK 9.4 on, else in memory."""
    older = vtk_version() > (0, 0) or shutil.which("pvbatch")
    return vtk_version() >= (9, 4) or bool(older and shutil.which("xvfb-run"))


def pytest_configure(config):
    config.addinivalue_line("markers", "long: runs only where REPOSE_ALL is set (tests/run.sh --all)")
    config.addinivalue_line("markers", "quick: runs where REPOSE_FEW is set (tests/run.sh), too")


def pytest_collection_modifyitems(config, items):
    """Deselects the long tests unless REPOSE_ALL is set, and all but the quick ones where REPOSE_FEW is."""
    def runs(item):
        if RUNS_FEW:
            return item.get_closest_marker("quick") and not item.get_closest_marker("long")
        return RUNS_ALL or not item.get_closest_marker("long")

    config.hook.pytest_deselected(items=[item for item in items if not runs(item)])
    items[:] = filter(runs, items)


def pytest_sessionfinish(session, exitstatus):
    """A file whose tests are all long is no failure."""
    if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED and not RUNS_ALL:
        session.exitstatus = pytest.ExitCode.OK


def some_on_ranks(cases, ranks, every=4):
    """Parameters (case, ranks): each case on one rank; on `ranks` all of them in the long run, else every fourth."""
    return [pytest.param(case, count, marks=[] if count == 1 or k % every == 0 else pytest.mark.long)
            for k, case in enumerate(cases) for count in (1, ranks)]


def expect_refusal(run, folder, words, *command, **settings):
    """Runs a program that must refuse its input in one line with all words, and change nothing in the folder."""
    before = sorted(folder.rglob("*"))
    result = run(*command, **settings)
    assert result.returncode == 1, result
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert [word for word in words if word not in result.stderr] == [], result.stderr
    assert sorted(folder.rglob("*")) == before


@pytest.fixture(scope="session")
def environment():
    return mpi_environment()


def runner(folder, environment):
    """run(program, *arguments, ranks=1, cwd=folder) → CompletedProcess with text output.

    On several ranks stderr is what the ranks wrote, without what mpirun adds when one fails.
    """

    def run_program(program, *arguments, ranks=1, cwd=folder, time_limit=TIME_LIMIT):
        command = [str(programs() / program), *map(str, arguments)]
        if ranks == 1:
            return finish(command, cwd, environment, time_limit)
        errors = folder / "stderr_of_the_ranks"
        errors.write_text("")
        wrapped = ["sh", "-c", f"exec \"$@\" 2>>'{errors}'", "sh", *command]
        result = finish(["mpirun", "-n", str(ranks), *wrapped], cwd, environment, time_limit)
        own_status = range(4)  # beyond: mpirun itself failed, and what it says counts
        if result.returncode in own_status:
            result.stderr = errors.read_text(errors="replace")
        errors.unlink()
        return result

    return run_program


@pytest.fixture
def run(tmp_path, environment):
    """Runs a program in the test's own folder, see runner."""
    return runner(tmp_path, environment)


@pytest.fixture
def folder(tmp_path):
    """The test's own folder, with the surfaces of the paper's head."""
    for file in (PROJECT / "meshes").glob("paper_*.ply"):
        (tmp_path / file.name).symlink_to(file)
    return tmp_path


@pytest.fixture(scope="session")
def solved(tmp_path_factory, environment):
    """solved(scene, *options, ranks=1) → the result file of a shipped scene (or a path), which must
    converge, and may be folded. The same is solved once only: tests change copies."""
    folder = tmp_path_factory.mktemp("solved")
    run_program, done = runner(folder, environment), {}

    def solve(scene, *options, ranks=1):
        key = (scene, *map(str, options), ranks)
        if key not in done:
            file = folder / f"{len(done)}.h5"
            result = run_program("repose-solve", PROJECT / "meshes" / scene, *options,
                                 "-allow_folded", "-output", file.with_suffix(""), ranks=ranks)
            assert (result.returncode, result.stderr) == (0, ""), result
            done[key] = file
        return done[key]

    return solve
