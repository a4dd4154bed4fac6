#!/usr/bin/env python3
"""A sagittal split from the CT alone, from one CT in thirteen versions: the table of its page.

    tests/benchmark/ct_variants.py [-bin build/bin] [-head ../shared/data/head]
                                   [-output docs/measurements/any_head.md] [-only "noise;metal"]

Each version of the volume goes through drivers/plan.py, with no landmark and no point given: coarse
or thick voxels, noise, a smaller field of view, HU that end at 1200, the couch at the back of the
head, metal with streaks at the teeth, another size, the mirror image, rows from left to right.
Needs: apt-get install --no-install-recommends python3-h5py python3-scipy
"""

import os
import pathlib
import re
import sys
import tempfile
import zlib

import numpy as np

from measure import run
from page import PROJECT, option_parser, print_table

ADVANCE = 6  # mm
HEAD = ("| CT | exit status | jaw, cm³ | vertices | chin's way over the bone's | lower lip's | CPU, s |\n|---"
        + "|--:" * 6 + "|")


class Volume:
    """HU [slices, rows, columns] on a grid: spacing and origin in mm, x first."""

    def __init__(self, hu, spacing, origin, flipped=False):
        self.hu, self.spacing, self.origin, self.flipped = hu, spacing, origin, flipped

    def axis(self, k):
        """Places of the grid along x, y or z, mm."""
        return self.origin[k] + self.spacing[k] * np.arange(self.hu.shape[2 - k])

    def coarsened(self, *times):
        """The mean of so many voxels along x, y and z."""
        size = [n // k * k for n, k in zip(self.hu.shape, times[::-1])]
        blocks = self.hu[:size[0], :size[1], :size[2]].reshape(
            [m for n, k in zip(size, times[::-1]) for m in (n // k, k)])
        shift = (np.array(times) - 1) / 2 * self.spacing
        return Volume(blocks.mean((1, 3, 5)), self.spacing * times, self.origin + shift)

    def changed(self, hu):
        return Volume(hu, self.spacing, self.origin)

    def scaled(self, by):
        return Volume(self.hu, by * self.spacing, by * self.origin)

    def write(self, file):
        hu = np.clip(np.rint(self.hu), -1024, 4000).astype("<i2")
        file.with_suffix(".raw").write_bytes(hu.tobytes())
        first = -1 if self.flipped else 1
        lines = {"ObjectType": "Image", "NDims": 3, "BinaryData": True,
                 "TransformMatrix": f"{first} 0 0 0 1 0 0 0 1",
                 "Offset": " ".join(map(str, self.origin)),
                 "ElementSpacing": " ".join(map(str, self.spacing)),
                 "DimSize": " ".join(map(str, hu.shape[::-1])), "ElementType": "MET_SHORT",
                 "ElementDataFile": file.with_suffix(".raw").name}
        file.write_text("".join(f"{key} = {value}\n" for key, value in lines.items()))


def read(file):
    lines = dict(line.split(" = ", 1) for line in file.read_text().splitlines() if " = " in line)
    size = [int(n) for n in lines["DimSize"].split()]
    data = zlib.decompress((file.parent / lines["ElementDataFile"]).read_bytes())
    hu = np.frombuffer(data, "<i2").reshape(size[::-1]).astype(np.float32)
    return Volume(hu, *(np.array([float(n) for n in lines[key].split()])
                        for key in ("ElementSpacing", "Offset")))


def cropped(ct, low, high):
    inside = np.where((ct.axis(2) > low) & (ct.axis(2) < high))[0]
    return Volume(ct.hu[inside], ct.spacing, ct.origin + [0, 0, ct.spacing[2] * inside[0]])


def on_couch(ct):
    """A slab of 14 mm that touches the back of the head."""
    hu, y = ct.hu.copy(), ct.axis(1)
    back = y[np.where((hu > -300).any((0, 2)))[0][-1]]
    slab = np.ix_(ct.axis(2) > 380, (y > back - 6) & (y < back + 8),
                  abs(ct.axis(0) - np.median(ct.axis(0))) < 90)
    hu[slab] = np.maximum(hu[slab], 80)
    return ct.changed(hu)


def with_metal(ct):
    """Six fillings of 3070 HU in teeth, each with 24 streaks that fade along the slice."""
    hu, random = ct.hu.copy(), np.random.default_rng(1)
    teeth = (hu > 1500) & ((ct.axis(2) > 365) & (ct.axis(2) < 385))[:, None, None]
    places = np.argwhere(teeth & (ct.axis(1) < -230)[None, :, None])
    reach = np.arange(4, 110)
    for k, j, i in places[random.choice(len(places), 6, replace=False)]:
        hu[k - 1:k + 2, j - 2:j + 3, i - 2:i + 3] = 3070
        for angle in random.uniform(0, 2 * np.pi, 24):
            rows = np.rint(j + reach * np.sin(angle)).astype(int)
            columns = np.rint(i + reach * np.cos(angle)).astype(int)
            inside = (rows >= 0) & (rows < hu.shape[1]) & (columns >= 0) & (columns < hu.shape[2])
            streak = random.choice([-1, 1]) * random.uniform(150, 600) * np.exp(-reach / 50)
            hu[k, rows[inside], columns[inside]] += streak[inside]
    return ct.changed(hu)


def in_circle(ct):
    """What lies outside of the scanner's round field of view is air."""
    y, x = (np.arange(n) - n / 2 for n in ct.hu.shape[1:])
    return ct.changed(np.where(x[None, :]**2 + y[:, None]**2 > (min(len(x), len(y)) / 2)**2, -1024,
                               ct.hu))


def versions(ct):
    noise = np.random.default_rng(1).normal(0, 80, ct.hu.shape)
    mirrored = ct.hu[:, :, ::-1]
    return {"as it is": lambda: ct,
            "voxels twice as large": lambda: ct.coarsened(2, 2, 2),
            "slices of 6 mm": lambda: ct.coarsened(1, 1, 3),
            "noise of 80 HU": lambda: ct.changed(ct.hu + noise),
            "chin to orbits only": lambda: cropped(ct, 318, 440),
            "HU end at 1200": lambda: ct.changed(np.minimum(ct.hu, 1200)),
            "couch": lambda: on_couch(ct),
            "metal": lambda: with_metal(ct),
            "0.85 times the size": lambda: ct.scaled(0.85),
            "1.12 times the size": lambda: ct.scaled(1.12),
            "mirror image": lambda: ct.changed(mirrored),
            "rows from left to right": lambda: Volume(
                mirrored, ct.spacing, ct.origin + [(ct.hu.shape[2] - 1) * ct.spacing[0], 0, 0], True),
            "round field of view": lambda: in_circle(ct)}


def row(tools, folder, name, ct):
    ct.write(folder / "ct.mhd")
    paths = os.pathsep.join([str(tools), os.environ["PATH"]])
    done = run([sys.executable, PROJECT / "drivers/plan.py", "ct.mhd", "-operation",
                f"sagittal split, {ADVANCE} mm forward", "-output", "plan"], folder, ends=None,
               env=os.environ | {"PATH": paths})

    def number(pattern, scale=1.0, digits=2):
        found = re.search(pattern, done.text)
        return f"{float(found[1]) * scale:.{digits}f}" if found else "–"

    piece = r"piece 'jaw' of (\d+) mm³"
    return (f"| {name} | {done.status} | {number(piece, 1e-3, 0)} "
            f"| {number(r'solved has ([0-9]+) vertices', 1, 0)} "
            f"| {number(r'Chin ([0-9.]+) mm forward', 1 / ADVANCE)} "
            f"| {number(r'lower lip ([0-9.]+) mm forward', 1 / ADVANCE)} | {done.seconds:.0f} |")


def rows(chosen):
    ct = read(pathlib.Path(chosen.head).resolve() / "head_hu.mhd")
    for name, version in versions(ct).items():
        if chosen.only and not any(word in name for word in chosen.only.split(";")):
            continue
        with tempfile.TemporaryDirectory() as folder:
            yield row(chosen.bin, pathlib.Path(folder), name, version())


def main():
    parser = option_parser(__doc__, head=str(PROJECT.parent / "shared/data/head"), only="")
    chosen = parser.parse_args()
    print_table(HEAD, rows(chosen), chosen.output, "versions")


if __name__ == "__main__":
    main()
