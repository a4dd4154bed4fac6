"""A scene file."""

import contextlib
import glob
import hashlib
import json
import os
import pathlib
import re

LARGEST = 1 << 20  # bytes, as of the programs
VALUE = r"(?::\s+|^(?:[ \t]*-\s+)+)(?:[&!]\S+\s+)*"  # begin of a value in YAML, behind its anchor and tag
# Words, texts that end in a list or map, and texts that end with their line.
SEPARATORS = (r"[\s:,\[\]{}\"'#]+", rf"{VALUE}|[,\[\]{{}}]|\s#|\n", rf"{VALUE}|\s#|\n")


def texts_in(yaml):
    """The texts in YAML that may be the names of files; not all of them are values."""
    texts = {part.strip("\"' \t\r") for separator in SEPARATORS
             for part in re.split(separator, yaml, flags=re.M)}
    texts |= {text.replace("''", "'") for text in re.findall(r"'((?:[^'\n]|'')*)'", yaml)}
    for text in re.findall(r'"(?:[^"\\\n]|\\.)*"', yaml):
        with contextlib.suppress(ValueError):  # escapes that JSON does not have
            texts.add(json.loads(text))
    return sorted(texts - {""})


def voxel_files(header):
    """The files that hold the voxels of a header of MetaImage or NRRD."""
    if header.suffix.lower() not in (".mhd", ".mha", ".nhdr", ".nrrd"):
        return []
    with header.open("rb") as file:
        text = file.read(LARGEST).decode(errors="replace")
    key = re.search(r"^(?:ElementDataFile|data ?file)[ \t]*[=:][ \t=:]*(.*)", text, flags=re.M | re.I)
    names = [key[1].strip()] if key else []
    if key and names[0].startswith("LIST"):
        names = [line.strip() for line in text[key.end():].splitlines()]
    elif key and "%" in names[0]:  # a name of numbered files, then their numbers
        parts = re.split(r"%\d*d", re.sub(r"(\s+-?\d+)*$", "", names[0]))
        parts[0] = f"{header.parent}/{parts[0]}"
        return map(pathlib.Path, glob.glob("*".join(map(glob.escape, parts))))
    return [header.parent / name for name in names]


def is_dicom(file):
    """Returns whether a file has the mark of DICOM."""
    if not os.path.isfile(file):
        return False
    with file.open("rb") as content:
        return content.read(132)[128:] == b"DICM"


class Scene:
    """The path of a scene file (YAML) with a plan; `with_plan` writes a copy that has one."""

    def __init__(self, path):
        self.path = pathlib.Path(path).resolve()
        if not self.path.is_file():
            reason = "is a folder" if self.path.is_dir() else "there is no such scene"
            raise FileNotFoundError(f"{path}: {reason}; give a scene file (.yaml)")

    def _text(self):
        """The scene as text without its comments; ValueError where it cannot be YAML."""
        if self.path.stat().st_size > LARGEST:
            raise ValueError(f"{self.path}: too large for a scene file (1 MiB allowed); give a scene file (.yaml)")
        content = self.path.read_bytes()
        if re.search(rb"[\x00-\x08\x0e-\x1f\x7f]", content):
            raise ValueError(f"{self.path}: not a text file; give a scene file (.yaml)")
        return re.sub(r"""^([^"'\n]*?)(?:\s+|(?<!\S))#.*""", r"\1", content.decode(errors="replace"), flags=re.M)

    def files(self):
        """The scene file, then the files that it names, those that hold their voxels, and DICOM slices."""
        text, folder = self._text(), self.path.parent
        named = [folder / name for name in texts_in(text) if os.path.isfile(folder / name)]
        named += [file for header in named for file in voxel_files(header)]
        volumes = texts_in("\n".join(re.findall(r"\bvolume[\"']?\s*:\s*(.*)", text)))
        for volume in (folder / name for name in volumes if os.path.isdir(folder / name)):
            others_too = os.path.samefile(volume, folder)  # the scene and what is made from it
            named += [file for file in volume.iterdir() if not others_too or is_dicom(file)]
        return [self.path, *sorted({file for file in named if os.path.isfile(file)})]

    def fingerprint(self, program=None):
        """A hash of the scene without its comments, of the files that it names, and of the solver."""
        digest = hashlib.sha256(self._text().encode())
        for file in self.files()[1:]:
            digest.update(os.path.relpath(file, self.path.parent).encode() + file.read_bytes())
        if program:
            status = os.stat(program)
            digest.update(f"{status.st_size} {status.st_mtime_ns}".encode())
        return digest.hexdigest()[:16]

    def with_plan(self, pieces, path, translate=(10, 10, 10), rotate=(10, 10, 10)):
        """Writes the scene with a plan of these pieces to `path` and returns it. `path` must lie in
        the scene's folder, as files that a scene names are relative to it."""
        pieces = [pieces] if isinstance(pieces, str) else list(pieces)
        path = pathlib.Path(path).resolve()
        if path.parent != self.path.parent:
            raise ValueError(f"{path}: must lie in {self.path.parent}")
        text = self.path.read_text(encoding="utf-8-sig")
        if any(line.startswith("plan:") for line in text.splitlines()):
            raise ValueError(f"{self.path}: the scene has a plan already")
        numbers = [", ".join(f"{value:g}" for value in box) for box in (translate, rotate)]
        path.write_text(f"{text.rstrip()}\nplan:\n  pieces: {json.dumps(pieces, ensure_ascii=False)}\n"
                        f"  box: {{translate: [{numbers[0]}], rotate: [{numbers[1]}]}}\n",
                        encoding="utf-8")
        return Scene(path)


class SceneWatch:
    """Says whether a scene or a file that it names has changed since."""

    def __init__(self, scene):
        self.scene = scene
        self.first, self.stamps = scene.fingerprint(), self._stamps()

    def _stamps(self):
        return [(file, file.stat().st_size, file.stat().st_mtime_ns) for file in self.scene.files()]

    def changed(self):
        """Returns whether the content differs; files that are gone, and no scene, count as changed."""
        try:
            stamps = self._stamps()
            if stamps == self.stamps:
                return False
            if self.scene.fingerprint() != self.first:
                return True
        except (OSError, ValueError):
            return True
        self.stamps = stamps
        return False
