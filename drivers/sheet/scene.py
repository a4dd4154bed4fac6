"""Scene files (YAML), as scripts read them."""

import json
import os
import pathlib

from sheet.script import Unusable, reading, refuse_missing

try:
    import yaml
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-yaml, or pip install pyyaml")


class NotKeys(Unusable):
    """A file of YAML that is no scene."""

    def __init__(self, file):
        super().__init__(f"{file}: not a scene: it holds no keys such as skin, bones and tissue")


def parse(file, read):
    """What `read` (yaml.safe_load, yaml.compose) makes of the text of a scene, and the text."""
    with reading(file, "a scene in YAML"):
        text = pathlib.Path(file).read_text(encoding="utf-8-sig")
        try:
            return read(text), text
        except yaml.YAMLError as reason:
            raise ValueError(" ".join(str(reason).split())) from None


def read_scene(file):
    """The keys of a scene and their values."""
    scene, _ = parse(file, yaml.safe_load)
    if not isinstance(scene, dict):
        raise NotKeys(file)
    return scene


def named_file(file, key):
    """The path of the file that the anatomy of a scene, or the scene, names by this key; None where neither does."""
    scene = read_scene(file)
    for keys in (scene.get("anatomy"), scene):
        if isinstance(keys, dict) and isinstance(keys.get(key), str):
            return os.path.join(os.path.dirname(file), keys[key])
    return None


def with_moves(file, moves):
    """The text of a scene with these moves {piece: 4×4 matrix} in place of its own."""
    root, text = parse(file, yaml.compose)
    if not isinstance(root, yaml.MappingNode):
        raise NotKeys(file)
    if root.flow_style:  # as JSON is
        root.flow_style = False
        text = yaml.serialize(root, allow_unicode=True)
        root = yaml.compose(text)
    lines, last = text.splitlines(), root.end_mark
    starts = [key.start_mark.line for key, _ in root.value] + [last.line + (last.column > 0)]
    for (key, _), begin, end in zip(root.value, starts, starts[1:]):
        if key.value == "moves":
            while lines[end - 1].lstrip()[:1] in ("", "#"):  # comments of the next key
                end -= 1
            del lines[begin:end]
    indent = " " * root.start_mark.column
    rows = [f"{indent}  - {{bone: {json.dumps(piece)}, transform: {json.dumps(matrix)}}}"
            for piece, matrix in moves.items()]
    lines[starts[0]:starts[0]] = [f"{indent}moves:{'' if rows else ' []'}", *rows]
    return "\n".join(lines) + "\n"
