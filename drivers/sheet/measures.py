"""Measures of the soft tissue, before and after, with published norms; the plan in clinical terms;
how far skin follows bone. In mm and degrees; names of landmarks as in landmarks.py."""

import json
import math
import pathlib

import numpy as np

from sheet.landmarks import on_surface
from sheet.published import PUBLISHED
from sheet.script import reading

NORMS = pathlib.Path(__file__).with_name("norms.json")

# Soft tissue, landmark of bone, direction → landmark of sheet.published, its operations with a
# motion along the direction and against it.
FOLLOWS = {("subnasale", "nasal spine", "forward"): ("subnasale", "Le Fort I", None),
           ("upper lip", "upper incisor", "forward"): ("upper_lip", "Le Fort I", None),
           ("upper lip", "upper incisor", "up"): ("upper_lip", "impaction", None),
           ("lower lip", "lower incisor", "forward"): ("lower_lip", "advance", "set-back"),
           ("pogonion", "chin bone", "forward"): ("pogonion_soft", "advance", "set-back")}
FORWARD = 1, -1      # axis of a head, sign
UP = 2, 1
LEAST = 1    # mm, of a motion of bone that ratios are given of
ALONG = 0.7  # share of a motion along the direction, from which it is one that is published


def read_norms(file):
    """[{source, population, norms: {measure: [mean, standard deviation]}}] of a file."""
    with reading(file, "norms as in docs/guide/report.md"):
        stored = json.loads(pathlib.Path(file).read_text(encoding="utf-8-sig"))
        if not (isinstance(stored, list) and stored):
            raise ValueError("not a list of groups")
        for group in stored:
            for name, (mean, deviation) in group["norms"].items():
                if not (name in MEASURES and math.isfinite(mean) and 0 < deviation < math.inf):
                    raise ValueError(f"{name}: not a measure, or not mean and deviation")
            group["population"], group["source"]
    return stored


# ----- measures


def in_profile(*points):
    """Points as a lateral film shows them: in the midsagittal plane."""
    return [point * (0, 1, 1) for point in points]


def angle(*points):
    one, corner, other = in_profile(*points)
    a, b = one - corner, other - corner
    return math.degrees(math.acos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1)))


def in_front(*points):
    """Distance of a point in front of the line through two others, mm; negative behind it."""
    point, one, other = in_profile(*points)
    line = (other - one) / np.linalg.norm(other - one)
    off = point - one
    off = off - (off @ line) * line
    return -math.copysign(np.linalg.norm(off), off[1])


def convexity(g, sn, pog):
    return math.copysign(180 - angle(g, sn, pog), in_front(sn, g, pog))


def ratio(upper, lower):
    return float(np.linalg.norm(upper) / np.linalg.norm(lower))


# {measure: (unit, definition, landmarks, function of their positions)}
MEASURES = {
    "facial convexity": ("°", "180° − angle glabella–subnasale–pogonion",
                         ("glabella", "subnasale", "pogonion"), convexity),
    "nasolabial angle": ("°", "columella–subnasale–upper lip",
                         ("columella", "subnasale", "upper lip"), angle),
    "nasolabial angle by the tip": ("°", "pronasale–subnasale–upper lip",
                                    ("pronasale", "subnasale", "upper lip"), angle),
    "mentolabial angle": ("°", "lower lip–sublabiale–pogonion",
                          ("lower lip", "sublabiale", "pogonion"), angle),
    "depth of the mentolabial fold": (
        "mm", "sublabiale behind the line lower lip–pogonion",
        ("sublabiale", "lower lip", "pogonion"), lambda si, li, pog: -in_front(si, li, pog)),
    "upper lip in front of the E-line": ("mm", "line pronasale–pogonion",
                                         ("upper lip", "pronasale", "pogonion"), in_front),
    "lower lip in front of the E-line": ("mm", "line pronasale–pogonion",
                                         ("lower lip", "pronasale", "pogonion"), in_front),
    "upper lip in front of subnasale–pogonion": (
        "mm", "", ("upper lip", "subnasale", "pogonion"), in_front),
    "lower lip in front of subnasale–pogonion": (
        "mm", "", ("lower lip", "subnasale", "pogonion"), in_front),
    "upper jaw in front of the glabella": (
        "mm", "subnasale to the vertical through the glabella; head upright",
        ("subnasale", "glabella"), lambda sn, g: float(g[1] - sn[1])),
    "chin in front of the glabella": (
        "mm", "pogonion to the same vertical; head upright",
        ("pogonion", "glabella"), lambda pog, g: float(g[1] - pog[1])),
    "middle to lower face": ("", "glabella–subnasale : subnasale–menton",
                             ("glabella", "subnasale", "menton"),
                             lambda g, sn, me: ratio(g[2] - sn[2], sn[2] - me[2])),
    "lower face": ("mm", "subnasale to menton", ("subnasale", "menton"),
                   lambda sn, me: float(np.linalg.norm(np.subtract(*in_profile(sn, me))))),
    "lower face–throat angle": ("°", "subnasale–gnathion–throat",
                                ("subnasale", "gnathion", "throat"), angle),
    "upper lip to chin and lower lip": (
        "", "subnasale–stomion : stomion–menton",
        ("subnasale", "upper stomion", "lower stomion", "menton"),
        lambda sn, up, low, me: ratio(sn[2] - up[2], low[2] - me[2])),
    "upper incisor show": ("mm", "upper lip's edge to the incisor's edge",
                           ("upper stomion", "upper incisor"),
                           lambda lip, tooth: float(lip[2] - tooth[2])),
    "gap between the lips": ("mm", "between their edges", ("upper stomion", "lower stomion"),
                             lambda up, low: float(np.linalg.norm(up - low))),
    "upper lip to lower lip": ("mm", "between the foremost points of both",
                               ("upper lip", "lower lip"),
                               lambda up, low: float(np.linalg.norm(up - low)))}


def measured(known, norms):
    """[{name, unit, definition, before, after, norms: [(mean, deviation, whose)]}] of what the
    landmarks allow; `known`: {name: (before, after)}, or with a third position of another plan."""
    found = []
    for name, (unit, definition, needed, value) in MEASURES.items():
        if not known.keys() >= set(needed):
            continue
        if name == "nasolabial angle by the tip" and "columella" in known:
            continue
        states = zip(*(known[landmark] for landmark in needed))
        found.append({"name": name, "unit": unit, "definition": definition,
                      "values": [value(*state) for state in states],
                      "norms": [(*group["norms"][name], number) for number, group in
                                enumerate(norms) if name in group["norms"]]})
    return found


# ----- the plan


def turns(rotation):
    """Pitch, roll and yaw in degrees of a rotation: about the axes left–right (front down positive),
    forward (left side up positive) and up (front to the left positive), turned in this order."""
    pitch = math.degrees(math.atan2(rotation[2, 1], rotation[2, 2]))
    roll = math.degrees(math.asin(np.clip(rotation[2, 0], -1, 1)))
    yaw = math.degrees(math.atan2(rotation[1, 0], rotation[0, 0]))
    return pitch, roll, yaw


def shift_in_words(shift, digits=1):
    """A motion as a surgeon says it: forward first."""
    words = ((1, "back", "forward"), (2, "up", "down"), (0, "to the left", "to the right"))
    message = [f"{abs(shift[axis]):.{digits}f} mm {plus if shift[axis] > 0 else minus}"
            for axis, plus, minus in words if abs(shift[axis]) >= 0.5 * 10**-digits]
    return ", ".join(message) or "stays"


def turns_in_words(rotation):
    named = zip(turns(rotation), ("pitch", "roll", "yaw"),
                (("front down", "front up"), ("left side up", "right side up"),
                 ("front to the left", "front to the right")))
    return ", ".join(f"{name} {abs(value):.1f}° ({words[int(value < 0)]})"
                     for value, name, words in named if abs(value) >= 0.05)


def reference(bone, marks):
    """The place at which a bone's motion is measured: a landmark on it, or its centroid, in words and mm."""
    for name in ("upper incisor", "lower incisor", "chin bone"):
        if name in marks and marks[name]["on"] == bone["name"]:
            return f"at the {name}" + ("" if name == "chin bone" else "'s edge"), \
                marks[name]["before"]
    return "at its middle", bone["before"].mean(0)


def occlusion(known):
    """[(name, before, after)] of overjet and overbite in mm, where both incisors are known."""
    if not known.keys() >= {"upper incisor", "lower incisor"}:
        return []
    apart = [low - up for up, low in zip(known["upper incisor"], known["lower incisor"])]
    return [("overjet", *(float(a[1]) for a in apart)), ("overbite", *(float(a[2]) for a in apart))]


def following(known, bones, result):
    """[(skin, bone, direction, motions in mm of both, share in %, (low, high) or None)] where bone
    moves by at least a millimeter; the bone nearest to the skin's landmark, where no landmark of it
    is given. Without a range where bone moves more across than along the direction."""
    found = []
    for (skin, hard, direction), (landmark, *operations) in FOLLOWS.items():
        if skin not in known:
            continue
        pair, name = bones.get(hard), hard
        if pair is None and hard in ("chin bone", "nasal spine"):
            pair, name = nearest_bone(known[skin][0], result), "bone behind it"
        if pair is None:
            continue
        way = FORWARD if direction == "forward" else UP
        soft, bone = motion(known[skin], *way), motion(pair, *way)
        if abs(bone) < LEAST:
            continue
        published = percent_of(operations[bone < 0], landmark)
        if abs(bone) < ALONG * np.linalg.norm(pair[1] - pair[0]):
            published = None
        elif hard == "chin bone":
            published = published_at_chin(bone, bones.get("lower incisor"), published)
        found.append((skin, name, direction, soft, bone, 100 * soft / bone, published))
    return found


def percent_of(operation, landmark):
    """The published range of an operation, in %; None without one."""
    return operation and tuple(round(100 * share) for share in PUBLISHED[operation, landmark][1:])


def motion(places, axis, sign):
    return sign * float((places[1] - places[0])[axis])


def published_at_chin(bone, incisor, of_jaw):
    """The range of a jaw, of a chin that is moved alone, or of both where it moves with the jaw and
    apart from it, or that is not known."""
    low, high = alone = percent_of("chin", "pogonion_soft")
    if incisor is None:
        return min(low, of_jaw[0]), max(high, of_jaw[1])
    with_jaw = motion(incisor, *FORWARD)
    if abs(bone - with_jaw) < LEAST:
        return of_jaw
    return alone if abs(with_jaw) < LEAST else (min(low, of_jaw[0]), max(high, of_jaw[1]))


def nearest_bone(point, result):
    """Before and after of the place of bone nearest to a point; None without bones."""
    best = None
    for bone in result.bones:
        before, after, distance = on_surface(bone["before"], bone["after"], bone["corners"], point)
        if best is None or distance < best[0]:
            best = distance, before, after
    return best and best[1:]
