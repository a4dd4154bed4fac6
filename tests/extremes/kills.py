#!/usr/bin/env python3
"""Runs that are killed (SIGKILL) at random moments: the last complete result and checkpoint stay
readable,
and the next run of the name goes on.

    tests/extremes/kills.py -bin build-ci/bin              # 50 kills
    tests/extremes/kills.py -bin build-ci/bin -count 4
"""

import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "benchmark"), str(HERE.parent / "program")]

import numpy as np  # noqa: E402

from conftest import PROJECT, mpi_environment  # noqa: E402
from page import option_parser  # noqa: E402
from tissue import last  # noqa: E402

SCENE = PROJECT / "meshes/paper_jaw_opening.yaml"
LONG = ["-accuracy", "1e-7", "-load_steps", "10"]


class Runs:
    def __init__(self, programs, folder):
        self.programs, self.folder, self.environment = programs, folder, mpi_environment()

    def begin(self, *options):
        command = [self.programs / "repose-solve", SCENE, "-output", "face", *options]
        return subprocess.Popen(
            list(map(str, command)),
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def whole(self, *options):
        """Seconds that a run to its end takes."""
        begin = time.monotonic()
        process = self.begin(*options)
        _, errors = process.communicate()
        assert process.returncode == 0 and errors == "", errors
        return time.monotonic() - begin

    def killed(self, after):
        """Kills a run after so many seconds; whether it was still there to be killed."""
        process = self.begin(*LONG, "-checkpoint_interval", "0.01")
        time.sleep(after)
        alive = process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.communicate()
        return alive

    def readable(self, file):
        checked = subprocess.run(
            [self.programs / "repose-check", file],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
        )
        assert checked.returncode == 0, checked.stderr
        return last(self.folder / file)


def kill_again_and_again(runs, count, random_numbers):
    """Returns how many runs were killed before their end, and how many of them left a
    checkpoint."""
    runs.whole()
    seconds = max(runs.whole(*LONG), 0.2)
    end = last(runs.folder / "face.h5")
    killed = checkpoints = 0
    while killed < count:
        checkpoint = runs.folder / "face_checkpoint.h5"
        checkpoint.unlink(missing_ok=True)
        killed += runs.killed(random_numbers.uniform(0, seconds))
        step = runs.readable("face.h5")
        assert np.abs(step["point/position"] - end["point/position"]).max() < 1e-6
        if checkpoint.exists():
            checkpoints += 1
            assert np.isfinite(runs.readable(checkpoint.name)["point/position"]).all()
    return killed, checkpoints


def main():
    parser = option_parser(__doc__, count=50, seed=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(arguments.bin, pathlib.Path(folder))
        killed, checkpoints = kill_again_and_again(
            runs, arguments.count, random.Random(arguments.seed)
        )
        restart = (
            ["-restart", "face_checkpoint.h5"]
            if checkpoints and (runs.folder / "face_checkpoint.h5").exists()
            else []
        )
        runs.whole(*LONG, *restart)
        left = sorted(os.listdir(folder))
        assert not any(name.endswith((".part", ".lock")) for name in left), left
    print(
        f"{killed} runs killed: every result readable, {checkpoints} checkpoints left and readable;"
        " the next run of the name leaves nothing of theirs"
    )


if __name__ == "__main__":
    sys.exit(main())
