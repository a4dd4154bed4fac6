"""A scene file."""

import pathlib


class Scene:
    """The path of a scene file (YAML) with a plan; `with_plan` writes a copy that has one."""

    def __init__(self, path):
        self.path = pathlib.Path(path).resolve()
        if not self.path.is_file():
            raise FileNotFoundError(f"{path}: there is no such scene")

    def with_plan(self, pieces, path, translate=(10, 10, 10), rotate=(10, 10, 10)):
        """Writes the scene with a plan of these pieces to `path` and returns it. `path` must lie in
        the scene's folder, as files that a scene names are relative to it."""
        path = pathlib.Path(path).resolve()
        if path.parent != self.path.parent:
            raise ValueError(f"{path}: must lie in {self.path.parent}")
        text = self.path.read_text(encoding="utf-8")
        if any(line.startswith("plan:") for line in text.splitlines()):
            raise ValueError(f"{self.path}: the scene has a plan already")
        numbers = [", ".join(f"{value:g}" for value in box) for box in (translate, rotate)]
        path.write_text(f"{text.rstrip()}\nplan:\n  pieces: [{', '.join(pieces)}]\n"
                        f"  box: {{translate: [{numbers[0]}], rotate: [{numbers[1]}]}}\n",
                        encoding="utf-8")
        return Scene(path)
