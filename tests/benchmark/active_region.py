#!/usr/bin/env python3
"""What searching only the tissue that feels a move costs: a table.

    tests/benchmark/active_region.py [-bin build/bin] [-sizes 2000,8000] [-whole 8000]
                                     [-output docs/active_region.md]

Synthetic heads of the given numbers of skin vertices, 4 layers, springs by moduli with s_ref = r_0,
penalty volume term, the chin cut off and moved 8 mm forward, solved to 0.1 mm: with -active_region
on; as a head cropped to the columns that were active, as a surgeon's assistant might have cut it
out by hand; and, up to -whole vertices, with -active_region off. CPU seconds of whole programs.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import argparse
import pathlib
import subprocess
import tempfile

import h5py
import numpy as np

from page import PROJECT, children, print_table

SCENE = """skin: SKIN
bones:
  - {name: skull, file: head_skull.ply}
  - {name: mandible, file: head_mandible.ply}
tissue:
  layers: 4
  release: 5
  springs:
    default: {modulus: 0.05, law: quartic, reference: initial}
osteotomies:
  - bone: mandible
    piece: chin
    planes: [{point: [0, -88, -52], normal: [0, -0.42, -0.91]}]
    kerf: 0.5
moves:
  - {bone: chin, translate: [0, -8, 0]}
solve:
  volume: {form: penalty}
"""
HEAD = ("| skin vertices | points | way | unknowns | Hessians | before the search, s | search, s | "
        "CPU of all, s | of the cropped | memory, MiB | error said, mm | from the whole, mm |\n"
        "|--:|--:|---" + "|--:" * 9 + "|")
FACE = np.dtype([("corners", "u1"), ("vertices", "<i4", 3)])


def read_ply(file):
    """Points and triangles of a mesh as repose-phantom writes it."""
    head, data = file.read_bytes().split(b"end_header\n", 1)
    points, faces = (int(line.split()[-1]) for line in head.decode().splitlines()
                     if line.startswith("element"))
    return (np.frombuffer(data, "<f8", 3 * points).reshape(-1, 3),
            np.frombuffer(data, FACE, faces, 24 * points)["vertices"])


def write_ply(file, points, triangles):
    faces = np.zeros(len(triangles), FACE)
    faces["corners"], faces["vertices"] = 3, triangles
    head = ("ply\nformat binary_little_endian 1.0\ncomment mm\n"
            f"element vertex {len(points)}\n" + "".join(f"property double {c}\n" for c in "xyz")
            + f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    file.write_bytes(head.encode() + points.astype("<f8").tobytes() + faces.tobytes())


def crop(folder, active):
    """Writes the skin's triangles around active columns."""
    points, triangles = read_ply(folder / "head_skin.ply")
    kept = triangles[active[triangles].any(axis=1)]
    vertices, numbers = np.unique(kept, return_inverse=True)
    write_ply(folder / "cropped_skin.ply", points[vertices], numbers.reshape(-1, 3))


def solve(program, folder, skin, *options):
    """One solve: what it says, CPU s, and the positions at rest."""
    (folder / "scene.yaml").write_text(SCENE.replace("SKIN", skin))
    before = children().ru_utime
    done = subprocess.run([program, "scene.yaml", "-output", "result", *options], cwd=folder,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True)
    seconds = children().ru_utime - before
    if done.returncode == 1:
        raise SystemExit(done.stderr)
    stages = {line.split()[2]: float(line.split()[-6]) for line in done.stdout.splitlines()
              if "MiB so far" in line}
    memory = max(float(line.split()[-4]) for line in done.stdout.splitlines() if "so far" in line)
    work = next(line for line in done.stdout.splitlines() if "of the Hessian" in line)
    unknowns = next(line for line in done.stdout.splitlines() if "  unknowns" in line)
    with h5py.File(folder / "result.h5") as h5:
        last = h5["step"][max(h5["step"])]
        column, soft = h5["model/point/column"][()], h5["model/point/set"][()] == 0
        move = last["point/displacement"][()]
        found = {"unknowns": int(unknowns.split()[1]), "memory": memory, "points": len(column),
                 "hessians": int(work.split("gradient,")[1].split()[0]), "seconds": seconds,
                 "search": stages["solve"], "before": sum(stages.values()) - stages["solve"] -
                 stages["write"], "error": last.attrs["displacement_error"],
                 "converged": done.returncode == 0, "position": last["point/position"][()]}
    active = np.zeros(column.max() + 1, bool)
    active[column[soft & (move != 0).any(axis=1)]] = True
    return found | {"active": active}


def row(size, way, found, cropped, distance):
    said = f"{found['error']:.3f}" if found["converged"] else "NOT CONVERGED"
    return (f"| {size} | {found['points']} | {way} | {found['unknowns']} | {found['hessians']} | "
            f"{found['before']:.1f} | {found['search']:.1f} | {found['seconds']:.1f} | "
            f"{found['seconds'] / cropped['seconds']:.2f} | {found['memory']:.0f} | {said} | "
            f"{distance} |")


def rows_of(size, with_whole, tools):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([tools / "repose-phantom", "-skin_vertices", str(size), "-bone_edge", "2",
                        "-output", "head"], cwd=folder, check=True, capture_output=True)
        program = tools / "repose-solve"
        region = solve(program, folder, "head_skin.ply", "-active_region", "on")
        crop(folder, region["active"])
        cropped = solve(program, folder, "cropped_skin.ply", "-active_region", "off")
        distance = ""
        if with_whole:
            whole = solve(program, folder, "head_skin.ply", "-active_region", "off")
            distance = f"{np.linalg.norm(region['position'] - whole['position'], axis=1).max():.3f}"
            yield row(size, "whole", whole, cropped, "0")
        yield row(size, "active region", region, cropped, distance)
        yield row(size, "cropped", cropped, cropped, "")


def arguments():
    parser = argparse.ArgumentParser(prog="active_region.py", description=__doc__, add_help=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("-bin", type=pathlib.Path, default=PROJECT / "build/bin")
    parser.add_argument("-sizes", default="2000,8000")
    parser.add_argument("-whole", type=int, default=8000)
    parser.add_argument("-output", type=pathlib.Path)
    return parser.parse_args()


def main():
    chosen = arguments()
    sizes, tools = map(int, chosen.sizes.split(",")), chosen.bin.resolve()
    print_table(HEAD, (line for size in sizes for line in rows_of(size, size <= chosen.whole, tools)),
                chosen.output)


main()
