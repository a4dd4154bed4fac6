#!/usr/bin/env python3
"""A planning sheet of a result: one HTML page to be read without a network. The face before and after,
the plan, how far chin, lips and nose move, the profile, measures with norms, and how far to trust it.

    drivers/report.py NAME [OTHER] [-output report.html] [-scene scene.yaml]
        [-landmarks points.mrk.json] [-skin face.obj] [-norms norms.json]

NAME is the result (NAME.h5, the ending may be left out); OTHER is another plan of the same patient,
which the page compares with it. -scene shows the scene file and takes its landmarks and the colors
or the photograph of its skin; -landmarks takes others: 3D Slicer's .mrk.json, or JSON
{"name": [x, y, z], …}; -skin takes colors or photograph of another mesh of this skin (.ply with
colors, .obj with colors or a texture); -norms other norms than those of drivers/sheet/norms.json. In
mm; axes +x patient left, +y posterior, +z up. Needs: apt-get install python3-numpy python3-h5py
"""

import argparse
import os
import pathlib
import re
import sys

try:
    from sheet import landmarks, measures, page
    from sheet.appearance import read_appearance
    from sheet.result import Result, Unusable
except ImportError as missing:
    print(f"report.py: {missing.name} is missing: apt-get install --no-install-recommends "
          "python3-numpy python3-h5py", file=sys.stderr)
    sys.exit(1)


class Arguments(argparse.ArgumentParser):
    def error(self, message):
        refuse(message)


def refuse(message):
    print(f"report.py: {message}", file=sys.stderr)
    sys.exit(1)


def of_scene(scene, key):
    """The file that a line `key: file` of a scene names, or the same key of its anatomy; or nothing."""
    text, file = pathlib.Path(scene).read_text(encoding="utf-8"), r"\s*['\"]?([^'\"\n#{},]+)"
    found = (re.search(rf"^{key}:{file}", text, re.M)
             or re.search(rf"^anatomy:(?:.*\n[ \t]+)*?.*?\b{key}:{file}", text, re.M))
    return os.path.join(os.path.dirname(scene), found[1].strip()) if found else None


def arguments():
    parser = Arguments(prog="report.py", description=__doc__, add_help=False, allow_abbrev=False,
                       formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("name")
    parser.add_argument("other", nargs="?")
    for option in ("-output", "-scene", "-landmarks", "-skin"):
        parser.add_argument(option)
    parser.add_argument("-norms", default=str(measures.NORMS))
    chosen = parser.parse_intermixed_args()
    chosen.names = [name.removesuffix(".h5") for name in (chosen.name, chosen.other) if name]
    chosen.output = chosen.output or "_and_".join(
        [chosen.names[0], *map(os.path.basename, chosen.names[1:])]) + ".html"
    for file in (*(f"{name}.h5" for name in chosen.names), chosen.scene, chosen.landmarks,
                 chosen.skin, chosen.norms):
        if file and not os.path.isfile(file):
            refuse(f"{file}: no such file")
    if chosen.scene:
        chosen.landmarks = chosen.landmarks or of_scene(chosen.scene, "landmarks")
        skin = of_scene(chosen.scene, "skin")
        chosen.skin = chosen.skin or (skin if skin and os.path.isfile(skin) else None)
    return chosen


def main():
    chosen = arguments()
    if not os.path.isdir(os.path.dirname(os.path.abspath(chosen.output))):
        refuse(f"-output {chosen.output}: make its folder first")
    norms = measures.read_norms(chosen.norms)
    marks = landmarks.read_landmarks(chosen.landmarks) if chosen.landmarks else {}
    axes, frame = landmarks.head_axes(marks)
    results = [Result(f"{name}.h5") for name in chosen.names]
    appearance = read_appearance(chosen.skin, results[0].skin) if chosen.skin else None
    for result in results:
        result.turn(axes)
    if appearance and appearance.skin is not results[0].skin:
        appearance.skin.turn(axes)
    marks = {name: axes @ place for name, place in marks.items()}
    plans = [page.Plan(page.title_of(name), result, marks, norms)
             for name, result in zip(chosen.names, results)]
    written = page.write(plans, norms, chosen.scene, appearance, frame)
    pathlib.Path(chosen.output + ".part").write_text(written, encoding="utf-8")
    os.replace(chosen.output + ".part", chosen.output)
    print(chosen.output)


try:
    main()
except Unusable as reason:
    refuse(reason)
