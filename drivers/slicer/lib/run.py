"""What the panel Repose of 3D Slicer does: a scene of what it is given, repose-solve, and models of
the result. Reads the parameters from Repose.xml, so that panel and program agree. In mm and LPS."""

import base64
import fcntl
import json
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

FOLDER = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(FOLDER.parent), str(FOLDER.parent / "python")]
from sheet.ply import Header  # noqa: E402
from sheet.script import HELP, Unusable as Refusal, reading  # noqa: E402
from sheet.whole_file import Target  # noqa: E402

BONES = 4
TISSUE = {**{preset: {"material": {"preset": preset}}
             for preset in ("face", "skin_on_fat", "incompressible")},
          "springs": {"springs": {"default": {"modulus": 0.05, "law": "quartic", "reference": 1.0}},
                      "turgor": 0.1}}
MOVING = 0.1  # mm: skin that moves less does not count for the mean
PATIENCE = 10  # s that a canceled solver has to end by itself
PREVIEW = 1  # mm, the accuracy of a preview
TEMPORARY = "repose_panel_"  # what the names of temporary folders begin with
ITERATION = re.compile(r"load (\S+)  iteration .* evaluations  (?:(\S+) mm to go)?")


class Canceled(Exception):
    """Slicer's Cancel button."""


# ----- what Slicer says


def parameters():
    """{name: XML element} of everything in Repose.xml."""
    root = xml.etree.ElementTree.parse(FOLDER / "Repose.xml").getroot()
    return {item.findtext("name"): item for group in root.iter("parameters") for item in group
            if item.find("name") is not None}


def help_text():
    """The flags of Repose.xml, with what each means."""
    lines = [f"--{name:<20} {' '.join((item.findtext('description') or '').split())}"
             for name, item in parameters().items() if item.find("longflag") is not None]
    return "Repose [--FLAG VALUE …]\nWhat the panel Repose of 3D Slicer does.\n\n" + "\n".join(lines)


def value_of(item, text):
    """A parameter's text as what its tag says."""
    name, kind = item.findtext("name"), item.tag
    limits = [item.findtext(f"constraints/{end}") for end in ("minimum", "maximum")]
    try:
        if kind in ("integer", "double"):
            number = int(text) if kind == "integer" else float(text)
            low, high = (float(end) for end in limits)
            if not low <= number <= high:
                raise ValueError
            return number
    except ValueError:
        what = "a whole number" if kind == "integer" else "a number"
        raise Refusal(f"--{name} {text}: give {what} from {' to '.join(limits)}") from None
    if kind == "string-vector":
        return [part.strip() for part in text.split(",") if part.strip()]
    choices = [element.text for element in item.findall("element")]
    if choices and text not in choices:
        raise Refusal(f"--{name} {text}: take one of {', '.join(choices)}")
    return text == "true" if kind == "boolean" else text


def parse(arguments):
    """The chosen value of every parameter with a flag; None for a file that is not given."""
    known = {name: item for name, item in parameters().items() if item.find("longflag") is not None}
    texts = {name: item.findtext("default") for name, item in known.items()}
    texts["returnparameterfile"] = None
    rest = list(arguments)
    while rest:
        flag, joined, text = rest.pop(0).partition("=")
        name = flag.removeprefix("--")
        if not flag.startswith("--") or name not in [*texts, "processinformationaddress"]:
            raise Refusal(f"{flag}: unknown; --help lists the flags")
        if name in known and known[name].tag == "boolean":
            texts[name] = "true"
            continue
        if not joined and not rest:
            raise Refusal(f"{flag}: a value is missing")
        texts[name] = text if joined else rest.pop(0)
    return {name: value_of(known[name], text) if name in known and text is not None else text
            for name, text in texts.items()}


def targets_of(chosen):
    """{parameter: Target} of the files that are written and chosen."""
    known = {name: item for name, item in parameters().items() if item.find("longflag") is not None}
    outputs = [name for name, item in known.items() if item.findtext("channel") == "output"]
    inputs = [chosen[name] for name, item in known.items()
              if "fileExtensions" in item.attrib and name not in outputs]
    targets = {name: Target(chosen[name], "", inputs) for name in [*outputs, "returnparameterfile"]
               if chosen[name]}
    first = {}  # the first output of each file
    for name in targets:
        if (other := first.setdefault(os.path.realpath(chosen[name]), name)) != name:
            raise Refusal(f"--{name} {chosen[name]}: is the file of --{other}, too; choose another one")
    return targets


# ----- the scene


def link(source, folder, name):
    """The file in the scene's folder, by the part it plays; its name there."""
    source = pathlib.Path(source)
    if not source.is_file():
        raise Refusal(f"{source}: {'is a folder, expected a file' if source.is_dir() else 'no such file'}")
    ending = ".mrk.json" if source.name.endswith(".mrk.json") else source.suffix
    target = folder / (name + ending)
    if ending.lower() == ".ply" and (turned := in_lps(source.read_bytes(), source)):
        target.write_bytes(turned)
    elif ending.lower() in (".stl", ".obj", ".off") and b"SPACE=RAS" in source.read_bytes()[:1000]:
        raise Refusal(f"{source}: in RAS, from which PLY files alone are converted; save it as LPS or as PLY")
    else:
        target.symlink_to(source.resolve())
    return target.name


def in_lps(data, name):
    """A PLY file whose header says SPACE=RAS, as Slicer writes it, in LPS; nothing for others."""
    import numpy as np
    with reading(name, "a PLY file"):
        header = Header(data)
        if not any("SPACE=RAS" in line for line in header.lines if line.startswith("comment")):
            return None
        if not header.columns:
            raise Refusal(f"{name}: in RAS, and its vertices do not come first; save it as LPS")
        if header.is_text:
            rows, rest = header.rows()
            body = b"\n".join([b" ".join(negated(row, header.columns)) for row in rows] + rest)
        else:
            vertices = np.frombuffer(header.body, header.layout(), header.count).copy()
            for axis in "xy":
                vertices[axis] *= -1
            body = vertices.tobytes() + header.body[vertices.nbytes:]
    return header.bytes.replace(b"SPACE=RAS", b"SPACE=LPS") + body


def negated(words, columns):
    """The words of an ASCII vertex with x and y negated."""
    return [repr(-float(word)).encode() if axis in "xy" else word
            for word, (_, axis) in zip(words, columns)]


def bone_entries(chosen, folder):
    """The scene's bones and moves, and the number in the panel of each bone."""
    bones, moves, numbers = [], [], []
    for i in range(1, BONES + 1):
        model, transform = chosen[f"bone{i}"], chosen[f"transform{i}"]
        if model is None:
            for name, given in (("transform", transform), ("moved model to write", chosen[f"movedBone{i}"])):
                if given:
                    raise Refusal(f"bone {i} has a {name} and no model; choose one")
            continue
        names = chosen["boneNames"]
        name = names[i - 1] if i <= len(names) else f"bone {i}"
        bones.append({"name": name, "file": link(model, folder, f"bone{i}")})
        if transform:
            moves.append({"bone": name, "transform": link(transform, folder, f"transform{i}")})
        numbers.append(i)
    return bones, moves, numbers


def write_scene(chosen, folder):
    """The scene file (JSON is YAML), and the number in the panel of each bone."""
    if chosen["skin"] is None:
        raise Refusal("no skin is chosen")
    bones, moves, numbers = bone_entries(chosen, folder)
    if not bones:
        raise Refusal("no bone is chosen")
    layers = chosen["layers"]
    scene = {"skin": link(chosen["skin"], folder, "skin"), "bones": bones,
             "tissue": {"layers": layers, **TISSUE[chosen["tissue"]]}, "moves": moves}
    if chosen["lips"]:
        scene["mouth"] = {"path": link(chosen["lips"], folder, "lips")}
    if chosen["incision"]:
        scene["incisions"] = [{"path": link(chosen["incision"], folder, "incision"),
                               "layers": min(chosen["incisionLayers"], layers)}]
    file = folder / "scene.yaml"
    file.write_text(json.dumps({key: value for key, value in scene.items() if value}, indent=1))
    return file, numbers


# ----- the solver


def accuracy_of(chosen):
    """The accuracy of the search, mm."""
    return max(chosen["accuracy"], PREVIEW) if chosen["preview"] else chosen["accuracy"]


def command(chosen, scene):
    from repose.programs import find_program  # needs NumPy
    line = [find_program("repose-solve"), str(scene), "-output", str(scene.with_name("result")), "-monitor_mm"]
    if chosen["preview"]:
        line += ["-profile", "preview"]
    elif chosen["uncertainty"]:
        line.append("-discretisation")
    line += ["-accuracy", str(accuracy_of(chosen))]
    if chosen["timeLimit"]:
        line += ["-time_limit", str(chosen["timeLimit"])]
    ranks, mpirun = chosen["processors"], shutil.which("mpirun")
    return [mpirun, "-n", str(ranks), *line] if ranks > 1 and mpirun else line


class Progress:
    """The share of the work that is done, from the solver's lines: of the loads reached, and of the
    next the orders of magnitude its search has taken off the distance. Told as Slicer reads it."""

    def __init__(self, accuracy):
        self.accuracy, self.load, self.reached, self.farthest, self.reported = accuracy, 0, 0, 0, 0

    def __call__(self, line):
        if not (match := ITERATION.search(line)):
            return
        load, to_go = float(match[1]), float(match[2] or "inf")
        if load != self.load:
            self.reached = max(self.reached, self.load) if load > self.load else self.reached
            self.load, self.farthest = load, 0
        if math.isfinite(to_go):
            self.farthest = max(self.farthest, to_go)
        share = 0
        if self.farthest > self.accuracy and 0 < to_go < self.farthest:
            share = math.log(self.farthest / to_go) / math.log(self.farthest / self.accuracy)
        done = self.reached + max(self.load - self.reached, 0) * min(share, 0.99)
        self.reported = max(self.reported, round(0.95 * done, 3))
        print(f"<filter-progress>{self.reported}</filter-progress>", flush=True)


def solve(chosen, scene):
    """Runs the solver to its end; its exit status and what it printed. Its failures are Refusals.
    Where this program is killed, the solver ends at its next line, which nobody reads."""
    line = command(chosen, scene)
    progress = Progress(accuracy_of(chosen))
    process = subprocess.Popen(line, cwd=scene.parent, text=True, errors="replace",
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=open(scene.with_name("stderr"), "w", encoding="utf-8"))
    printed = []
    try:
        for text in process.stdout:
            progress(text)
            if not ITERATION.search(text):
                printed.append(text)
        status = process.wait()
    except Canceled:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
        raise
    if status not in (0, 2):
        message = scene.with_name("stderr").read_text(errors="replace")
        own = [text for text in message.splitlines() if text.startswith(("error: ", "internal error"))]
        raise Refusal((own or message.splitlines() or [f"repose-solve ended with status {status}"])[0]
                      .removeprefix("error: ").replace(f"{scene.parent}/", ""))
    return status, "".join(printed)


# ----- the result


def data_array(name, values):
    """An array of a VTK XML file; strings as VTK writes them."""
    import numpy as np
    if isinstance(values, str):
        codes = " ".join(str(ord(c)) for c in values + "\0")
        return (f'<Array type="String" Name="{name}" NumberOfTuples="1" format="ascii">{codes}'
                "</Array>\n")
    values = np.ascontiguousarray(values)
    kind = "Int64" if values.dtype.kind == "i" else "Float64"
    across = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    size = np.array([values.nbytes], "<u8").tobytes()
    text = base64.b64encode(size + values.astype("<i8" if kind == "Int64" else "<f8").tobytes())
    return (f'<DataArray type="{kind}" Name="{name}"{across} format="binary">{text.decode()}'
            "</DataArray>\n")


def vtp_text(points, triangles, arrays):
    """A surface in LPS, as the field SPACE tells Slicer, with arrays at its points."""
    import numpy as np
    ends = 3 * np.arange(1, len(triangles) + 1)
    vectors = next((name for name, values in arrays.items() if values.ndim == 2), None)
    scalars = next((name for name, values in arrays.items() if values.ndim == 1), None)
    active = f' Vectors="{vectors}"' if vectors else ""
    active += f' Scalars="{scalars}"' if scalars else ""
    return ('<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" '
            'byte_order="LittleEndian" header_type="UInt64">\n<PolyData>\n<FieldData>\n'
            + data_array("SPACE", "LPS") + "</FieldData>\n"
            f'<Piece NumberOfPoints="{len(points)}" NumberOfVerts="0" NumberOfLines="0" '
            f'NumberOfStrips="0" NumberOfPolys="{len(triangles)}">\n'
            f"<PointData{active}>\n"
            + "".join(data_array(name, values) for name, values in arrays.items())
            + "</PointData>\n<Points>\n" + data_array("Points", points) + "</Points>\n<Polys>\n"
            + data_array("connectivity", triangles.ravel()) + data_array("offsets", ends)
            + "</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n")


def skin_to_hand_back(h5):
    """Points, triangles and arrays of the predicted skin: of the model that was given, displaced, where
    a remeshed part of it was solved."""
    import numpy as np
    from sheet.shown_skin import matching_rows, shown_skin, solved_skin
    step = h5["step"][sorted(h5["step"])[-1]]
    solved, used = solved_skin(h5)
    skin = shown_skin(h5)
    arrays = {"displacement": skin.after - skin.before, "displacement_magnitude": skin.movement}
    error, of_mesh = step.attrs["displacement_error"], step.attrs.get("discretisation_error")
    unsure = np.full(len(used), of_mesh or 0.0)
    if "point/discretisation_error" in step:
        unsure = step["point/discretisation_error"][:][used]
    if len(skin.before) != len(solved.before):
        arrays["computed"] = skin.solved
        unsure = np.where(skin.solved > 0, unsure[matching_rows(solved, skin)], 0.0)
    if math.isfinite(error):
        arrays["uncertainty"] = error * (skin.solved > 0) + unsure
    return skin.after, skin.corners, arrays


def hand_back(targets, result, numbers):
    """Writes the models that are requested; the numbers for the panel."""
    import h5py
    with h5py.File(result) as h5:
        step = h5["step"][sorted(h5["step"])[-1]]
        report = dict(step.attrs)
        points, triangles, arrays = skin_to_hand_back(h5)
        movement, ratio = arrays["displacement_magnitude"], step["prism/volume_ratio"][:]
        error, mesh_error = report["displacement_error"], report.get("discretisation_error")
        if "predictedSkin" in targets:
            targets["predictedSkin"].write(vtp_text(points, triangles, arrays))
        moved, first = step["bone_surface/points"][:] if "bone_surface/points" in step else None, 0
        for b, number in enumerate(numbers):
            surface = h5[f"model/bone_surface/{b}"]
            count = len(surface["points"])
            if f"movedBone{number}" in targets:
                where = surface["points"][:] if moved is None else moved[first:first + count]
                targets[f"movedBone{number}"].write(vtp_text(where, surface["triangles"][:], {}))
            first += count
    moving = movement[movement > MOVING]
    return {"accuracyReached": float(error) if math.isfinite(error) else -1,
            "meshError": -1 if mesh_error is None else float(mesh_error),
            "largestMovement": float(movement.max(initial=0)),
            "meanMovement": float(moving.mean()) if len(moving) else 0.0,
            "volumeChange": 100 * float(abs(ratio - 1).max(initial=0)),
            "invertedPrisms": int(report["inverted_prisms"])}, report


def verdict(status, report, accuracy, preview):
    """One line for the panel."""
    load, error = report["load"], report["displacement_error"]
    if status == 0 and error <= accuracy:
        if preview:
            return (f"PREVIEW, to {accuracy:g} mm: the face is within {error:.3g} mm of rest; "
                    "apply without First look for the result")
        return f"accuracy reached: {error:.3g} mm of {accuracy:g} mm"
    if report["converged"] and report["inverted_prisms"]:
        return (f"FOLDED: {report['inverted_prisms']} prisms of tissue are inside out; move less, or release tissue "
                "there in a scene")
    reason = report["reason"].decode() if isinstance(report["reason"], bytes) else str(report["reason"])
    near = f"about {error:.3g} mm" if math.isfinite(error) else "at no known distance"
    where = "" if load == 1 else f"; the bones have made {100 * load:.0f} % of their way only"
    return f"ACCURACY NOT REACHED: the face is {near} from rest{where} ({reason})"


def work(chosen, folder):
    targets = targets_of(chosen)
    scene, numbers = write_scene(chosen, folder)
    print("<filter-start><filter-name>Repose</filter-name></filter-start>", flush=True)
    status, printed = solve(chosen, scene)
    returned, report = hand_back(targets, scene.with_name("result.h5"), numbers)
    returned = {"verdict": verdict(status, report, accuracy_of(chosen), chosen["preview"]), **returned}
    if "resultFile" in targets:
        targets["resultFile"].write(scene.with_name("result.h5").read_bytes())
    if "returnparameterfile" in targets:
        lines = [f"{name} = {value if isinstance(value, str) else format(value, '.6g')}\n"
                 for name, value in returned.items()]
        targets["returnparameterfile"].write("".join(lines))
    print(printed.replace(f"{folder}/", "") + returned["verdict"])
    print("<filter-progress>1</filter-progress>", flush=True)


# ----- the program


SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


def cancel(*_):
    """Ends the run. Further signals must not interrupt the cleaning."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    raise Canceled


def lock(folder):
    """Marks a temporary folder as in use for as long as this process lives."""
    held = open(folder / "new", "w", encoding="ascii")
    fcntl.flock(held, fcntl.LOCK_EX)
    (folder / "new").rename(folder / "lock")
    return held


def remove_abandoned():
    """Removes the temporary folders of processes that were killed."""
    for abandoned in pathlib.Path(tempfile.gettempdir()).glob(f"{TEMPORARY}*/lock"):
        try:
            with open(abandoned, encoding="ascii") as held:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(abandoned.parent, ignore_errors=True)
        except OSError:  # in use, or another user's
            continue


def run():
    import h5py  # a missing module is reported before the search
    import numpy
    remove_abandoned()
    with tempfile.TemporaryDirectory(prefix=TEMPORARY, ignore_cleanup_errors=True) as name:
        folder = pathlib.Path(name).resolve()
        with lock(folder):
            work(parse(sys.argv[1:]), folder)


def main():
    if (HELP | {"--xml"}) & set(sys.argv[1:]):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # a reader that goes away ends it in silence
        description = (FOLDER / "Repose.xml").read_text(encoding="utf-8")
        print(description if "--xml" in sys.argv[1:] else help_text() + "\n", end="")
        return 0
    try:
        for number in SIGNALS:
            signal.signal(number, cancel)
        run()
    except ImportError as missing:  # h5py raises it for a missing numpy
        print(f"Repose: {missing.name} is missing in {sys.executable}: apt-get install python3-numpy "
              "python3-h5py", file=sys.stderr)
        return 1
    except (Refusal, OSError) as reason:
        print(f"Repose: {reason}", file=sys.stderr)
        return 1
    except Canceled:
        print("Repose: canceled", file=sys.stderr)
        return 128 + signal.SIGTERM
    return 0


sys.exit(main())
