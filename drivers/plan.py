#!/usr/bin/env python3
"""From voxels to a face: plan.py VOLUME [LABELS] -operation TEXT

    drivers/plan.py head.mhd labels.nii.gz -operation "Le Fort I, 5 mm forward, 2 up" -output plan
    drivers/plan.py head.seg.nrrd -operation "genioplasty, 8 mm forward" -output plan
    drivers/plan.py ct.nii.gz -operation "open the jaw by 8 degrees" -output plan

VOLUME is a CT or a segmentation of 3D Slicer (.seg.nrrd), whose segments' names decide what is skin,
skull, maxilla and mandible; LABELS a label map or segmentation of the bones of a CT. Without it skull
and jaw are taken apart where they touch least. Writes into the folder plan: surfaces, landmarks,
scene.yaml to edit, pictures of both (landmarks.svg, proposal.png), and the solved face with a picture
and its planning sheet (face.html). Operations: Le Fort I, sagittal split, genioplasty, jaw, or several of
them; each with movements in mm (forward, back, up, down, left, right) and degrees (open, close, yaw, roll,
pitch), along the axes of the head, whatever those of the scan (docs/guide/anatomy.md).

  -level HU    of the skin in a CT (-300)
  -apart SKULL JAW    points in the two bones of a CT without LABELS, in the place of those that are
                      proposed (docs/guide/touching_bones.md)
  -bone HU     level of bone there (226)
  -edge MM     of the mesh that is solved (4);  -ranks N  that solve it (2)
  -propose     ends with the scene and its pictures, before it is solved

After an edit of plan/scene.yaml: repose-solve plan/scene.yaml -output plan/face."""

import fcntl
import itertools
import math
import os
import pathlib
import re
import shlex
import sys
import tempfile
import time
import unicodedata
import zlib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE / "python")]
from planning.operation import NotUnderstood, read_operations, summarize  # noqa: E402
from sheet.ply import Header  # noqa: E402
from sheet.script import Arguments, number_from, reading, refuse, refuse_missing, start  # noqa: E402
from sheet.script import run as run_script  # noqa: E402
from sheet.whole_file import Target  # noqa: E402

try:
    import numpy as np
    from repose.programs import find_program, mpi_environment
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-numpy")

# Names of segments in English, German, French and Spanish, without accents.
TEETH = r"teeth|tooth|dent|zahn|zaehn|dient"
LOWER, UPPER = r"lower|unter|unten|inf|bas\b", r"upper|ober|oben|sup|haut\b"
ROLES = {"mandible": rf"mandib|unterkiefer|({LOWER}).*jaw|(maxil|machoire).*({LOWER})",
         "maxilla": r"^(?!.*(skull|cran|schae?del)).*(maxil|oberkiefer|upper.?jaw|machoire)",
         "skin": r"skin|soft|face|haut|weich|gesicht|peau|mous|visage|piel|bland|\bcara\b",
         "skull": r"skull|cran|schae?del|bone"}
NO_BONE = r"sinus|cavit|hohle|airway|hyoid|cervic|vertebr|spine|wirbel"
UNDERSTOOD = "skin (Haut, peau, piel), skull (Schädel, crâne, cráneo), mandible (Unterkiefer, mandibule, mandíbula)"
OUTSIDE = r"table|\btisch|head.?rest|background|hintergrund|^(air|luft)$"
# Operation → bone, piece that is cut from it, and template.
OSTEOTOMIES = {"Le Fort I": ("skull", "maxilla", "le_fort_1"),
               "sagittal split": ("mandible", "jaw", "sagittal_split"),
               "jaw": ("mandible", None, None),
               "genioplasty": ("mandible", "chin", "genioplasty")}
SKIN, BONE = -300, 226  # HU, levels
CORE = 150  # HU above the skin's level: foam of a headrest stays below
NEEDED = ("skin", "skull", "mandible")
PROPOSED, NOT_ENDED = "Proposed by drivers/plan.py", "whose run has not ended"
# Files of a run in its folder, which the next run removes.
WRITTEN = ("skin.ply", "skull.ply", "maxilla.ply", "skull_and_maxilla.ply", "mandible.ply", "bone_1.ply", "bone_2.ply", "bone_1.mrk.json",
           "bone_2.mrk.json", "landmarks.mrk.json", "landmarks.svg", "scene.yaml", "proposal.png", "face.h5",
           "face_skin.xdmf", "face_tissue.xdmf", "face_bones.xdmf", "face_blocks.xdmf", "face_given_skin.vtp",
           "face.png", "face.html")
# Template → back and up of the head in each direction in which its piece moves towards what it is cut from.
INWARDS = {"le_fort_1": ((0, 1), (1, 0)), "genioplasty": ((0.42, 0.91),)}
# Template → mm: half the width of the cut, its length behind the pivot, and its height above that.
EXTENT = {"le_fort_1": (30, 50, 28), "genioplasty": (20, 20, 15)}


def run(*command):
    """Runs one step, shows what it prints, and ends where it writes nothing. Returns its status."""
    print("$", shlex.join(map(str, command)), flush=True)
    status = start(*command).returncode
    if status not in (0, 2):
        refuse(f"{pathlib.Path(str(command[0])).name} ended with status {status}")
    return status


def draw(script, *arguments):
    """Returns the name of the picture or page that a script of this folder draws, to follow others; empty
    where it cannot, which is reported."""
    done = start(sys.executable, script, *arguments, capture_output=True, text=True)
    if done.returncode == 0:
        return f", {arguments[-1]}"
    print(f"{arguments[-1]} was not drawn: {done.stderr.strip()}", flush=True)
    return ""


def plain(name):
    """A name in lower case and without accents."""
    return "".join(c for c in unicodedata.normalize("NFKD", name.lower()) if not unicodedata.combining(c))


def role_of(name):
    """The part that a segment's name stands for; None where it stands for none."""
    name = re.sub(r"\b(without|ohne|sans|sin)\b.*", "", plain(name))
    if re.search(NO_BONE, name):
        return None
    if re.search(TEETH, name):
        lower, upper = (re.search(words, name) is not None for words in (LOWER, UPPER))
        return "teeth" if lower == upper else "mandible" if lower else "upper teeth"
    return next((role for role, words in ROLES.items() if re.search(words, name)), None)


class Segmentation:
    """A segmentation of 3D Slicer (.seg.nrrd): labels in one or several layers, with names."""

    def __init__(self, file):
        self.file = file
        begin, data = re.split(rb"\n\r?\n", file.read_bytes(), maxsplit=1)
        self.header = begin.decode(errors="replace").replace("\r", "")
        fields = dict(re.findall(r"^([a-z ]+): *(.*?) *$", self.header, re.M))
        keys = dict(re.findall(r"^(Segment\d+_\w+):=(.*?)\s*$", self.header, re.M))
        names = [keys[key] for key in keys if key.endswith("_Name")]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice:
            refuse(f"{file}: two segments are named {twice}: rename one")
        sizes = [int(n) for n in fields["sizes"].split()]
        kinds = {"unsigned char": "u1", "uchar": "u1", "uint8": "u1", "short": "i2", "unsigned short": "u2",
                 "int": "i4", "signed char": "i1"}
        if "data file" in fields or fields.get("encoding") not in ("raw", "gzip", "gz") \
                or fields["type"] not in kinds or len(sizes) not in (3, 4):
            refuse(f"{file}: not as 3D Slicer writes it: save it again as .seg.nrrd")
        order = ">" if fields.get("endian") == "big" else "<"
        raw = data if fields["encoding"] == "raw" else zlib.decompressobj(31).decompress(data)
        values = np.frombuffer(raw, order + kinds[fields["type"]], int(np.prod(sizes)))
        self.layers = values.reshape(-1, sizes[0] if len(sizes) == 4 else 1)  # voxels, layers
        self.sizes = sizes[-3:]
        self.segments = {keys[key]: (int(keys.get(key.replace("_Name", "_Layer"), 0)),
                                     int(keys[key.replace("_Name", "_LabelValue")]))
                         for key in keys if key.endswith("_Name")}

    def roles(self):
        """Names of the segments of each role that a plan needs; the skin holds all that it surrounds."""
        found = {}
        for name in self.segments:
            role = role_of(name)
            if role and not self.voxels(name).any():
                refuse(f"{self.file}: segment {name} holds no voxel: draw it, or delete it")
            found.setdefault(role, []).append(name)
        if "teeth" in found:
            refuse(f"{self.file}: {found['teeth'][0]}: not known whether teeth of the upper or the lower jaw: part the "
                   "segment, and name its parts upper and lower teeth")
        upper = found.pop("upper teeth", [])
        if upper:
            found.setdefault("maxilla" if "maxilla" in found else "skull", []).extend(upper)
        if "skin" in found:
            found["skin"] = [name for name in self.segments if not re.search(OUTSIDE, plain(name))]
        found.pop(None, None)
        return found

    def voxels(self, name):
        layer, label = self.segments[name]
        return self.layers[:, layer] == label

    def write(self, names, file):
        """A label map of the segments together, as label 1."""
        mask = np.zeros(len(self.layers), "u1")
        for name in names:
            mask |= self.voxels(name)
        fields = {key: value for key, value in re.findall(r"^(space[a-z ]*): *(.*?) *$", self.header, re.M)}
        fields["space directions"] = fields["space directions"].removeprefix("none").strip()
        text = "NRRD0004\ntype: unsigned char\ndimension: 3\n"
        text += "".join(f"{key}: {fields[key]}\n" for key in ("space",) if key in fields)
        text += f"sizes: {' '.join(map(str, self.sizes))}\nencoding: raw\n"
        text += "".join(f"{key}: {value}\n" for key, value in fields.items() if key != "space")
        Target(file, ".nrrd").write(text.encode() + b"\n" + mask.tobytes())


def bounds(file):
    """Lowest and highest corner of a PLY file."""
    vertices = Header(file.read_bytes()).vertices()
    points = np.stack([vertices[axis] for axis in "xyz"], 1)
    return points.min(0), points.max(0)


EDITED = ("scene.yaml", "landmarks.mrk.json")  # by people: the next run renames them


def lock(folder):
    """Keeps other runs out of a folder until this process ends."""
    try:
        fcntl.flock(os.open(folder, os.O_RDONLY), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        refuse(f"{folder}: another run of this program is at work in it; wait for its end, or give another folder by "
               "-output")
    except OSError:
        pass  # a file system without locks


def rename_old(file):
    """Renames a file to old_…, or to old_2_… where that exists, and so on."""
    numbered = (file.with_name(f"old_{n}_{file.name}") for n in itertools.count(2))
    free = itertools.chain([file.with_name(f"old_{file.name}")], numbered)
    file.rename(next(name for name in free if not name.exists()))


def begin_run(folder, operations, inputs):
    """Makes the folder of a run, without the files that an earlier run wrote into it, except inputs of this one.
    Refuses files of these names in a folder without a scene of this program."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        refuse(f"-output {folder}: cannot be made: {reason.strerror}; choose another folder")
    lock(folder)
    scene, inputs = folder / "scene.yaml", {file.resolve() for file in inputs}
    begun_scene = Target(scene, ".yaml")
    old = [file for file in (folder / name for name in WRITTEN) if file.exists() and file.resolve() not in inputs]
    begun = scene.read_text(errors="replace") if scene.is_file() else ""
    if old and PROPOSED not in begun:
        refuse(f"{old[0]} exists, and {scene} was not written by this program: give another folder by -output")
    for file in old:
        if file.name in EDITED and not (file == scene and NOT_ENDED in begun):
            rename_old(file)
        else:
            file.unlink()
    if old:
        print(f"removed from {folder}: files of an earlier run; {' and '.join(EDITED)} are renamed to old_…",
              flush=True)
    begun_scene.write(f"# {summarize(operations)}.\n# {PROPOSED}, {NOT_ENDED}.\n")


def extract_labels(labels, folder, work, with_skin):
    """Writes a mesh of each bone; without names the largest label is the skull, and that before and below its
    middle the mandible."""
    if labels.name.lower().endswith(".seg.nrrd"):
        with reading(labels, "a segmentation of 3D Slicer"):
            segmentation = Segmentation(labels)
        map_file = work / "segment.nrrd"
        roles = segmentation.roles()
        missing = [part for part in NEEDED if part not in roles and (part != "skin" or with_skin)]
        if missing:
            refuse(f"{labels}: no segment is named as {' or '.join(missing)} among "
                   f"{', '.join(segmentation.segments) or 'none'}; names that are understood: {UNDERSTOOD}")
        if "skull" in roles and "maxilla" in roles:  # where landmarks of the skull are searched
            roles["skull_and_maxilla"] = roles["skull"] + roles["maxilla"]
        for role, names in roles.items():
            print(f"{role}: {', '.join(names)}", flush=True)
            segmentation.write(names, map_file)
            run(find_program("repose-isosurface"), map_file, "-label", 1, "-largest", "-voxel", 2, "-output",
                folder / f"{role}.ply")
        return
    run(find_program("repose-isosurface"), labels, "-labels", "-largest", "-voxel", 2, "-output",
        work / "label.ply")
    meshes = {file: bounds(file) for file in work.glob("label_*.ply")}
    size = {file: (high - low).prod() for file, (low, high) in meshes.items()}
    skull = max(size, key=size.get)
    middle = (meshes[skull][0] + meshes[skull][1]) / 2
    jaws = [file for file, (low, high) in meshes.items()
            if (low + high)[1] / 2 < middle[1] and (low + high)[2] / 2 < middle[2]]
    if not jaws:
        refuse(f"{labels}: no label lies before and below the skull; name segments in a .seg.nrrd")
    skull.rename(folder / "skull.ply")
    max(jaws, key=size.get).rename(folder / "mandible.ply")


def extract_bones(volume, options, folder):
    """Skull and mandible of a CT, taken apart from points in each, proposed or given."""
    points = ["-apart", *options.apart] if options.apart else ["-jaw"]
    run(find_program("repose-isosurface"), volume, "-level", options.bone, *points, "-largest", "-voxel", 2,
        "-output", folder / "bone.ply")
    (folder / "bone_1.ply").rename(folder / "skull.ply")
    (folder / "bone_2.ply").rename(folder / "mandible.ply")


def read_or_refuse(text):
    """Returns the operations that a text names."""
    try:
        return read_operations(text)
    except NotUnderstood as reason:
        refuse(f"-operation {text!r}: {reason}")


def kerf_of(template, move):
    """mm: the saw's, or so much that a piece which moves or turns towards what it is cut from has room."""
    yaw, roll, pitch = (math.sin(math.radians(move.get(key, 0))) for key in ("yaw", "roll", "pitch"))
    aside, behind, above = EXTENT.get(template, (0, 0, 0))
    back = move.get("set_back", 0) - move.get("advance", 0) + aside * abs(yaw) + above * max(0, -pitch)
    up = move.get("impaction", 0) - move.get("lower", 0) + aside * abs(roll) + behind * max(0, pitch)
    inwards = [along_back * back + along_up * up for along_back, along_up in INWARDS.get(template, ())]
    return min(20, max([0.5, *(way + 1 for way in inwards)]))


def format_move(bones, move, pivot):
    """Returns an entry of a scene's moves; the pivot only matters to rotations, None is the default."""
    clinical = [f"{key}: {number:g}" for key, number in move.items()]
    if pivot and move.keys() & {"yaw", "roll", "pitch"}:
        clinical.append(f"pivot: {pivot}")
    return f"  - {{bone: {bones}, clinical: {{{', '.join(clinical)}}}}}"


def format_cuts_and_moves(operations, bones):
    """Returns the lines of a scene's osteotomies and of its moves. A chin goes with the jaw that it is cut from."""
    named = {operation.name for operation in operations}
    jaw = "jaw" if "sagittal split" in named else "mandible"
    cuts, moves = [], []
    for name, move in operations:
        bone, piece, template = OSTEOTOMIES[name]
        moving = piece or bone
        if template and piece not in bones:  # a segmented piece needs no cut
            cuts.append(f"  - {{bone: {jaw if piece == 'chin' else bone}, piece: {piece}, template: {template}, "
                        f"kerf: {kerf_of(template, move):.3g}}}")
        if moving == jaw and "genioplasty" in named:
            moves.append(format_move(f"[{jaw}, chin]", move, "lower_incisor_edge"))
        else:
            moves.append(format_move(moving, move, "upper_incisor_edge" if piece in bones else None))
    return cuts, moves


def scene_text(operations, edge, bones):
    lines = [f"# {summarize(operations)}.", f"# {PROPOSED}: check landmarks.svg and proposal.png. After an edit:",
             "# repose-solve scene.yaml. Moves are in mm and degrees along the axes of the head.",
             "skin: skin.ply", "bones:"]
    lines += [f"  - {{name: {name}, file: {name}.ply}}" for name in bones]
    lines += [f"tissue: {{layers: 4, edge: {edge:g}}}",
              "anatomy: {landmarks: landmarks.mrk.json}   # lips are parted, and free of the teeth"]
    cuts, moves = format_cuts_and_moves(operations, bones)
    if cuts:
        taken_out = any(OSTEOTOMIES[operation.name][2] in INWARDS for operation in operations)
        lines += [f"osteotomies:   # kerf: mm, the saw{' and bone taken out' if taken_out else ''}", *cuts]
    return "\n".join([*lines, "moves:", *moves]) + "\n"


def arguments():
    parser = Arguments(__doc__)
    parser.add_argument("volume", type=pathlib.Path)
    parser.add_argument("labels", nargs="?", type=pathlib.Path)
    parser.add_argument("-operation", required=True)
    parser.add_argument("-output", default="plan", type=pathlib.Path)
    parser.add_argument("-level", type=number_from(-32768, 65535, float), default=SKIN)
    parser.add_argument("-bone", type=number_from(-32768, 65535, float), default=BONE)
    parser.add_argument("-apart", nargs=2, type=pathlib.Path)
    parser.add_argument("-edge", type=number_from(1, 20, float), default=4)
    parser.add_argument("-ranks", type=number_from(1, 1024), default=min(2, os.cpu_count() or 1))
    parser.add_argument("-propose", action="store_true")
    chosen = parser.parse_intermixed_args()
    chosen.segmented = chosen.volume.name.lower().endswith(".seg.nrrd")
    if chosen.segmented and chosen.labels:
        refuse(f"{chosen.labels}: {chosen.volume} is a segmentation, which needs no LABELS; give one of them, or a CT and "
               "LABELS")
    if chosen.apart and (chosen.segmented or chosen.labels):
        refuse("-apart: the bones are those of the segmentation; leave it out, or give a CT alone")
    return chosen


def main():
    os.environ.update(mpi_environment(os.environ))
    options, begin = arguments(), time.monotonic()
    folder, volume = options.output, options.volume
    labels = volume if options.segmented else options.labels
    inputs = [file for file in (volume, options.labels, *(options.apart or [])) if file]
    for file in inputs:
        if not file.exists():
            refuse(f"{file}: no such file or folder")
    if folder.exists() and not folder.is_dir():
        refuse(f"-output {folder}: is a file, not a folder; choose another name")
    if not labels and options.bone <= options.level:
        refuse(f"-level {options.level:g}: the skin's level must be below that of bone, -bone {options.bone:g}; give both in "
               f"the values of the volume, such as -level {options.level:g} -bone {options.level + BONE - SKIN:g}")
    for program in ("repose-isosurface", "repose-landmarks", "repose-solve"):
        find_program(program)  # before a file of an earlier run is removed
    operations = read_or_refuse(options.operation)
    print(f"understood: {summarize(operations)}", flush=True)
    begin_run(folder, operations, inputs)
    if labels:
        with tempfile.TemporaryDirectory(prefix="labels_", dir=folder) as work:
            extract_labels(labels, folder, pathlib.Path(work), options.segmented)
    else:
        extract_bones(volume, options, folder)
    if not options.segmented:
        run(find_program("repose-isosurface"), volume, "-level", options.level, "-core", options.level + CORE,
            "-largest", "-output", folder / "skin.ply")
    whole = folder / "skull_and_maxilla.ply"
    run(find_program("repose-landmarks"), folder / "skin.ply", "-skull",
        whole if whole.exists() else folder / "skull.ply", "-mandible", folder / "mandible.ply", "-output", folder / "landmarks")
    bones = [name for name in ("skull", "maxilla", "mandible") if (folder / f"{name}.ply").exists()]
    scene = folder / "scene.yaml"
    Target(scene, ".yaml").write(scene_text(operations, options.edge, bones))
    if options.propose:
        run(find_program("repose-solve"), scene, "-dry_run")
    picture = draw(HERE / "proposal.py", scene, "-output", folder / "proposal.png")
    print(f"proposed: {scene}, {folder / 'landmarks.svg'}{picture} ({time.monotonic() - begin:.0f} s): check "
          "the pictures", flush=True)
    if options.propose:
        return
    status = run("mpirun", "-n", options.ranks, find_program("repose-solve"), scene, "-output",
                 folder / "face")
    picture = draw(HERE / "render.py", folder / "face", "-output", folder / "face.png")
    sheet = draw(HERE / "report.py", folder / "face", "-scene", scene, "-output", folder / "face.html")
    print(f"{'not at rest, or folded (see above)' if status else 'solved'}: {folder / 'face.h5'}{picture}{sheet} "
          f"({time.monotonic() - begin:.0f} s)")
    return status


if __name__ == "__main__":
    run_script(main)
