#!/usr/bin/env python3
"""Pictures of planning sheets, to be looked at: at 1400 and 420 pixels, after a touch, and in print.

    tests/program/sheet_pictures.py FOLDER PAGE.html …

writes FOLDER/PAGE_1400.png, _420.png, _touch.png, _print.pdf, and with pdftoppm (poppler-utils) a PNG a
printed page. Needs Chromium.
"""

import pathlib
import shutil
import subprocess
import sys

from browser import browse, scripted

# Chromium's windows are 500 pixels wide at least, for which the page has the same style.
NARROW = "document.documentElement.style.width = '420px';"
TOUCH = """
const {viewer} = sheet, canvas = viewer.three.renderer.domElement;
sheet.color("movement");
viewer.look("front");
const box = canvas.getBoundingClientRect();
for (const type of ["pointerdown", "pointerup"]) canvas.dispatchEvent(new PointerEvent(type, {
  bubbles: true, pointerId: 1, pointerType: "touch", clientX: box.left + 0.6 * box.width,
  clientY: box.top + 0.72 * box.height}));"""


def patient(page, *options, size):
    """Browses; a Chromium that hangs, as it does now and then, is started again."""
    for last in (False, False, True):
        try:
            return browse(page, *options, size=size, seconds=90)
        except subprocess.TimeoutExpired:
            if last:
                raise


def pictures(page, folder):
    name = folder / page.stem
    later = "--virtual-time-budget=4000"  # before the pictures for the print are made
    for suffix, size, script in (("1400", (1400, 1500), ""), ("420", (500, 4200), NARROW),
                                 ("touch", (500, 860), NARROW + TOUCH)):
        with scripted(page, script) as copy:
            patient(copy, later, f"--screenshot={name}_{suffix}.png", size=size)
    patient(page, "--virtual-time-budget=60000", "--no-pdf-header-footer",
           f"--print-to-pdf={name}_print.pdf", size=(900, 700))
    if shutil.which("pdftoppm"):
        subprocess.run(["pdftoppm", "-r", "80", "-png", f"{name}_print.pdf", f"{name}_print"],
                       check=True)


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for page in sys.argv[2:]:
        pictures(pathlib.Path(page).resolve(), folder)


if __name__ == "__main__":
    main()
