#!/usr/bin/env python3
"""Ratios of soft to hard tissue of five operations on a real head, or on synthetic heads of random
proportions, against published ones. Landmarks are those that repose-landmarks proposes, cuts are
templates, moves are in the words of surgery.

    tests/benchmark/ratios.py [-bin build/bin] [-output docs/measurements/ratios.md] [-edge 4]
                              [-head ../shared/data/head] [-phantoms 12]
                              [-ways "default;bonded lips"] [-operations "advance,set-back"]
                              [-first 1] [-keep FOLDER] [-variants "all"]

The folder of the head holds skin.ply, skull.ply and mandible.ply. With -phantoms so many synthetic
heads take its place, numbered from -first, solved in the first of the ways. With -variants (some
of VARIANTS, or all) the head is mirrored, turned, scaled or cropped, or its landmarks are moved at
random. Needs
apt-get install --no-install-recommends python3-h5py python3-meshio python3-scipy
"""

import argparse
import json
import pathlib
import sys
import tempfile

import meshio
import numpy as np
from scipy.spatial.transform import Rotation

from measure import run
from page import option_parser, print_table
from phantom_heads import Shape, write_surfaces
from heads import BONES, DATA  # page knows where it is
from sheet.landmarks import read_landmarks  # page knows where it is
from sheet.published import PUBLISHED
from tissue import last, model_of

# Operation → bone, template, clinical move and mm.
OPERATIONS = {
    "advance": ("mandible", "sagittal_split", "advance: 5", 5),
    "set-back": ("mandible", "sagittal_split", "set_back: 5", 5),
    "chin": ("mandible", "genioplasty", "advance: 8", 8),
    "Le Fort I": ("skull", "le_fort_1", "advance: 5", 5),
    "impaction": ("skull", "le_fort_1", "impaction: 4", 4)}
NAMES = {"pronasale": "pronasale", "subnasale": "subnasale", "upper_lip": "labrale superius",
         "lower_lip": "labrale inferius", "b_soft": "B′", "pogonion_soft": "pogonion′"}
# Way → anatomy and tissue.
WAYS = {"default": ("", ""), "bonded lips": (", vestibule: off", ""),
        "no adhesion": (", adhesion: 0", ""), "gap 2": (", gap: 2", ""), "release 5": ("", ", release: 5"),
        "skin 0.15": ("", ", material: {preset: face, skin: {thickness: 1.5, young: 0.15}}"),
        "joined lips": (", lips: joined", ""), "septum 0.2": (", septum: 0.2", ""),
        "septum 1": (", septum: 1", ""), "no tone": (", tone: 0", ""),
        "tone 4": (", tone: 0.004", ""), "tone 8": (", tone: 0.008", ""),
        "lower gap 1": (", lower_gap: 1", ""), "lower gap 2": (", lower_gap: 2", ""),
        "lower gap 4": (", lower_gap: 4", ""),
        "no tone, lower gap 1": (", tone: 0, lower_gap: 1", "")}
LIMIT = 240  # s, of a search


def turned(*rotation):
    """The head turned by so many degrees about x, y and z."""
    return lambda points: points @ Rotation.from_euler("xyz", rotation, degrees=True).as_matrix().T


# Variant of the head → how its points are moved, mm by which its skin is cropped from below, and
# standard deviation of its landmarks, mm.
VARIANTS = {
    "mirrored": (lambda points: points * [-1, 1, 1], 0, 0),
    "0.9 times": (lambda points: 0.9 * points, 0, 0),
    "1.1 times": (lambda points: 1.1 * points, 0, 0), "yaw 5": (turned(0, 0, 5), 0, 0),
    "roll 5": (turned(0, 5, 0), 0, 0), "chin up 10": (turned(-10, 0, 0), 0, 0),
    "chin down 10": (turned(10, 0, 0), 0, 0), "cropped": (lambda points: points, 8, 0),
    "landmarks ± 1": (lambda points: points, 0, 1)}

PHANTOM_HEAD = ("| operation, mm | landmark | published | median | lowest … highest | below, above |\n"
                "|---|---|---|--:|--:|--:|")


def landmarks_of(options, folder):
    """The landmarks of the head, proposed, in a folder; name → mm."""
    done = run([options.bin / "repose-landmarks", options.head / "skin.ply", "-skull",
                options.head / "skull.ply", "-mandible", options.head / "mandible.ply", "-output",
                folder / "head"], folder, ends=None)
    if done.status != 0:
        raise SystemExit(done.error or done.text)
    return read_landmarks(folder / "head.mrk.json")


def make_variant(options, folder, name):
    """The folder and landmarks of a variant of the head."""
    move, cropped, deviation = VARIANTS[name]
    head = folder / name.replace(" ", "_")
    head.mkdir(exist_ok=True)
    for surface in ("skin", *BONES):
        mesh = meshio.read(options.head / f"{surface}.ply")
        triangles = mesh.cells_dict["triangle"]
        if surface == "skin":
            z = mesh.points[:, 2]
            triangles = triangles[(z[triangles] > z.min() + cropped).all(axis=1)]
        used, triangles = np.unique(triangles, return_inverse=True)
        triangles = triangles.reshape(-1, 3)[:, ::-1 if name == "mirrored" else 1]
        points = move(mesh.points[used].astype(float))
        meshio.Mesh(points, {"triangle": triangles.astype(np.int32)}).write(head / f"{surface}.ply")
    own = argparse.Namespace(**{**vars(options), "head": head})
    landmarks = landmarks_of(own, head)
    if deviation:
        move_landmarks(head / "head.mrk.json", deviation)
    return own, head, landmarks


def move_landmarks(file, deviation):
    """Moves the landmarks of a file by normal deviates of so many mm along each axis."""
    text, random = json.loads(file.read_text()), np.random.default_rng(1)
    for point in text["markups"][0]["controlPoints"]:
        point["position"] = list(np.array(point["position"]) + random.normal(0, deviation, 3))
    file.write_text(json.dumps(text))


def scene_of(options, operation, way):
    bone, template, move, _ = OPERATIONS[operation]
    anatomy, tissue = WAYS[way]
    bones = ", ".join(f"{{name: {name}, file: {options.head / name}.ply}}" for name in BONES)
    kerf = ", kerf: 4.5" if operation == "impaction" else ", kerf: 0.5"
    return (f"skin: {options.head / 'skin.ply'}\nbones: [{bones}]\n"
            f"tissue: {{layers: 4, edge: {options.edge:g}{tissue}}}\n"
            f"anatomy: {{landmarks: head.mrk.json{anatomy}}}\n"
            f"osteotomies: [{{bone: {bone}, piece: part, template: {template}{kerf}}}]\n"
            f"moves: [{{bone: part, clinical: {{{move}}}}}]\n")


def lip_pressure(model, landmarks):
    """Force with which the tone draws the middle half of the lower lip back, over its area seen from
    the front, N/mm². The scene has no other external forces."""
    right, left, stomion, low = (landmarks[name] for name in
                                 ("mouth_right", "mouth_left", "stomion", "b_soft"))
    x, y, z = np.transpose(model["point/position"])
    front = np.abs(x - (left[0] + right[0]) / 2) < (left[0] - right[0]) / 4
    front &= (z < stomion[2]) & (z > low[2]) & (y < stomion[1] + 40)
    balance = model["point/external_force"][front, 1].sum()
    return -balance / ((left[0] - right[0]) / 2 * (stomion[2] - low[2]))


def ratios_of(options, folder, operation, way, landmarks):
    """Landmark → way of the skin over that of the bone; empty where the scene is refused."""
    length = OPERATIONS[operation][-1]
    name = f"{operation}_{way}".replace(" ", "_").replace(",", "")
    (folder / f"{name}.yaml").write_text(scene_of(options, operation, way))
    done = run([options.bin / "repose-solve", f"{name}.yaml", "-skip_other_rest", "-time_limit", LIMIT,
                "-output", name], folder, ends=None)
    (folder / f"{name}.log").write_text(done.text + done.error)
    if done.status != 0:
        print(operation, way, done.error, file=sys.stderr)
        return {}
    model, rest = model_of(folder / f"{name}.h5"), last(folder / f"{name}.h5")["point/position"]
    print(f"{operation}, {way}: the tone draws the lower lip back with "
          f"{1e6 * lip_pressure(model, landmarks):.0f} Pa", file=sys.stderr)
    skin = np.flatnonzero(model["point/layer"] == 0)
    initial = model["point/position"][skin]
    way_of_bone = model["bone_transform"][-1, :3, 3]
    ratio = (rest[skin] - initial) @ way_of_bone / length**2
    return {mark: ratio[np.argsort(np.linalg.norm(initial - landmarks[mark], axis=1))[:3]].mean()
            for mark in NAMES if mark in landmarks}


def cell(found, key):
    """A ratio, bold where it lies outside what is published."""
    if key[1] not in found:
        return "–"
    _, low, high = PUBLISHED[key]
    number = f"{found[key[1]]:.2f}"
    return number if low <= float(number) <= high else f"**{number}**"


def ways_of(options):
    return options.ways.split(";")


def operations_of(options):
    return options.operations.split(",") if options.operations else list(OPERATIONS)


def columns_of(options, folder):
    """Column of the table → options, folder and landmarks of its head, and way."""
    if options.variants:
        way = ways_of(options)[0]
        names = VARIANTS if options.variants == "all" else options.variants.split(";")
        return {name: (*make_variant(options, folder, name), way) for name in names}
    landmarks = landmarks_of(options, folder)
    return {way: (options, folder, landmarks, way) for way in ways_of(options)}


def rows(options, columns):
    outside, count = dict.fromkeys(columns, 0), 0
    for operation in operations_of(options):
        found = {name: ratios_of(own, folder, operation, way, landmarks)
                 for name, (own, folder, landmarks, way) in columns.items()}
        for key, (published, _, _) in PUBLISHED.items():
            if key[0] != operation:
                continue
            cells = [cell(found[name], key) for name in columns]
            for name, text in zip(columns, cells):
                outside[name] += text.startswith("**")
            count += 1
            yield (f"| {operation} {OPERATIONS[operation][-1]} | {NAMES[key[1]]} | {published} | "
                   + " | ".join(cells) + " |")
    yield f"| **outside**, of {count} | | | " + " | ".join(map(str, outside.values())) + " |"


def ramp(values, start, end):
    """0 at `start`, 1 at `end`, with a slope of 0 at both."""
    share = np.clip((values - start) / (end - start), 0, 1)
    return share * share * (3 - 2 * share)


def correct_profile(file):
    """Raises the nose of the shipped head's skin by 6 mm and draws its lips back by 3.5 mm, so that
    the tip of the nose is as high above the nasal spine as on the real head, and the lips as thick."""
    skin = meshio.read(file)
    x, y, z = np.transpose(skin.points)
    front = ramp(-y, 60, 80)
    nose = front * ramp(z, -14, -5) * ramp(z, 50, 14) * ramp(abs(x), 32, 16)
    lips = front * ramp(z, -46, -32) * ramp(z, 4, -6) * ramp(abs(x), 40, 16)
    skin.points = skin.points + np.column_stack([0 * x, 3.5 * lips, 6 * nose])
    skin.write(file)


def make_phantoms(options, folder):
    """Folders of synthetic heads of random proportions, without beards, their profile corrected."""
    run([options.bin / "repose-phantom", "-skin_vertices", 20000, "-bone_edge", 2, "-output", "head"],
        folder, ends=[0])
    correct_profile(folder / "head_skin.ply")
    for seed in range(options.first, options.first + options.phantoms):
        random = np.random.default_rng(seed)
        shape = Shape(random)
        shape.beard = 0
        head = folder / f"phantom_{seed}"
        head.mkdir(exist_ok=True)
        write_surfaces(head, shape, folder, random)
        yield head


def phantom_rows(options, folder):
    way, heads = ways_of(options)[0], []
    for head in make_phantoms(options, folder):
        own = argparse.Namespace(**{**vars(options), "head": head})
        landmarks = landmarks_of(own, head)
        heads.append({(operation, mark): ratio for operation in operations_of(options) for mark, ratio
                      in ratios_of(own, head, operation, way, landmarks).items()})
    for key, (published, low, high) in PUBLISHED.items():
        found = np.round([head[key] for head in heads if key in head], 2)
        if len(found):
            yield (f"| {key[0]} {OPERATIONS[key[0]][-1]} | {NAMES[key[1]]} | {published} | "
                   f"{np.median(found):.2f} | {found.min():.2f} … {found.max():.2f} | "
                   f"{np.sum(found < low)}, {np.sum(found > high)} of {len(found)} |")


def main():
    options = option_parser(__doc__, edge=4.0, ways="default;bonded lips", head="", operations="",
                            keep="", phantoms=0, first=1, variants="").parse_args()
    options.head = pathlib.Path(options.head).resolve() if options.head else DATA
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(options.keep or name).resolve()
        folder.mkdir(exist_ok=True)
        if options.phantoms:
            print_table(PHANTOM_HEAD, phantom_rows(options, folder), options.output, "phantoms")
            return
        columns = columns_of(options, folder)
        head = "| operation, mm | landmark | published | " + " | ".join(columns) + " |\n|---|---|---|"
        print_table(head + "--:|" * len(columns), rows(options, columns), options.output,
                    "variants" if options.variants else "measured")


if __name__ == "__main__":
    main()
