"""Colors or a photograph of a mesh of the skin, for the face that is shown: PLY with colors, OBJ with
colors or a texture."""

import base64
import pathlib
import re

import numpy as np

from sheet.ply import Header
from sheet.script import Unusable, reading
from sheet.shown_skin import FARTHEST, Skin, matching_rows, median_distance, nearest

LARGEST_IMAGE = 2_000_000  # bytes: the page must stay below 5 MB


class Appearance:
    """A skin to show with colors [n, 3] of its vertices, or texture coordinates and an image."""

    def __init__(self, skin, colors=None, uv=None, image=None):
        self.skin, self.colors, self.uv, self.image = skin, colors, uv, image

    def arrays(self):
        named = {"colors": self.colors, "uv": self.uv}
        return {name: np.asarray(values, float) for name, values in named.items()
                if values is not None}


def read_appearance(file, skin):
    """The appearance that a mesh file gives the shown skin; None where it has none."""
    ending = pathlib.Path(file).suffix.lower()
    with reading(file, "a mesh of the skin"):
        if ending == ".ply":
            points, colors = read_ply(file)
            return None if colors is None else colored(points, colors, skin, file)
        return read_obj(file, skin) if ending == ".obj" else None


def colored(points, colors, skin, file):
    """The skin with the colors of the nearest vertices of a mesh."""
    require_of_skin(points, skin, file)
    return Appearance(skin, colors[nearest(points, skin.before)])


def require_of_skin(points, skin, file):
    """Refuses a mesh of another skin, or in another frame or unit; one of them may be a part of the other."""
    distance = min(median_distance(skin.before, points), median_distance(points, skin.before))
    if distance > FARTHEST:
        raise Unusable(f"{file}: lies {distance:.0f} mm from the skin of the result in the median, allowed "
                       f"are {FARTHEST:g} mm; give a mesh of this skin, in LPS and mm")


def read_ply(file):
    """Points and colors of the vertices, None where it has no colors."""
    header = Header(pathlib.Path(file).read_bytes())
    if not {"red", "green", "blue"} <= {column[-1] for column in header.columns}:
        return None, None
    vertices = header.vertices()
    points, colors = (np.stack([vertices[name] for name in three], 1).astype(float)
                      for three in (("x", "y", "z"), ("red", "green", "blue")))
    if not np.isfinite([points, colors]).all():
        raise ValueError("a vertex or color is not a finite number")
    whole = any(kind.startswith(("u", "i")) for kind, name in header.columns if name == "red")
    return points, colors if whole else 255 * colors


def read_obj(file, skin):
    """The mesh of an OBJ file, moved with the skin, if it has colors or a texture."""
    points, uv, faces, library = [], [], [], None
    for line in pathlib.Path(file).read_text(errors="replace").splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "v":
            points.append([float(word) for word in words[1:7]])
        elif words[0] == "vt":
            uv.append([float(word) for word in words[1:3]])
        elif words[0] == "f":
            corners = [rows_of(word, (len(points), len(uv))) for word in words[1:]]
            faces += [(corners[0], *corners[k:k + 2]) for k in range(1, len(corners) - 1)]
        elif words[0] == "mtllib":
            library = line.split(maxsplit=1)[1].strip()
    image = texture(pathlib.Path(file), library) if uv and library else None
    if image and all(len(corner) > 1 and corner[1] for face in faces for corner in face):
        return textured(points, uv, faces, image, skin, file)
    if points and len(points[0]) >= 6:
        rows = np.array([point[:6] for point in points])
        return colored(rows[:, :3], 255 * rows[:, 3:], skin, file)
    return None


def rows_of(corner, counts):
    """Rows from 1, or 0 for none, of the place and texture coordinate of a corner of a face; -1 is the last so far."""
    rows = [int(row or 0) for row in corner.split("/")]
    if any(row < -count for row, count in zip(rows, counts)):
        raise ValueError(f"a face has a vertex that is not there: {corner}")
    return [row if row >= 0 else count + 1 + row for row, count in zip(rows, counts)]


def texture(file, library):
    """The image of the first map_Kd of a material library, as a data URL."""
    described = file.parent / library
    found = re.search(r"^\s*map_Kd\s+(.+)$", described.read_text(errors="replace"), re.M) \
        if described.is_file() else None
    if not found:
        return None
    image = file.parent / found[1].strip()
    kind = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg"}.get(image.suffix.lower())
    if not image.is_file() or not kind:
        return None
    if image.stat().st_size > LARGEST_IMAGE:
        raise Unusable(f"{image}: {image.stat().st_size / 1e6:.1f} MB, at most "
                       f"{LARGEST_IMAGE / 1e6:g} MB fit the page; save it smaller, as JPEG")
    return f"data:image/{kind};base64," + base64.b64encode(image.read_bytes()).decode()


def textured(points, uv, faces, image, skin, file):
    """A vertex for each pair of place and texture coordinate."""
    pairs, corners = np.unique(np.reshape(faces, (-1, 2)) - 1, axis=0, return_inverse=True)
    before = np.array([point[:3] for point in points])[pairs[:, 0]]
    require_of_skin(before, skin, file)
    shown = Skin(before, before, corners.reshape(-1, 3), np.zeros(len(before)))
    near = matching_rows(skin, shown)
    shown = Skin(before, before + (skin.after - skin.before)[near], shown.corners, skin.solved[near])
    return Appearance(shown, uv=np.array(uv)[pairs[:, 1]], image=image)
