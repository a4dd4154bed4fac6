"""Landmarks: read, placed on skin and bones, found by the shape of the profile, and the parts of the
face that they bound. In mm along the axes of the head: +x patient left, +y posterior, +z up."""

import csv
import json
import math
import pathlib
import re

import numpy as np

from sheet.script import Unusable, is_number, reading

RISE = math.radians(14)  # of nasion and upper incisors as seen from the condyles, together
SAME = 1e-3  # mm: two landmarks of one name nearer than that are one
NEAR = 5.0  # mm: a landmark farther from skin and bones belongs to neither
OFF_SURFACE = 15.0  # mm, farther than a landmark is ever placed beside it, as in src/anatomy/same_head.cpp
BEYOND = "skin beyond the solved part"
STANDARD = {  # {name: other spellings}; first those of src/scene/landmark_names.cpp, then the page's own
    "nasion_bone": ("nasion", "n", "na"), "nasal_spine": ("anterior nasal spine", "ans", "sp"),
    "a_point": ("a", "point a", "subspinale", "ss"),
    "upper_incisor_edge": ("upper incisal edge", "upper incisor", "u1", "is"),
    "lower_incisor_edge": ("lower incisal edge", "lower incisor", "l1", "ii"),
    "b_point": ("b", "point b", "supramentale", "sm"), "pogonion_bone": ("pogonion", "pog", "pg"),
    "menton_bone": ("menton", "me"),
    "condyle_right_center": ("condyle right", "right condyle", "condylion right", "co r"),
    "condyle_left_center": ("condyle left", "left condyle", "condylion left", "co l"),
    "gonion_right": ("right gonion", "go r"), "gonion_left": ("left gonion", "go l"),
    "nasion_soft": ("nasion'", "n'", "soft nasion"), "pronasale": ("prn", "pn"), "subnasale": ("sn",),
    "upper_lip": ("labrale superius", "ls", "upper lip point"), "stomion": ("sto", "stm", "st"),
    "lower_lip": ("labrale inferius", "li", "lower lip point"),
    "mouth_right": ("mouth corner right", "right mouth corner", "cheilion right", "ch r"),
    "mouth_left": ("mouth corner left", "left mouth corner", "cheilion left", "ch l"),
    "b_soft": ("b'", "si", "sublabiale", "sl", "mentolabial sulcus"),
    "pogonion_soft": ("pogonion'", "pog'", "pg'", "soft pogonion", "soft tissue pogonion"),
    "menton_soft": ("menton'", "me'", "soft menton", "soft tissue menton"),
    "glabella_soft": ("glabella", "g'"), "columella": ("cm",), "stomion_superius": ("stms",),
    "stomion_inferius": ("stmi",), "gnathion_soft": ("gn'", "soft gnathion"),
    "throat": ("cervical point", "c'")}
NAMES = {"glabella": "glabella_soft", "nasion": "nasion_soft", "pronasale": "pronasale",
         "columella": "columella", "subnasale": "subnasale", "upper lip": "upper_lip",
         "upper stomion": "stomion_superius", "lower stomion": "stomion_inferius",
         "lower lip": "lower_lip", "sublabiale": "b_soft",
         "pogonion": "pogonion_soft", "gnathion": "gnathion_soft", "menton": "menton_soft",
         "throat": "throat"}
BONES = {"upper incisor": "upper_incisor_edge", "lower incisor": "lower_incisor_edge",
         "nasal spine": "nasal_spine", "chin bone": "pogonion_bone"}
ABOVE_CHIN = ("glabella", "nasion", "pronasale", "columella", "subnasale", "upper lip", "lower lip")
MIDLINE = (*ABOVE_CHIN, "sublabiale", "pogonion", "menton")


def read_landmarks(file):
    """{name: position} in LPS, as the programs read them (src/scene/landmarks.cpp): 3D Slicer's .mrk.json
    and .fcsv, JSON {"name": [x, y, z], …}, and .csv of name, x, y, z. Spellings of STANDARD become its
    names; other names stay as they are. Two places of one name are refused."""
    ending = pathlib.Path(file).suffix.lower()
    if ending not in (".json", ".fcsv", ".csv"):
        raise Unusable(f"{file}: the ending is none of .mrk.json, .json, .fcsv and .csv")
    with reading(file, "landmarks"):
        text = pathlib.Path(file).read_text(encoding="utf-8-sig")
        found = (of_json(json.loads(text, object_pairs_hook=once)) if ending == ".json"
                 else of_table(text, ending == ".fcsv"))
        for name, position in found:
            if not np.isfinite(position).all():
                raise ValueError(f"landmark '{name}' has a coordinate that is no finite number")
    if not found:
        raise Unusable(f"{file}: holds no landmark that is placed")
    return with_standard_names(found, file)


def plain(name):
    """Lower case, with single blanks between words and ' for a prime."""
    return " ".join(re.split(r"[ _.\t-]+", name.lower().replace("′", "'"))).strip()


SPELLINGS = {plain(spelling): name for name, others in STANDARD.items() for spelling in (name, *others)}


def with_standard_names(landmarks, file):
    """{name: position} of pairs, by names of STANDARD where they have one; refuses two of one name at different
    places."""
    renamed, spelled = {}, {}
    for name, position in landmarks:
        key = SPELLINGS.get(plain(name), name)
        apart = np.linalg.norm(renamed.setdefault(key, position) - position)
        if apart > SAME:
            raise Unusable(f"{file}: landmarks '{spelled[key]}' and '{name}' are both {key}, {apart:.1f} mm "
                           "apart; remove one of them")
        spelled[key] = name
    return renamed


def in_lps(frame, position):
    """A position given in a frame by its name, or by its number as old .fcsv files have it."""
    if frame is None:
        raise ValueError("the file does not say its coordinate system, LPS or RAS (.csv: by a line "
                         '"# CoordinateSystem = LPS" before the points)')
    sign = {"LPS": 1, "1": 1, "RAS": -1, "0": -1}.get(frame)
    if sign is None:
        raise ValueError(f"the coordinate system is '{frame}'; it must be LPS or RAS")
    x, y, z = map(float, position)
    return np.array([sign * x, sign * y, z])


def once(pairs):
    """The dictionary of a JSON object; refuses a name with two places."""
    found = dict(pairs)
    for name, value in pairs:
        if value is found[name]:
            continue
        places = [place for place in (value, found[name]) if isinstance(place, list) and len(place) == 3]
        if len(places) == 2 and np.linalg.norm(np.subtract(*places)) > SAME:
            raise ValueError(f"'{name}' comes twice; remove one of them")
    return found


def of_json(stored):
    """Landmarks, (name, position), of markups or, where there are none, of named points in LPS."""
    if not isinstance(stored, dict):
        raise TypeError("no object with markups or named points")
    if not isinstance(stored.get("markups"), list):
        return [(name, in_lps("LPS", value)) for name, value in stored.items()
                if isinstance(value, list) and len(value) == 3]
    found = []
    for markup in stored["markups"]:
        if markup.get("coordinateUnits") not in (None, "mm", ["mm"] * 3):
            raise ValueError("coordinateUnits must be mm")
        for point in markup.get("controlPoints") or []:
            if point.get("positionStatus", "defined") == "defined":
                name = point.get("label") or str(len(found) + 1)
                found.append((name, in_lps(markup.get("coordinateSystem"), point["position"])))
    return found


def of_table(text, fcsv):
    """Landmarks, (name, position), of the lines of a .fcsv or .csv file."""
    found, frame, columns, titled = [], None, (11, 1) if fcsv else None, False
    for line in filter(None, map(str.strip, text.splitlines())):
        if line.startswith("#"):
            key, _, value = (word.strip() for word in line[1:].partition("="))
            frame = value if key == "CoordinateSystem" else frame
            if key == "columns" and fcsv:
                names = fields(value)
                columns = names.index("label") if "label" in names else None, names.index("x")
            continue
        row = fields(line)
        if not (fcsv or found or titled or is_number(row[-1])):
            titled = True
            continue
        label, first = columns or (0 if len(row) == 4 else None, len(row) - 3)
        if not 0 <= first <= len(row) - 3 or (not fcsv and len(row) > 4):
            raise ValueError(f"expected {'the columns of .fcsv' if fcsv else 'name, x, y, z, separated by commas'}, got '{line}'")
        name = row[label] if label is not None and label < len(row) else ""
        found.append((name or str(len(found) + 1), in_lps(frame, row[first:first + 3])))
    return found


def fields(line):
    """The fields of a line; a comma inside quotes does not part them."""
    return [field.strip() for field in next(csv.reader([line], skipinitialspace=True))]


OF_AXES = "condyle_right_center", "condyle_left_center", "nasion_bone", "upper_incisor_edge"


def require_same_head(result, landmarks, file):
    """Refuses landmarks of another head or in another frame, which would turn the page."""
    right, left = (landmarks.get(name) for name in OF_AXES[:2])
    if right is not None and left is not None and right[0] >= left[0]:
        raise Unusable(f"{file}: has condyle_right_center at x = {right[0]:.1f} mm and condyle_left_center "
                       f"at x = {left[0]:.1f} mm, but +x is the patient's left: they are exchanged, or the "
                       "landmarks are in RAS")
    _, lost = place_landmarks(result, landmarks)
    inside = OF_AXES[:2]  # of bone
    known = [name for name in landmarks if name in STANDARD and name not in inside]
    off = [name for name in known if name in lost]
    if 2 * len(off) > len(known):
        raise Unusable(f"{file}: {len(off)} of {len(known)} landmarks on skin and bones lie farther than "
                       f"{NEAR:g} mm from them, {off[0]} {lost[off[0]]:.0f} mm: they are those of another "
                       "head or in another frame; give those of this head, in LPS and mm")
    for name in OF_AXES:
        if lost.get(name, 0) > OFF_SURFACE:
            raise Unusable(f"{file}: landmark {name} lies {lost[name]:.0f} mm from skin and bones, allowed "
                           f"are {OFF_SURFACE:g} mm, since the page is turned by it; place it "
                           "again or remove it")


def head_axes(landmarks):
    """Left, back and up of the head as rows, those of templates and clinical moves
    (docs/guide/anatomy.md), and what they follow from; the scan's own without the condyles."""
    right, left, nasion, edge = (landmarks.get(name) for name in OF_AXES)
    if right is None or left is None:
        return np.eye(3), "the scan: no landmarks of the condyles are given"
    across = (left - right) / np.linalg.norm(left - right)
    back = np.array([0, 1, 0]) - across[1] * across
    axes = np.stack([across, back / np.linalg.norm(back), np.cross(across, back / np.linalg.norm(back))])
    if nasion is None or edge is None:
        return axes, "the head by its condyles, level as in the scan"
    ways = [axes @ (place - (right + left) / 2) for place in (nasion, edge)]
    chin_up = (sum(math.atan2(way[2], -way[1]) for way in ways) - RISE) / 2
    turn = np.array([[1, 0, 0], [0, math.cos(chin_up), -math.sin(chin_up)],
                     [0, math.sin(chin_up), math.cos(chin_up)]])
    return turn @ axes, "the head by its condyles, nasion and upper incisors"


class NearestPlace:
    """The nearest places of a surface before, where they are after, and their distances."""

    def __init__(self, before, after, corners):
        self.before, self.after, self.corners = before, after, corners
        self.middles = before[corners].mean(1)
        self.reach = np.linalg.norm(before[corners] - self.middles[:, None], axis=2).max(1)

    def of(self, point):
        away = np.linalg.norm(self.middles - point, axis=1)
        faces = self.corners[away - self.reach <= away.min()]
        weights = nearest_weights(self.before[faces], point)
        places = np.einsum("fk,fkx->fx", weights, self.before[faces])
        best = np.argmin(((places - point)**2).sum(1))
        return places[best], weights[best] @ self.after[faces[best]], np.linalg.norm(places[best] - point)


def on_surface(before, after, corners, point):
    """The nearest place of a surface before, where it is after, and the distance."""
    return NearestPlace(before, after, corners).of(point)


def nearest_weights(triangles, point):
    """The weights [n, 3] of corners at the nearest place of each triangle [n, 3, 3]."""
    found, least = np.zeros((len(triangles), 3)), np.full(len(triangles), np.inf)

    def try_weights(weights, allowed=True):
        square = ((np.einsum("fk,fkx->fx", weights, triangles) - point)**2).sum(1)
        closer = allowed & (square < least)
        found[closer], least[closer] = weights[closer], square[closer]

    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.maximum((normal**2).sum(1), 1e-300)
    inside = np.stack([(np.cross(second - first, point - first) * normal).sum(1) / area
                       for first, second in ((b, c), (c, a), (a, b))], axis=1)
    try_weights(inside, (inside >= 0).all(1))
    for first, second in ((0, 1), (1, 2), (2, 0)):
        side = triangles[:, second] - triangles[:, first]
        along = ((point - triangles[:, first]) * side).sum(1) / np.maximum((side**2).sum(1), 1e-300)
        weights = np.zeros((len(triangles), 3))
        weights[:, second] = np.clip(along, 0, 1)
        weights[:, first] = 1 - weights[:, second]
        try_weights(weights)
    return found


def place_landmarks(result, landmarks):
    """[{name, on, before, after}] of those on the skin, on a bone (with which they go) or on the
    given skin beyond the one that was solved; and {name: distance in mm} of the others."""
    solved, given = (skin and NearestPlace(skin.before, skin.after, skin.corners)
                     for skin in (result.solved, result.given))
    bones = [(bone, NearestPlace(bone["before"], bone["before"], bone["corners"])) for bone in result.bones]
    placed, lost = [], {}
    for name, point in landmarks.items():
        before, after, distance = solved.of(point)
        best = {"name": name, "on": "skin", "before": before, "after": after}
        for bone, surface in bones:
            away = surface.of(point)[2]
            if away < distance:
                turn, shift = bone["motion"]
                distance = away
                best = {"name": name, "on": bone["name"], "before": point,
                        "after": turn @ point + shift}
        if distance > NEAR and given:
            before, after, distance = given.of(point)
            best = {"name": name, "on": BEYOND, "before": before, "after": after}
        if distance <= NEAR:
            placed.append(best)
        else:
            lost[name] = distance
    return placed, lost


def known_places(placed, names=None):
    """{name: (before, after)} of the landmarks on the skin by NAMES, or of BONES on bones."""
    on_skin = names is None
    by_name = {mark["name"]: (mark["before"], mark["after"]) for mark in placed
               if (mark["on"] in ("skin", BEYOND)) == on_skin}
    return {name: by_name[standard] for name, standard in (names or NAMES).items() if standard in by_name}


# ----- by the shape of the profile


def turning_points(forward):
    """Rows at which a profile that begins at the tip of the nose turns: [(row, is a bulge)]. Turns of
    less than 0.4 mm do not count."""
    found, best, bulge = [], 0, False
    for i in range(1, len(forward)):
        passed = forward[i] - forward[best] if bulge else forward[best] - forward[i]
        if passed > 0:
            best = i
        elif passed < -0.4:
            found.append((best, bulge))
            best, bulge = i, not bulge
    return found


def front_line(segments):
    """The foremost line [n, 3] of the cut through the face, from above, a place a millimeter."""
    ends = segments.reshape(-1, 3)
    if len(ends) == 0:
        return ends
    ends = np.concatenate([ends, segments.mean(1)])
    rows = np.floor(ends[:, 2]).astype(int)
    order = np.lexsort((ends[:, 1], rows))
    _, first = np.unique(rows[order], return_index=True)
    return ends[order][first][::-1]


def by_shape(segments):
    """{name of NAMES: place} of nose, lips and chin, by the shape of an upright profile that looks to
    −y: bulges and hollows beside the line from the tip of the nose to the chin. Empty where it does
    not show them all."""
    line = front_line(segments)
    if len(line) < 40:
        return {}
    tip = int(np.argmin(line[:, 1]))
    drop = line[tip, 2] - line[:, 2]
    chins = np.flatnonzero((drop > 50) & (drop < 110))
    if len(chins) == 0:
        return {}
    chin = chins[np.argmin((line[chins, 1] - line[tip, 1]) / drop[chins])]
    chord = (line[chin] - line[tip]) / np.linalg.norm(line[chin] - line[tip])
    between = line[tip:chin + 1] - line[tip]
    turned = turning_points(between[:, 2] * chord[1] - between[:, 1] * chord[2]
                            if chord[2] > 0 else between[:, 1] * chord[2] - between[:, 2] * chord[1])
    names = ["subnasale", "upper lip", None, "lower lip", "sublabiale"]
    if len(turned) != len(names):
        return {}
    found = {"pronasale": line[tip], "pogonion": line[chin]}
    return found | {name: line[tip + row] for (row, _), name in zip(turned, names) if name}


# ----- parts of the face


class Parts:
    """The parts of an upright face as repose-compare draws them, by pronasale, subnasale, upper lip,
    lower lip and pogonion."""

    NEEDED = ("pronasale", "subnasale", "upper lip", "lower lip", "pogonion")
    NAMES = ("nose", "upper lip", "lower lip", "chin", "right cheek", "left cheek")

    def __init__(self, known):
        at = {name: place[0] for name, place in known.items()}
        self.middle = np.mean([at[name][0] for name in self.NEEDED])
        self.tip, self.depth = at["pronasale"][2], at["pronasale"][1]
        self.subnasale, self.pogonion = at["subnasale"][2], at["pogonion"][2]
        self.between_lips = (at["upper lip"][2] + at["lower lip"][2]) / 2
        self.under_lip = (at["lower lip"][2] + at["pogonion"][2]) / 2
        self.nasion = at["nasion"][2] if "nasion" in at else self.tip + 50
        self.menton = (at["menton"][2] if "menton" in at else self.pogonion - 15) - 5

    @classmethod
    def of(cls, known):
        return cls(known) if known.keys() >= set(cls.NEEDED) else None

    def at(self, points):
        """The row of NAMES of each point, −1 for none."""
        side, z = points[:, 0] - self.middle, points[:, 2]
        aside, front = abs(side), points[:, 1] <= self.depth + 70
        below, wide = z <= self.subnasale, np.where(z > self.subnasale, 20, 30)
        cheek = (aside > wide) & (aside <= 70) & (z > self.pogonion) & (z <= self.tip + 15)
        lips = below & (aside <= 30)
        tests = (~below & (z <= self.nasion) & (aside <= 20), lips & (z > self.between_lips),
                 lips & (z <= self.between_lips) & (z > self.under_lip),
                 lips & (z <= self.under_lip) & (z > self.menton), cheek & (side <= 0),
                 cheek & (side > 0))
        part = np.full(len(points), -1)
        for row, test in enumerate(tests):
            part[test & front] = row
        return part


def place_in_words(point, known, parts):
    """Describes the place of a point: at a part of the face, else beside the nearest landmark."""
    row = parts.at(np.array([point]))[0] if parts else -1
    if row >= 0:
        return "at the " + Parts.NAMES[row]
    if parts and point[2] <= parts.menton:
        return "under the chin"
    if known:
        name, (at, *_) = min(known.items(), key=lambda item: np.linalg.norm(item[1][0] - point))
        return f"{np.linalg.norm(at - point):.0f} mm from the {name}"
    return f"at ({point[0]:.0f}, {point[1]:.0f}, {point[2]:.0f}) mm"
