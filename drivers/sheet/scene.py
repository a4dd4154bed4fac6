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


class Loader(yaml.SafeLoader):
    """YAML as the programs read it: tags are ignored, and dates and `=` are texts."""
    yaml_implicit_resolvers = {
        first: [(tag, form) for tag, form in resolvers if not tag.endswith((":timestamp", ":value"))]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()}

    def construct_tagged(self, _, node):
        if isinstance(node, yaml.ScalarNode):
            return self.construct_scalar(node)
        kind = self.construct_mapping if isinstance(node, yaml.MappingNode) else self.construct_sequence
        return kind(node, deep=True)


Loader.add_multi_constructor("!", Loader.construct_tagged)
# yaml-cpp takes a tab for a blank, and the others break no line.
BLANKS = str.maketrans("\t\x85\u2028\u2029", "    ")


def parse(file, read):
    """Returns the result of `read` (yaml.load, yaml.compose) for the text of a scene, and the text."""
    with reading(file, "a scene in YAML"):
        text = pathlib.Path(file).read_text(encoding="utf-8-sig").translate(BLANKS)
        try:
            return read(text, Loader), text
        except yaml.YAMLError as reason:
            raise ValueError(" ".join(str(reason).split())) from None


def read_scene(file):
    """The keys of a scene and their values."""
    scene, _ = parse(file, yaml.load)
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


def bones_of(file):
    """The names of a scene's bones and of the pieces cut off them; none where it has no bones."""
    scene = read_scene(file)
    with reading(file, "a scene that repose-solve takes"):
        bones = [entry["name"] for entry in scene.get("bones") or []]
        return {*bones, *(cut["piece"] for cut in scene.get("osteotomies") or [])} if bones else set()


def require_same_bones(file, results):
    """Refuses a scene with other bones and pieces than each of the results {name: names of its bones}."""
    bones = bones_of(file)
    if bones and bones not in [set(names) for names in results.values()]:
        known = "; ".join(f"of {name}: {', '.join(sorted(names))}" for name, names in results.items())
        raise Unusable(f"{file}: another plan's scene: its bones and pieces are {', '.join(sorted(bones))}; those "
                       f"{known}; give the scene that was solved, or leave it out")


def without_moves(root, text):
    """The lines of a scene without its moves, the number of its first key's line, and how far its keys are indented."""
    lines, last = text.splitlines(), root.end_mark
    starts = [key.start_mark for key, _ in root.value]
    ends = [mark.line for mark in starts[1:]] + [last.line + (last.column > 0)]
    for (key, _), begin, end in zip(root.value, starts, ends):
        if key.value == "moves":
            while lines[end - 1].lstrip()[:1] in ("", "#"):  # comments of the next key
                end -= 1
            del lines[begin.line:end]
    return lines, starts[0].line, starts[0].column


def is_whole(lines):
    """Returns whether lines are YAML without references to what is not there."""
    try:
        return yaml.compose("\n".join(lines), Loader) is not None
    except yaml.YAMLError:
        return False


def with_moves(file, moves):
    """The text of a scene with these moves {piece: 4×4 matrix} in place of its own. Comments stay, but of JSON and where
    other keys refer to the former moves."""
    root, text = parse(file, yaml.compose)
    if not isinstance(root, yaml.MappingNode) or not root.value:
        raise NotKeys(file)
    lines, first, indent = ([], 0, 0) if root.flow_style else without_moves(root, text)
    if not is_whole(lines):
        root.flow_style = False
        root.value = [entry for entry in root.value if entry[0].value != "moves"]
        lines, first, indent = yaml.serialize(root, allow_unicode=True).splitlines(), 0, 0
    rows = [f"{' ' * indent}  - {{bone: {json.dumps(piece)}, transform: {json.dumps(matrix)}}}"
            for piece, matrix in moves.items()]
    lines[first:first] = [f"{' ' * indent}moves:{'' if rows else ' []'}", *rows]
    return "\n".join(lines) + "\n"
