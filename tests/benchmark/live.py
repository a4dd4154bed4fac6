#!/usr/bin/env python3
"""Measures how soon and well a face follows its plan: random changes, repose-live beside repose-solve.

    tests/benchmark/live.py [-bin build/bin] [-head ../shared/data/head] [-changes 30]
                            [-output docs/measurements/live.md]

CPU seconds on one core, all in one run, so that their ratios count and not the machine's load. The
changes are random: each component of one piece up to 1 mm or 1° from the scene's plan, or up to 2 or 4, a
quarter as many. A scene of a real head is passed over where it is missing. Needs: apt-get install --no-install-recommends
python3-numpy
"""

import pathlib
import shutil
import sys
import tempfile
import time

import numpy as np

from measure import run
from page import PROJECT, option_parser, print_table

sys.path.insert(0, str(PROJECT / "drivers/python"))
import repose  # noqa: E402

PLAN = """plan:
  pieces: [mandible]
  box: {translate: [12, 12, 12], rotate: [14, 14, 14]}
"""
SIZES = (1, 2, 4)  # mm and degrees
HEAD = "| | " + " | ".join([
    "points of the skin", "`repose-solve`, s", "from rest, s", "exact face, s: median, 95 %",
    "not converged", "derivatives, s", "preview, ms"]) + " |\n|---|--:|--:|--:|--:|--:|--:|--:|"
ERRORS = "| | mm or degrees | preview error, mm: 95 % of the skin, largest | exact face, s |\n|---|--:|--:|--:|"


def scenes(folder, head):
    """Name and path of each scene, copied beside its meshes."""
    yield "shipped head, three pieces", folder / "head_live.yaml"
    if (head / "skin.ply").is_file():
        for mesh in head.glob("*.ply"):
            (folder / mesh.name).symlink_to(mesh)
        path = folder / "real_head_mouth.yaml"
        path.write_text(path.read_text() + PLAN)
        yield "real head, parted lips", path


def varied(plan, piece, change):
    """The plan with six numbers added to the motion of a piece."""
    motion = plan[piece]
    return {**plan, piece: {"translate": np.add(motion["translate"], change[:3]).tolist(),
                            "rotate": np.add(motion["rotate"], change[3:]).tolist()}}


def preview(face, piece, change):
    began = time.process_time()
    position = face.position + face.tangent.displacement(
        {piece: {"translate": change[:3], "rotate": change[3:]}})
    return position, time.process_time() - began


def measure(name, path, chosen, random):
    cold = run([chosen.bin / "repose-solve", path, "-output", "cold"], path.parent, 1)
    assert cold.status == 0, cold
    errors = []
    with repose.Session(path, program=chosen.bin / "repose-live") as session:
        plan = session.scene_plan
        rest = session.solve(plan, base="rest").info["seconds"]
        session.solve(plan)
        alone = session.solve(plan).info["seconds"]
        face = session.solve(plan, tangents=True)
        tangents = face.info["seconds"] - alone
        exact, shown, failed = [], [], 0
        for size in SIZES:
            off, seconds = [], []
            for _ in range(chosen.changes if size == SIZES[0] else -(-chosen.changes // 4)):
                piece = session.pieces[random.integers(len(session.pieces))].name
                change = random.uniform(-size, size, 6)
                predicted, took = preview(face, piece, change)
                found = session.solve(varied(plan, piece, change))
                seconds.append(found.info["seconds"])
                failed += not found.converged and size == SIZES[0]
                if found.converged:
                    off.append(np.linalg.norm(predicted - found.position, axis=1))
                shown.append(took)
            off = np.array(off)
            errors.append(f"| {name} | {size} | {np.median(np.percentile(off, 95, axis=1)):.3f}, "
                          f"{np.median(off.max(axis=1)):.2f} | {np.median(seconds):.2f} |")
            exact += seconds if size == SIZES[0] else []
        points = len(session.initial)
    return (f"| {name} | {points} | {cold.seconds:.2f} | {rest:.2f} | {np.median(exact):.2f}, "
            f"{np.percentile(exact, 95):.2f} | {failed} of {len(exact)} | {tangents:.2f} | {1000 * np.median(shown):.1f} |"), errors


def rows(chosen, errors):
    with tempfile.TemporaryDirectory() as name:
        folder, random = pathlib.Path(name), np.random.default_rng(7)
        for file in (PROJECT / "meshes").glob("*head*"):
            shutil.copy(file, folder)
        for scene, path in scenes(folder, chosen.head):
            row, more = measure(scene, path, chosen, random)
            errors += more
            yield row


def main():
    parser = option_parser(__doc__, changes=30)
    parser.add_argument("-head", type=pathlib.Path, default=PROJECT.parent / "shared/data/head")
    chosen, errors = parser.parse_args(), []
    print_table(HEAD, rows(chosen, errors), chosen.output, "speed")
    print_table(ERRORS, errors, chosen.output, "errors")


if __name__ == "__main__":
    main()
