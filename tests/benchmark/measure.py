"""Runs programs for the benchmarks' scripts, and reads the messages of repose-solve."""

import contextlib
import dataclasses
import pathlib
import resource
import subprocess
import tempfile


@dataclasses.dataclass
class Run:
    """A program that has been run: its exit status, CPU s of it and its children, what it said."""
    status: int
    seconds: float
    text: str
    error: str

    @property
    def message(self):
        """Rows of repose-solve by their names; of those of one name, the last."""
        return {line[:24].strip(): line[25:] for line in self.text.splitlines()}

    @property
    def evaluations(self):
        """Evaluations of value and gradient, and of the Hessian, on the scene's own mesh."""
        words = self.message["evaluations"].split()
        return int(words[0]), int(words[5])

    @property
    def stages(self):
        """Seconds of each, and MiB used until its end."""
        rows = [line.split() for line in self.text.splitlines() if "MiB so far" in line]
        return {row[2]: (float(row[-6]), float(row[-4])) for row in rows}

    @property
    def memory(self):
        """The most, MiB."""
        return max(used for _, used in self.stages.values())


def run(command, folder=None, ranks=1, ends=(0, 2), **how):
    """Runs a program; leaves the script with its message unless its status is one of `ends`."""
    launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([*launcher, *map(str, command)], cwd=folder, stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, **how)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    if ends and done.returncode not in ends:
        raise SystemExit(done.stderr + done.stdout)
    return Run(done.returncode, seconds, done.stdout, done.stderr)


@contextlib.contextmanager
def synthetic(tools, size, scene):
    """A folder, as long as it is needed, with a synthetic head of so many skin vertices (head_*.ply)
    and scene.yaml."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run([tools / "repose-phantom", "-skin_vertices", size, "-bone_edge", 2, "-output", "head"],
            folder, ends=[0])
        (folder / "scene.yaml").write_text(scene)
        yield folder


def events(log):
    """Count and seconds of events of linear systems, from a -log_view."""
    found = {}
    for line in log.read_text(errors="replace").splitlines():
        words = line.split()
        if len(words) > 10 and words[0] in ("PCRenew", "PCApply", "MatMult", "RpHessianAction"):
            found[words[0]] = int(words[1]), float(words[3])
    return found
