"""The profile as a drawing (SVG): the cut through the plane of symmetry, before and after, with the
outline of the bones, the landmarks and a scale. It looks to the right."""

import numpy as np

from sheet.landmarks import ABOVE_CHIN, MIDLINE, by_shape, on_surface

HEIGHT, MARGIN = 620, 16
COLORS = ("before", "after", "other")


def middle_plane(skin, known):
    """Point and normal of the plane of symmetry: through the landmarks of the midline, upright, without
    those of a chin, which may lie aside, where three others are known; the middle of the skin where there
    are none."""
    points = np.array([known[name][0] for name in ABOVE_CHIN if name in known])
    if len(points) < 3:
        points = np.array([known[name][0] for name in MIDLINE if name in known])
    if len(points) == 0:
        return (skin.before.min(0) + skin.before.max(0)) / 2, np.array([1.0, 0, 0])
    middle, normal = points.mean(0), np.array([1.0, 0, 0])
    if len(points) >= 3:
        direction = np.linalg.svd(points - middle)[2][0]
        normal -= direction * (normal @ direction)
    return middle, normal / np.linalg.norm(normal)


def complete(known, skin):
    """Adds landmarks {name: (before, after)} by the shape of the profile where they are not given. Returns the
    names of those but sublabiale, and the plane of symmetry."""
    guessed = [] if {"subnasale", "pogonion"} <= known.keys() else add_by_shape(known, skin)
    plane = middle_plane(skin, known)
    add_sublabiale(known, skin, plane)
    return guessed, plane


def add_by_shape(known, skin):
    tip = known["pronasale"][0] if "pronasale" in known else skin.before[np.argmin(skin.before[:, 1])]
    for aside in (0, 1.5, -1.5, 3, -3):
        plane = np.array([tip[0] + aside, 0, 0]), np.array([1.0, 0, 0])
        found = by_shape(cut(skin.before, skin.corners, plane)[0])
        if found:
            break
    missing = [name for name in found if name not in known]
    for name in missing:
        known[name] = on_surface(skin.before, skin.after, skin.corners, found[name])[:2]
    return missing


def add_sublabiale(known, skin, plane):
    """Adds the deepest place of the profile between lower lip and chin."""
    points = cut(skin.before, skin.corners, plane)[0].reshape(-1, 3)
    if "sublabiale" in known or not {"lower lip", "pogonion"} <= known.keys() or len(points) == 0:
        return
    lip, chin = known["lower lip"][0], known["pogonion"][0]
    line = (chin - lip) / np.linalg.norm(chin - lip)
    along = (points - lip) @ line
    behind = points - lip - along[:, None] * line
    depth = np.where((along > 0) & (along < np.linalg.norm(chin - lip)) &
                     (np.linalg.norm(behind, axis=1) < 20), behind[:, 1], -np.inf)
    if depth.max() > 0:
        deepest = points[np.argmax(depth)]
        known["sublabiale"] = on_surface(skin.before, skin.after, skin.corners, deepest)[:2]


def cut(points, corners, plane):
    """Segments [n, 2, 3] in which a plane cuts a surface, and the edges [n, 2] of its mesh, as numbers,
    on which their ends lie."""
    middle, normal = plane
    height = (points - middle) @ normal
    height = np.where(height == 0, 1e-12, height)
    crossed = corners[np.ptp(np.sign(height[corners]), axis=1) > 0]
    if len(crossed) == 0:
        return np.zeros((0, 2, 3)), np.zeros((0, 2), int)
    ends = np.stack([crossed, np.roll(crossed, 1, axis=1)], axis=2)
    across = height[ends[..., 0]] * height[ends[..., 1]] < 0
    ends = ends[across].reshape(-1, 2, 2)
    share = height[ends[..., 0]] / (height[ends[..., 0]] - height[ends[..., 1]])
    places = points[ends[..., 0]] + share[..., None] * (points[ends[..., 1]] - points[ends[..., 0]])
    keys = ends.min(-1) * len(points) + ends.max(-1)
    return places, keys


def lines(segments, keys):
    """The segments joined to polylines [n, 3], longest first."""
    at = {}
    for i, pair in enumerate(keys):
        for key in pair:
            at.setdefault(key, []).append(i)
    used, found = np.zeros(len(segments), bool), []
    open_ends = [i for i, pair in enumerate(keys) if any(len(at[key]) == 1 for key in pair)]
    for start in [*open_ends, *range(len(segments))]:
        if used[start]:
            continue
        side = 0 if len(at[keys[start][0]]) == 1 else 1
        path, segment = [segments[start][side]], start
        while segment is not None and not used[segment]:
            used[segment] = True
            side = 1 - side
            path.append(segments[segment][side])
            key = keys[segment][side]
            segment = next((i for i in at[key] if not used[i]), None)
            if segment is not None:
                side = 0 if keys[segment][0] == key else 1
        found.append(np.array(path))
    return sorted(found, key=lambda path: -np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def outlines(points, corners, plane, shortest=6.0):
    """The polylines of a cut that are longer than `shortest`, mm."""
    return [line for line in lines(*cut(points, corners, plane))
            if np.linalg.norm(np.diff(line, axis=0), axis=1).sum() > shortest]


def simple(line, tolerance=0.12):
    """A polyline with fewer points, within a tolerance in mm (Douglas and Peucker)."""
    keep, todo = np.zeros(len(line), bool), [(0, len(line) - 1)]
    keep[[0, -1]] = True
    while todo:
        first, last = todo.pop()
        if last - first < 2:
            continue
        chord, between = line[last] - line[first], line[first + 1:last] - line[first]
        length = np.linalg.norm(chord)
        off = np.linalg.norm(np.cross(chord, between), axis=1) / length if length > 0 \
            else np.linalg.norm(between, axis=1)
        farthest = int(np.argmax(off))
        if off[farthest] > tolerance:
            middle = first + 1 + farthest
            keep[middle] = True
            todo += [(first, middle), (middle, last)]
    return line[keep]


class Frame:
    """From mm to the drawing: the front of the face, from above the brows to below the chin."""

    def __init__(self, skins, known):
        points = np.concatenate([line for lines_of in skins for line in lines_of])
        low, high = points.min(0), points.max(0)
        top, bottom = high[2], low[2]
        if "pronasale" in known:
            tip = known["pronasale"][0]
            top, bottom = min(top, tip[2] + 75), max(bottom, tip[2] - 135)
        shown = points[(points[:, 2] <= top) & (points[:, 2] >= bottom)]
        front = shown[:, 1].min()
        self.top, self.bottom, self.front = top + 3, bottom - 3, front - 6
        self.scale = HEIGHT / (self.top - self.bottom)
        self.back = min(high[1], front + 0.62 * (self.top - self.bottom))
        self.width = self.scale * (self.back - self.front)

    def at(self, point):
        return (f"{MARGIN + self.scale * (self.back - point[1]):.1f} "
                f"{MARGIN + self.scale * (self.top - point[2]):.1f}")

    def path(self, line):
        return "M" + "L".join(self.at(point) for point in simple(line))


def scale_bar(frame):
    x, y, length = frame.width + MARGIN + 8, MARGIN + HEIGHT + 34, 20 * frame.scale
    return (f'<path class="scale" d="M{x:.1f} {y - 5}v5h{length:.1f}v-5"/>'
            f'<text class="small" x="{x:.1f}" y="{y - 12}">20 mm</text>')


def marks(frame, known, states):
    """The landmarks in each state, with lines from before to after and names beside the face."""
    parts, last = [], -99.0
    named = sorted((name for name in MIDLINE if name in known), key=lambda n: -known[n][0][2])
    for name in named:
        places = [frame.at(place).split() for place in known[name][:len(states)]]
        for (x, y), state in zip(places, states):
            parts.append(f'<circle class="{state}" cx="{x}" cy="{y}" r="3.2"/>')
        y = last = max(float(places[0][1]) + 4, last + 15)
        parts.append(f'<text class="small" x="{frame.width + MARGIN + 8:.0f}" y="{y:.0f}">{name}'
                     '</text>')
    return "".join(parts)


def drawing(skins, bones, known, states):
    """The drawing of polylines of the skin, a list a state, and [(state, polylines)] of bones."""
    if not skins[0]:
        return "<p>The plane of symmetry does not meet the skin.</p>"
    frame = Frame(skins, known)
    wide, high = frame.width + 2 * MARGIN + 84, HEIGHT + 2 * MARGIN + 34
    parts = [f'<svg class="profile" viewBox="0 0 {wide:.0f} {high}" role="img" '
             'aria-label="profile before and after, looking to the right">'
             f'<defs><clipPath id="face"><rect x="0" y="{MARGIN}" width="{wide - 84:.0f}" '
             f'height="{HEIGHT}"/></clipPath></defs><g clip-path="url(#face)">']
    for state, outline in bones:
        path = "".join(frame.path(line) for line in outline)
        parts.append(f'<path class="bone {state}" d="{path}"/>')
    for state, outline in zip(states, skins):
        path = "".join(frame.path(line) for line in outline)
        parts.append(f'<path class="{state}" d="{path}"/>')
    return "".join([*parts, "</g>", marks(frame, known, states), scale_bar(frame), "</svg>"])
