#!/usr/bin/env python3
"""A planning sheet of a result: one HTML page to be read without a network. The face before and after,
the plan, how far chin, lips and nose move, the profile, measures with norms, and how far to trust it.

    drivers/report.py NAME [OTHER] [-output report.html] [-scene scene.yaml]
        [-landmarks points.mrk.json] [-skin face.obj] [-norms norms.json]

NAME is the result (NAME.h5, the ending may be left out); OTHER is another plan of the same patient,
which the page compares with it. -scene shows the scene file and takes its landmarks and the colors
or the photograph of its skin; -landmarks takes others: 3D Slicer's .mrk.json or .fcsv, .csv, or
JSON {"name": [x, y, z], …}; -skin takes colors or photograph of another mesh of this skin (.ply with
colors, .obj with colors or a texture); -norms other norms than those of drivers/sheet/norms.json. In
mm; axes +x patient left, +y posterior, +z up. Needs: apt-get install python3-numpy python3-h5py,
and python3-yaml for -scene.
"""

import os

from sheet.script import Arguments, own_names, refuse, refuse_missing, require_file, result_name, run
from sheet.whole_file import Target

try:
    from sheet import landmarks, measures, page
    from sheet.appearance import read_appearance
    from sheet.result import Result
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-numpy python3-h5py")


def arguments():
    parser = Arguments(__doc__)
    parser.add_argument("name")
    parser.add_argument("other", nargs="?")
    for option in ("-output", "-scene", "-landmarks", "-skin"):
        parser.add_argument(option)
    parser.add_argument("-norms", default=str(measures.NORMS))
    chosen = parser.parse_intermixed_args()
    chosen.names = [result_name(name) for name in (chosen.name, chosen.other) if name is not None]
    for file in (chosen.scene, chosen.landmarks, chosen.skin, chosen.norms):
        if file:
            require_file(file, "choose another one, or leave it out")
    chosen.colors = chosen.skin
    if chosen.scene:
        from sheet.scene import named_file  # needs PyYAML
        chosen.landmarks = chosen.landmarks or named_file(chosen.scene, "landmarks")
        skin = named_file(chosen.scene, "skin")
        chosen.skin = chosen.skin or (skin if skin and os.path.isfile(skin) else None)
    chosen.output = Target(chosen.output or "_and_".join(
        [chosen.names[0], *map(os.path.basename, chosen.names[1:])]) + ".html", (".html", ".htm"),
        [*(name + ending for name in chosen.names for ending in (".h5", "_given_skin.vtp")),
         chosen.scene, chosen.landmarks, chosen.skin, chosen.norms])
    return chosen


def main():
    chosen = arguments()
    norms = measures.read_norms(chosen.norms)
    marks = landmarks.read_landmarks(chosen.landmarks) if chosen.landmarks else {}
    results = [Result(f"{name}.h5") for name in chosen.names]
    if chosen.scene:
        from sheet.scene import require_same_bones  # needs PyYAML
        require_same_bones(chosen.scene, {result.file: result.bone_names for result in results})
    landmarks.require_same_head(results[0], marks, chosen.landmarks)
    axes, frame = landmarks.head_axes(marks)
    appearance = read_appearance(chosen.skin, results[0].skin) if chosen.skin else None
    if chosen.colors and not appearance:
        refuse(f"{chosen.colors}: has neither colors nor a texture that can be shown; give a .ply with colors, or "
               "an .obj with colors or with a .png or .jpg beside it that its .mtl names, or leave -skin out")
    for result in results:
        result.turn(axes)
    if appearance and appearance.skin is not results[0].skin:
        appearance.skin.turn(axes)
    marks = {name: axes @ place for name, place in marks.items()}
    plans = [page.Plan(page.spoken(name), result, marks, norms)
             for name, result in zip(own_names(chosen.names), results)]
    chosen.output.write(page.write(plans, norms, chosen.scene, appearance, frame))
    print(chosen.output)


run(main)
