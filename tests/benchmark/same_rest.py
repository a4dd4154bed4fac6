#!/usr/bin/env python3
"""Compares the rest positions of two builds on every shipped scene:

    tests/benchmark/same_rest.py BEFORE/bin build-ci/bin [-scenes head_solid,paper_jaw_advance]

solves each scene with both builds on one rank and prints the largest distance between the two last
positions in mm, and the ratio of the CPU times. Exit status 1 where a distance exceeds -tolerance.
The scenes of the real head need its folder, -data; a scene whose surfaces are absent is reported as
skipped."""

import argparse
import pathlib
import sys
import tempfile

import h5py
import numpy as np
from measure import run

PROJECT = pathlib.Path(__file__).resolve().parents[2]
MESHES = PROJECT / "meshes"


def rest(programs, scene, folder):
    """(positions of the last load step or None, CPU s, the program's message)."""
    done = run([programs / "repose-solve", scene, "-output", folder / "rest"], ends=())
    if done.status not in (0, 2):
        return None, done.seconds, done.error.strip()
    with h5py.File(folder / "rest.h5") as h5:
        last = h5["step"][max(h5["step"])]
        return last["point/position"][:], done.seconds, ""


def compare(before, after, name, data):
    """The largest distance (mm) and after's CPU time in before's, or None and a reason."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for file in [*MESHES.iterdir(), *(data.iterdir() if data.is_dir() else ())]:
            if not (folder / file.name).exists():
                (folder / file.name).symlink_to(file.resolve())
        scene = folder / f"{name}.yaml"
        found = [rest(programs, scene, folder) for programs in (before, after)]
    (one, seconds, why), (other, again, also) = found
    if one is None and other is None:
        return None, f"skipped: {why}"
    if one is None or other is None or one.shape != other.shape:
        return np.inf, f"one build has no such result: {why or also or 'sizes differ'}"
    return np.linalg.norm(one - other, axis=1).max(), f"{again / seconds:.2f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("before", type=pathlib.Path)
    parser.add_argument("after", type=pathlib.Path)
    parser.add_argument("-scenes", default=",".join(sorted(p.stem for p in MESHES.glob("*.yaml"))))
    parser.add_argument("-data", type=pathlib.Path, default=PROJECT.parent / "shared/data/head")
    parser.add_argument("-tolerance", type=float, default=1e-9, help="mm")
    chosen = parser.parse_args()
    worst = 0
    for name in chosen.scenes.split(","):
        distance, note = compare(chosen.before.resolve(), chosen.after.resolve(), name, chosen.data)
        print(f"{name:28} {'-' if distance is None else f'{distance:.1e} mm'}  {note}", flush=True)
        worst = max(worst, distance or 0)
    sys.exit(int(worst > chosen.tolerance))


if __name__ == "__main__":
    main()
