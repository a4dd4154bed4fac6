#!/usr/bin/env python3
"""What searching only the tissue that feels a move costs: a table.

    tests/benchmark/active_region.py [-bin build/bin] [-sizes 2000,8000] [-whole 8000]
                                     [-output docs/measurements/active_region.md] [-mark measured]

Synthetic heads of the given numbers of skin vertices, 4 layers, springs by moduli with s_ref = r_0,
penalty volume term, the chin cut off and moved 8 mm forward, solved to 0.1 mm: with -active_region
on; as a head cropped to the columns that were active, as a surgeon's assistant might have cut it
out by hand; and, up to -whole vertices, with -active_region off. CPU seconds of whole programs.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import numpy as np

from measure import run, synthetic
from page import option_parser, print_table
from tissue import last, model_of

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
  volume: {form: penalty, poisson: 0.4967}
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
    solved = run([program, "scene.yaml", "-output", "result", *options], folder)
    stages = {name: seconds for name, (seconds, _) in solved.stages.items()}
    model, rest = model_of(folder / "result.h5"), last(folder / "result.h5")
    column = model["point/column"]
    moved = (model["point/set"] == 0) & (rest["point/displacement"] != 0).any(axis=1)
    active = np.zeros(column.max() + 1, bool)
    active[column[moved]] = True
    return {"unknowns": int(solved.said["unknowns"].split()[0]), "memory": solved.memory,
            "points": len(column), "hessians": solved.evaluations[1], "seconds": solved.seconds,
            "search": stages["solve"], "before": sum(stages.values()) - stages["solve"] -
            stages["write"], "error": rest["displacement_error"], "converged": solved.status == 0,
            "position": rest["point/position"], "active": active}


def row(size, way, found, cropped, distance):
    said = f"{found['error']:.3f}" if found["converged"] else "NOT CONVERGED"
    return (f"| {size} | {found['points']} | {way} | {found['unknowns']} | {found['hessians']} | "
            f"{found['before']:.1f} | {found['search']:.1f} | {found['seconds']:.1f} | "
            f"{found['seconds'] / cropped['seconds']:.2f} | {found['memory']:.0f} | {said} | "
            f"{distance} |")


def rows_of(size, with_whole, tools):
    with synthetic(tools, size, SCENE) as folder:
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


def main():
    chosen = option_parser(__doc__, sizes="2000,8000", whole=8000, mark="measured").parse_args()
    print_table(HEAD, (line for size in map(int, chosen.sizes.split(","))
                       for line in rows_of(size, size <= chosen.whole, chosen.bin)), chosen.output,
                chosen.mark)


main()
