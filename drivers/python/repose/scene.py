"""A scene file."""

import hashlib
import os
import pathlib
import re

LARGEST = 1 << 20  # bytes, as of the programs


class Scene:
    """The path of a scene file (YAML) with a plan; `with_plan` writes a copy that has one."""

    def __init__(self, path):
        self.path = pathlib.Path(path).resolve()
        if not self.path.is_file():
            raise FileNotFoundError(f"{path}: there is no such scene")

    def _text(self):
        """The scene as text; ValueError where it cannot be YAML."""
        if self.path.stat().st_size > LARGEST:
            raise ValueError(f"{self.path}: too large for a scene file (1 MiB allowed); give a scene file (.yaml)")
        content = self.path.read_bytes()
        if re.search(rb"[\x00-\x08\x0e-\x1f\x7f]", content):
            raise ValueError(f"{self.path}: not a text file; give a scene file (.yaml)")
        return content.decode(errors="replace")

    def files(self):
        """The scene file, then the files that it names."""
        words = set(re.findall(r"[^\s:,\[\]{}\"'#]+", self._text()))
        named = sorted(self.path.parent / word for word in words)
        return [self.path, *(file for file in named if os.path.isfile(file))]

    def fingerprint(self, program=None):
        """A hash of the scene without its comments, of the files that it names, and of the solver."""
        text = self._text()
        digest = hashlib.sha256(re.sub(r"\s+#.*|^#.*", "", text, flags=re.M).encode())
        for file in self.files()[1:]:
            digest.update(os.path.relpath(file, self.path.parent).encode() + file.read_bytes())
        if program:
            status = os.stat(program)
            digest.update(f"{status.st_size} {status.st_mtime_ns}".encode())
        return digest.hexdigest()[:16]

    def with_plan(self, pieces, path, translate=(10, 10, 10), rotate=(10, 10, 10)):
        """Writes the scene with a plan of these pieces to `path` and returns it. `path` must lie in
        the scene's folder, as files that a scene names are relative to it."""
        path = pathlib.Path(path).resolve()
        if path.parent != self.path.parent:
            raise ValueError(f"{path}: must lie in {self.path.parent}")
        text = self.path.read_text(encoding="utf-8-sig")
        if any(line.startswith("plan:") for line in text.splitlines()):
            raise ValueError(f"{self.path}: the scene has a plan already")
        numbers = [", ".join(f"{value:g}" for value in box) for box in (translate, rotate)]
        path.write_text(f"{text.rstrip()}\nplan:\n  pieces: [{', '.join(pieces)}]\n"
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
        """Returns whether the content differs; files that are gone count as changed."""
        try:
            stamps = self._stamps()
            if stamps == self.stamps:
                return False
            if self.scene.fingerprint() != self.first:
                return True
        except OSError:
            return True
        self.stamps = stamps
        return False
