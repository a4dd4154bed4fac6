#!/usr/bin/env python3
"""One HTML page of a result, to be read without a network: the plan, how landmarks and the profile
move, how far the numbers can be trusted, pictures, and the head to turn and look at.

    drivers/report.py NAME [-output report.html] [-scene scene.yaml] [-landmarks points.mrk.json]

NAME is the result (NAME.h5, the ending may be left out). -scene shows the scene file and takes its
landmarks; -landmarks takes others: 3D Slicer's .mrk.json, or JSON {"name": [x, y, z], …}. Both are
in mm; axes +x patient left, +y posterior, +z up. Needs: apt-get install python3-numpy python3-h5py,
and python3-matplotlib for the pictures.
"""

import argparse
import base64
import datetime
import hashlib
import html
import io
import json
import math
import os
import pathlib
import re
import sys
import xml.etree.ElementTree

try:
    import h5py
    import numpy as np
except ImportError as missing:
    print(f"report.py: {missing.name} is missing: apt-get install --no-install-recommends "
          "python3-numpy python3-h5py", file=sys.stderr)
    sys.exit(1)

HERE = pathlib.Path(__file__).resolve().parent
NEAR = 5.0  # mm: a landmark farther from skin and bones belongs to neither
BEYOND = "skin beyond the solved part"
STILL = 0.005  # mm: what moves less is said not to move
MOST_TRIANGLES = 80_000  # of the skin, and of all bones, in the interactive view
LARGE_VOLUME, LARGE_ERROR = 0.2, 0.5  # relative, mm: beyond, the page warns
MAGMA = ("fcf3dc", "fed395", "f1605d", "832681", "4a1079")  # light to dark
SKIN = (0.87, 0.68, 0.58)
MIDLINE = ("glabella", "nasion", "pronasale", "columella", "subnasale", "upper lip", "lower lip",
           "sublabiale", "pogonion", "menton")
NAMES = {"glabella": ("glabella_soft", "glabella", "g'"), "nasion": ("nasion_soft", "n'"),
         "pronasale": ("pronasale", "prn"), "columella": ("columella", "cm"),
         "subnasale": ("subnasale", "sn"), "upper lip": ("upper_lip", "labrale_superius", "ls"),
         "lower lip": ("lower_lip", "labrale_inferius", "li"),
         "sublabiale": ("sublabiale", "mentolabial_sulcus", "b'"),
         "pogonion": ("pogonion_soft", "soft_pogonion", "pog'"),
         "menton": ("menton_soft", "soft_menton", "me'")}


class Arguments(argparse.ArgumentParser):
    def error(self, message):
        refuse(message)


def refuse(message):
    print(f"report.py: {message}", file=sys.stderr)
    sys.exit(1)


def arguments():
    parser = Arguments(prog="report.py", description=__doc__, add_help=False, allow_abbrev=False,
                       formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("name")
    for option in ("-output", "-scene", "-landmarks"):
        parser.add_argument(option)
    chosen = parser.parse_args()
    chosen.name = chosen.name.removesuffix(".h5")
    chosen.output = chosen.output or chosen.name + ".html"
    for file in (chosen.name + ".h5", chosen.scene, chosen.landmarks):
        if file and not os.path.isfile(file):
            refuse(f"{file}: no such file")
    if chosen.scene and not chosen.landmarks:
        found = re.search(r"^landmarks:\s*['\"]?([^'\"\n#]+)", read_text(chosen.scene), re.M)
        if found:
            chosen.landmarks = os.path.join(os.path.dirname(chosen.scene), found[1].strip())
    return chosen


def read_text(file):
    return pathlib.Path(file).read_text(encoding="utf-8")


# ----- the result


class Result:
    """What the page needs of a result file: model, the steps' numbers, before and after."""

    def __init__(self, file):
        try:
            stored = h5py.File(file)
        except OSError as reason:
            refuse(f"{file}: cannot be read: {reason}")
        with stored as h5:
            if "step" not in h5 or not len(h5["step"]):
                refuse(f"{file}: holds no step; solve it with repose-solve first")
            if "model/skin/points" not in h5:
                refuse(f"{file}: holds no skin to show")
            self.steps = [{name: text(value) for name, value in h5["step"][step].attrs.items()}
                          for step in sorted(h5["step"])]
            self.origin = {name: text(h5.attrs[name]) for name in
                           ("program", "command", "ranks", "libraries") if name in h5.attrs}
            self.read(h5["model"], h5["step"][sorted(h5["step"])[-1]])
        self.given = given_skin(pathlib.Path(file.removesuffix(".h5") + "_given_skin.vtp"))
        self.end = self.steps[-1]
        self.movement = np.linalg.norm(self.after - self.before, axis=1)

    def read(self, model, step):
        corners = model["skin/points"][:]
        used, corners = np.unique(corners, return_inverse=True)
        self.corners = corners.reshape(-1, 3)
        self.before, self.after = model["point/position"][:][used], step["point/position"][:][used]
        self.counts = {f"{kind}s": len(model[f"{kind}/points"]) for kind in ("spring", "prism")
                       if kind in model}
        self.counts |= {"points": len(model["point/set"]), "skin triangles": len(self.corners),
                        "layers": int(model["point/layer"][:].max()) + 1}
        self.volume, self.ratio = model["prism/rest_volume"][:], step["prism/volume_ratio"][:]
        self.strain = {label: three_digits(step[name][:]) for label, name in (
            ("largest tension of a spring, N", "spring/tension"),
            ("largest von Mises stress, N/mm²", "prism/von_mises"),
            ("largest stretch", "prism/principal_stretch")) if name in step}
        if "point/contact_pressure" in step:
            pressure = np.nan_to_num(step["point/contact_pressure"][:])
            self.strain |= {"points of tissue in contact": int((pressure > 0).sum()),
                            "largest contact pressure, N/mm²": three_digits(pressure),
                            "deepest that anything passes what it touches, mm":
                            Figure(f"{step.attrs['penetration']:.2g}")}
        names = [text(name) for name in model["bone"][:]] if "bone" in model else []
        surfaces = model.get("bone_surface", {})
        self.bones, first = [], 0
        moved = step["bone_surface/points"][:] if "bone_surface/points" in step else None
        for b, name in enumerate(names):
            if str(b) not in surfaces or not len(surfaces[str(b)]["points"]):
                continue
            points, faces = surfaces[f"{b}/points"][:], surfaces[f"{b}/triangles"][:]
            after = points if moved is None else moved[first:first + len(points)]
            first += len(points)
            self.bones.append({"name": name, "corners": faces, "before": points, "after": after,
                               "motion": rigid(points, after)})


def given_skin(file):
    """Points before and after and triangles of the skin as it was given, or nothing."""
    if not file.is_file():
        return None
    found = {item.get("Name"): np.frombuffer(
        base64.b64decode(item.text)[8:], "<f8" if item.get("type") == "Float64" else "<i8")
        for item in xml.etree.ElementTree.parse(file).iter("DataArray")}
    before = found["Points"].reshape(-1, 3)
    return {"before": before, "after": before + found["displacement"].reshape(-1, 3),
            "corners": found["connectivity"].reshape(-1, 3)}


class Figure(str):
    """A number as it is to be shown."""


def three_digits(values):
    """The largest of them."""
    return Figure(f"{np.abs(values).max(initial=0):.3g}")


def text(value):
    return value.decode() if isinstance(value, bytes) else value


def rigid(before, after):
    """The rigid motion (rotation matrix, translation) that takes points where they went."""
    middle, there = before.mean(0), after.mean(0)
    u, _, v = np.linalg.svd((before - middle).T @ (after - there))
    turn = v.T @ np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))]) @ u.T
    return turn, there - turn @ middle


def screw(turn):
    """Axis and angle (degrees) of a rotation."""
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    angle = math.degrees(math.atan2(np.linalg.norm(axis), (np.trace(turn) - 1) / 2))
    return axis / (np.linalg.norm(axis) or 1), angle


# ----- landmarks


def read_landmarks(file):
    """{name: position} in LPS, of Slicer's markups or of named points."""
    try:
        stored = json.loads(read_text(file))
    except (OSError, ValueError) as reason:
        refuse(f"{file}: not landmarks as JSON: {reason}")
    found = {name: value for name, value in stored.items()
             if isinstance(value, list) and len(value) == 3 and
             all(isinstance(number, (int, float)) for number in value)}
    for markup in stored.get("markups", []):
        sign = (-1, -1, 1) if markup.get("coordinateSystem", "LPS") == "RAS" else (1, 1, 1)
        for point in markup.get("controlPoints", []):
            if point.get("positionStatus", "defined") == "defined":
                found[point["label"]] = np.array(point["position"]) * sign
    return {name: np.array(value, float) for name, value in found.items()}


def on_skin(result, point):
    """The nearest place of the skin before, where it is after, and the distance."""
    return on_surface(result.before, result.after, result.corners, point)


def on_surface(before, after, corners, point):
    near = np.argsort(((before - point)**2).sum(1))[:8]
    faces = corners[np.isin(corners, near).any(1)]
    a, b, c = (before[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.maximum((normal**2).sum(1), 1e-300)
    weights = np.stack([(np.cross(c - b, point - b) * normal).sum(1) / area,
                        (np.cross(a - c, point - c) * normal).sum(1) / area,
                        (np.cross(b - a, point - a) * normal).sum(1) / area], axis=1)
    weights = np.maximum(weights, 0)
    weights /= weights.sum(1, keepdims=True)
    places = np.einsum("fk,fkx->fx", weights, before[faces])
    best = np.argmin(((places - point)**2).sum(1))
    there = weights[best] @ after[faces[best]]
    return places[best], there, np.linalg.norm(places[best] - point)


def place_landmarks(result, landmarks):
    """[{name, on, before, after}] of those on the skin, on a bone (with which they go) or on the
    given skin beyond the one that was solved; and the names of the others."""
    placed, lost = [], []
    for name, point in landmarks.items():
        before, after, distance = on_skin(result, point)
        best = {"name": name, "on": "skin", "before": before, "after": after}
        for bone in result.bones:
            away = np.sqrt(((bone["before"] - point)**2).sum(1).min())
            if away < distance:
                turn, shift = bone["motion"]
                distance = away
                best = {"name": name, "on": bone["name"], "before": point,
                        "after": turn @ point + shift}
        if distance > NEAR and result.given:
            given = result.given
            before, after, distance = on_surface(given["before"], given["after"], given["corners"],
                                                 point)
            best = {"name": name, "on": BEYOND, "before": before, "after": after}
        if distance <= NEAR:
            placed.append(best)
        else:
            lost.append(name)
    return placed, lost


def known_places(placed):
    """{name of NAMES: (before, after)} of the landmarks on the skin."""
    by_name = {mark["name"].lower(): mark for mark in placed if mark["on"] in ("skin", BEYOND)}
    found = {}
    for name, others in NAMES.items():
        for other in others:
            if other in by_name:
                found.setdefault(name, (by_name[other]["before"], by_name[other]["after"]))
    return found


# ----- profile


def middle_plane(result, known):
    """Point and normal of the plane of symmetry: through the landmarks of the midline, upright; the
    middle of the skin where there are none."""
    points = np.array([known[name][0] for name in MIDLINE if name in known])
    if len(points) == 0:
        return (result.before.min(0) + result.before.max(0)) / 2, np.array([1.0, 0, 0])
    middle, normal = points.mean(0), np.array([1.0, 0, 0])
    if len(points) >= 3:
        direction = np.linalg.svd(points - middle)[2][0]
        normal -= direction * (normal @ direction)
    return middle, normal / np.linalg.norm(normal)


def cut(points, corners, plane):
    """Segments [n, 2, 3] in which a plane cuts a surface."""
    middle, normal = plane
    height = (points - middle) @ normal
    height = np.where(height == 0, 1e-12, height)
    segments = []
    for triangle in corners[np.ptp(np.sign(height[corners]), axis=1) > 0]:
        ends = []
        for p, q in zip(triangle, np.roll(triangle, 1)):
            if height[p] * height[q] < 0:
                share = height[p] / (height[p] - height[q])
                ends.append(points[p] + share * (points[q] - points[p]))
        segments.append(ends[:2])
    return np.array(segments).reshape(-1, 2, 3)


def find_sublabiale(result, known, segments):
    """The deepest place of the profile between lower lip and chin, where no landmark says it."""
    if "sublabiale" in known or not {"lower lip", "pogonion"} <= known.keys() or len(segments) == 0:
        return
    lip, chin = known["lower lip"][0], known["pogonion"][0]
    line = (chin - lip) / np.linalg.norm(chin - lip)
    points = segments.reshape(-1, 3)
    along = (points - lip) @ line
    behind = points - lip - along[:, None] * line
    depth = np.where((along > 0) & (along < np.linalg.norm(chin - lip)) &
                     (np.linalg.norm(behind, axis=1) < 20), behind[:, 1], -np.inf)
    if depth.max() > 0:
        known["sublabiale"] = on_skin(result, points[np.argmax(depth)])[:2]


def angle(points, one, corner, other):
    a, b = points[one] - points[corner], points[other] - points[corner]
    return math.degrees(math.acos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1)))


def from_line(points, lip):
    """How far a lip is in front of the line from nose to chin (E-line), mm."""
    nose, chin = points["pronasale"], points["pogonion"]
    line = (chin - nose) / np.linalg.norm(chin - nose)
    off = points[lip] - nose
    off = off - (off @ line) * line
    return -math.copysign(np.linalg.norm(off), off[1])


def measures(known):
    """[(name, unit, before, after)] of what the landmarks allow."""
    columella = "columella" if "columella" in known else "pronasale"
    wanted = [
        (f"nasolabial angle ({columella}–subnasale–upper lip)", "°",
         (columella, "subnasale", "upper lip"),
         lambda p: angle(p, columella, "subnasale", "upper lip")),
        ("mentolabial angle (lower lip–sublabiale–pogonion)", "°",
         ("lower lip", "sublabiale", "pogonion"),
         lambda p: angle(p, "lower lip", "sublabiale", "pogonion")),
        ("facial convexity (glabella–subnasale–pogonion)", "°",
         ("glabella", "subnasale", "pogonion"),
         lambda p: angle(p, "glabella", "subnasale", "pogonion")),
        ("upper lip in front of the E-line", "mm", ("upper lip", "pronasale", "pogonion"),
         lambda p: from_line(p, "upper lip")),
        ("lower lip in front of the E-line", "mm", ("lower lip", "pronasale", "pogonion"),
         lambda p: from_line(p, "lower lip")),
        ("upper lip to lower lip", "mm", ("upper lip", "lower lip"),
         lambda p: float(np.linalg.norm(p["upper lip"] - p["lower lip"]))),
        ("lower face (subnasale to menton)", "mm", ("subnasale", "menton"),
         lambda p: float(np.linalg.norm(p["subnasale"] - p["menton"])))]
    found = []
    for name, unit, needed, value in wanted:
        if known.keys() >= set(needed):
            sides = [{key: place[i] for key, place in known.items()} for i in (0, 1)]
            found.append((name, unit, value(sides[0]), value(sides[1])))
    return found


def profile_picture(result, known, plane, before):
    """The profile before and after as SVG, looking to the right, with the landmarks."""
    after = cut(result.after, result.corners, plane)
    segments = np.concatenate([before, after])
    if len(segments) == 0:
        return "<p>The plane of symmetry does not meet the skin.</p>"
    low, high = segments.min((0, 1))[[1, 2]], segments.max((0, 1))[[1, 2]]
    if "pronasale" in known:
        low[0] = min(known["pronasale"][0][1], low[0])
        high[0] = min(high[0], low[0] + 0.7 * (high[1] - low[1]))
    scale = 520 / (high[1] - low[1])
    x, y = (lambda p: 20 + scale * (high[0] - p[1])), (lambda p: 20 + scale * (high[1] - p[2]))
    width = 40 + scale * (high[0] - low[0])
    parts = [f'<svg viewBox="0 0 {width + 130:.0f} 560" role="img" '
             'aria-label="profile before and after">']
    for name, lines in (("before", before), ("after", after)):
        path = "".join(f"M{x(p):.1f} {y(p):.1f}L{x(q):.1f} {y(q):.1f}" for p, q in lines
                       if max(p[1], q[1]) <= high[0])
        parts.append(f'<path class="{name}" d="{path}"/>')
    for name in MIDLINE:
        if name in known:
            here, there = known[name]
            parts.append(f'<circle class="before" cx="{x(here):.1f}" cy="{y(here):.1f}" r="3"/>'
                         f'<circle class="after" cx="{x(there):.1f}" cy="{y(there):.1f}" r="3"/>'
                         f'<text x="{width:.0f}" y="{y(here) + 5:.1f}">{name}</text>')
    return "".join(parts) + '</svg><p class="legend"><b class="before">before</b> ' \
        '<b class="after">after</b></p>'


# ----- pictures


def shaded(points, corners, eye, right, base):
    """The triangles as an eye sees them [f, 3, 2], the nearest last, and their colours."""
    faces = points[corners]
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    lamp = np.array(eye) + 0.4 * np.array(right) + (0, 0, 0.4)
    light = 0.45 + 0.55 * abs(normal @ lamp) / np.linalg.norm(lamp)
    order = np.argsort(faces.mean(1) @ eye)
    colour = np.clip(np.asarray(base) * light[:, None], 0, 1)
    return np.stack([faces @ right, faces[:, :, 2]], axis=2)[order], colour[order]


def pictures(result):
    """Before, after and movement from front and side, as a PNG; why not, where it cannot be."""
    try:
        import matplotlib
        matplotlib.use("Agg")
        from matplotlib import colors, pyplot
        from matplotlib.collections import PolyCollection
    except ImportError:
        return "<p>No pictures: apt-get install python3-matplotlib</p>"
    scale = colors.Normalize(0, result.movement.max() or 1)
    ramp = colors.LinearSegmentedColormap.from_list("movement", [f"#{c}" for c in MAGMA])
    coloured = ramp(scale(result.movement[result.corners].mean(1)))[:, :3]
    columns = (("before", result.before, SKIN), ("after", result.after, SKIN),
               ("movement", result.after, coloured))
    figure, axes = pyplot.subplots(2, 3, figsize=(12, 9), layout="constrained", sharex="row",
                                   sharey="row")
    for row, (eye, right) in zip(axes, (((0, -1, 0), (1, 0, 0)), ((-1, 0, 0), (0, -1, 0)))):
        for place, (_, points, base) in zip(row, columns):
            flat, colour = shaded(points, result.corners, eye, right, base)
            place.add_collection(PolyCollection(flat, facecolors=colour, edgecolors=colour,
                                                linewidths=0.3))
            place.autoscale_view()
            place.set_aspect("equal")
            place.axis("off")
    for place, (name, _, _) in zip(axes[0], columns):
        place.set_title(name, fontsize=20)
    bar = figure.colorbar(matplotlib.cm.ScalarMappable(scale, ramp), ax=axes, shrink=0.6)
    bar.set_label("mm", fontsize=18)
    bar.ax.tick_params(labelsize=16)
    return f'<img alt="front and side, before, after and movement" src="{png(figure)}">'


def png(figure):
    stored = io.BytesIO()
    figure.savefig(stored, format="png", dpi=110)
    return "data:image/png;base64," + base64.b64encode(stored.getvalue()).decode()


def coarser(before, after, corners, most):
    """The surface with at most so many triangles: vertices in one cell of a grid become one."""
    if len(corners) <= most:
        return before, after, corners
    low, one = before.min(0), before[corners[:, 0]] - before[corners[:, 1]]
    edge = np.linalg.norm(one, axis=1).mean()
    while True:
        cells, row, count = np.unique(np.floor((before - low) / edge), axis=0, return_inverse=True,
                                      return_counts=True)
        row = row.ravel()
        faces = row[corners]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(1)]
        _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        if len(first) <= most:
            break
        edge *= 1.1
    middle = [np.stack([np.bincount(row, points[:, k]) for k in range(3)], 1) / count[:, None]
              for points in (before, after)]
    return *middle, faces[np.sort(first)]


def packed(before, after, corners):
    """A surface in text: whole numbers of 16 bits times `step`, from `low` on, mm."""
    def encoded(values, kind):
        return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()

    both = np.concatenate([before, after])
    low = both.min(0)
    step = max(float(np.ptp(both, axis=0).max()) / 65535, 1e-9)
    whole = {name: encoded(np.rint((points - low) / step), "<u2")
             for name, points in (("before", before), ("after", after))}
    return whole | {"low": list(low), "step": step, "triangles": encoded(corners, "<u4")}


def meshes(result):
    """What the interactive view draws, as JSON."""
    drawn = sum(len(b["corners"]) for b in result.bones)
    low, high = result.before.min(0), result.before.max(0)
    return json.dumps({
        "skin": packed(*coarser(result.before, result.after, result.corners, MOST_TRIANGLES)),
        "bones": [packed(*coarser(b["before"], b["after"], b["corners"],
                                  MOST_TRIANGLES * len(b["corners"]) // max(drawn, 1)))
                  for b in result.bones],
        "middle": list((low + high) / 2), "radius": float(np.linalg.norm(high - low) / 2),
        "largest": float(result.movement.max()),
        "scale": [[int(c[k:k + 2], 16) / 255 for k in (0, 2, 4)] for c in MAGMA]})


# ----- the page


def table(head, rows):
    """Rows of cells; numbers stand right."""
    def cell(value):
        kind = ' class="number"' if isinstance(value, (int, float, Figure)) else ""
        return f"<td{kind}>{html.escape(shown(value))}</td>"

    body = "".join(f"<tr>{''.join(map(cell, row))}</tr>" for row in rows)
    return f"<table><thead><tr>{''.join(f'<th>{h}</th>' for h in head)}</tr></thead>" \
           f"<tbody>{body}</tbody></table>"


def shown(value):
    if not isinstance(value, float):
        return str(value)
    return f"{round(value, 2) + 0:.2f}" if math.isfinite(value) else "not known"


def in_words(shift):
    """A translation as a surgeon says it."""
    words = (("left", "right"), ("back", "forward"), ("up", "down"))
    said = [f"{abs(part):.2f} mm {pair[int(part < 0)]}" for part, pair in zip(shift, words)
            if abs(part) > STILL]
    return ", ".join(said) or "stays"


def plan(result):
    rows = []
    for bone in result.bones:
        turn, _ = bone["motion"]
        axis, degrees = screw(turn)
        middle = bone["after"].mean(0) - bone["before"].mean(0)
        axis = np.round(axis, 3) + 0
        turned = f"{degrees:.2f}° about ({axis[0]:g}, {axis[1]:g}, {axis[2]:g})" \
            if degrees > 1e-4 else "none"
        farthest = float(np.linalg.norm(bone["after"] - bone["before"], axis=1).max())
        rows.append((bone["name"], in_words(middle), turned, farthest))
    return table(("bone", "its middle goes", "turn", "farthest point, mm"), rows)


def landmark_table(placed, lost):
    rows, rest = [], ", ".join(name.replace("_", " ") for name in lost)
    for mark in placed:
        move = mark["after"] - mark["before"]
        parts = map(float, (-move[1], move[0], move[2], np.linalg.norm(move)))
        rows.append((mark["name"].replace("_", " "), mark["on"], *parts))
    head = ("landmark", "on", "forward, mm", "to the left, mm", "up, mm", "in all, mm")
    lost_ones = f"<p>Farther than {NEAR:g} mm from skin and bones: {html.escape(rest)}.</p>"
    return table(head, rows) + (lost_ones if rest else "")


def opening(result):
    """How far the sides of cuts and lips, which begin at one place, are apart in the end, at most."""
    places, place, count = np.unique(result.before, axis=0, return_inverse=True, return_counts=True)
    place, farthest = place.ravel(), 0.0
    for shared in np.flatnonzero(count > 1):
        sides = result.after[place == shared]
        farthest = max(farthest, *np.linalg.norm(sides - sides[0], axis=1))
    return farthest if (count > 1).any() else None


def tissue(result):
    ratio, change = result.ratio, result.volume * (result.ratio - 1)
    rows = [("largest movement of the skin, mm", float(result.movement.max())),
            ("median movement of the skin that moves by more than 0.1 mm, mm",
             float(np.median(result.movement[result.movement > 0.1]))
             if (result.movement > 0.1).any() else 0.0),
            ("change of the tissue's volume, mm³", float(change.sum())),
            ("… of its volume, %",
             float(100 * change.sum() / result.volume.sum()) if len(ratio) else 0.0),
            ("prisms: largest change of volume, %", float(100 * abs(ratio - 1).max(initial=0))),
            ("prisms: 95 % change by less than, %",
             float(100 * np.percentile(abs(ratio - 1), 95)) if len(ratio) else 0.0),
            ("prisms inside out", int(result.end["inverted_prisms"])), *result.strain.items()]
    if (apart := opening(result)) is not None:
        rows.insert(2, ("lips and cuts open by at most, mm", float(apart)))
    return table(("", ""), rows)


def accuracy(result):
    rows = [(float(s["load"]), "yes" if s["converged"] else "no", f"{s['displacement_error']:.2g}",
             int(s["iterations"]), int(s["evaluations"]), float(s["seconds"]), str(s["reason"]))
            for s in result.steps]
    model = result.end.get("discretisation_error")
    left = f"{model:.2g} mm at most (estimate)" if model is not None else \
        "not estimated; repose-solve -discretisation estimates it"
    lowest = result.end.get("smallest_eigenvalue")
    steady = "" if lowest is None else "<p>" + (
        "Stable" if lowest > 0 else "NOT STABLE: it may buckle") + \
        f": smallest eigenvalue {lowest:.3g} N/mm.</p>"
    return f"<p>What mesh and layers leave out: {left}.</p>{steady}" + table(
        ("load", "converged", "to the rest position, mm", "iterations", "evaluations", "s", ""),
        rows)


def warnings(result):
    end, said = result.end, []
    if not end["converged"] or end["load"] < 1:
        said.append(f"The run did not reach its accuracy: {end['reason']}. It ended at load "
                    f"{end['load']:.3g}, where 1 is the plan.")
    if end["inverted_prisms"]:
        said.append(f"{int(end['inverted_prisms'])} prisms are inside out: the tissue is folded "
                    "there.")
    if end["displacement_error"] > LARGE_ERROR:
        said.append("The rest position is not known to half a millimetre.")
    if end["volume_error_max"] > LARGE_VOLUME:
        said.append(f"A prism changes its volume by {100 * end['volume_error_max']:.0f} %: the "
                    "tissue is strained a lot there.")
    for line in said:
        yield f'<p class="warning">{html.escape(line)}</p>'


def provenance(chosen, result):
    file = pathlib.Path(chosen.name + ".h5")
    written = datetime.datetime.fromtimestamp(file.stat().st_mtime).strftime("%Y-%m-%d %H:%M")
    rows = [("result", file.name), ("written", written),
            *result.origin.items(), ("SHA-256", hashlib.sha256(file.read_bytes()).hexdigest()),
            ("functional", result.end["functional"]), ("volume term", result.end["volume"]),
            ("bulk modulus, N/mm²", f"{result.end['bulk_modulus']:.4g}"),
            ("λ", f"{result.end['lambda']:g}"),
            *((name, str(count)) for name, count in result.counts.items())]
    page = table(("", ""), rows)
    if chosen.scene:
        page += f"<h3>{html.escape(os.path.basename(chosen.scene))}</h3>" \
                f"<pre>{html.escape(read_text(chosen.scene))}</pre>"
    return page


VIEW = """<canvas id="view"></canvas><p id="no-view" hidden>This browser has no WebGL 2.</p>
<p class="controls"><button data-around="0">front</button>
<button data-around="0.6">three-quarter</button> <button data-around="-1.5708">side</button>
<label>before <input type="range" id="share" min="0" max="1" step="0.01" value="1"> after</label>
<label>skin <input type="range" id="opacity" min="0" max="1" step="0.05" value="1"></label>
<label><input type="checkbox" id="coloured" checked> movement</label>
<label><input type="checkbox" id="bones" checked> bones</label></p>
<p>Drag to turn, Shift and drag to shift, wheel to zoom. Dark is far: up to %.2f mm.</p>"""

STYLE = """
body{font:16px/1.45 sans-serif;color:#222;max-width:60rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.6rem}h2{font-size:1.25rem;border-bottom:1px solid #ccc;margin-top:2.2rem}
table{border-collapse:collapse;margin:.8rem 0}
td,th{padding:.2rem .7rem;text-align:left;vertical-align:top;border-bottom:1px solid #e4e4e4}
td{overflow-wrap:anywhere}td:first-child{white-space:nowrap}
.number{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
label{white-space:nowrap}img,svg{max-width:100%}svg{max-height:36rem}text{font-size:15px}
pre{background:#f5f5f5;padding:.8rem;overflow:auto}
.verdict{font-size:1.15rem}
.warning{background:#fff1dc;border-left:4px solid #c60;padding:.4rem .8rem}
path{fill:none;stroke-width:2.5}path.before{stroke:#1f6fb4}path.after{stroke:#c0392b}
circle.before{fill:#1f6fb4}circle.after{fill:#c0392b}b.before{color:#1f6fb4}b.after{color:#c0392b}
canvas{width:100%;height:34rem;border:1px solid #ccc;touch-action:none}
.controls>*{margin-right:.8rem}@media print{canvas,.controls{display:none}}"""


def page(chosen, result, placed, lost):
    known = known_places(placed)
    plane = middle_plane(result, known)
    before = cut(result.before, result.corners, plane)
    find_sublabiale(result, known, before)
    rows = [(name, unit, one, two, two - one) for name, unit, one, two in measures(known)]
    error = float(result.end["displacement_error"])
    near = f"to {error:.2g} mm" if math.isfinite(error) else "to an unknown distance"
    there = result.end["converged"] and result.end["load"] == 1
    verdict = ("The rest position is reached " if there else
               "NOT CONVERGED: the face shown is near its rest position ") + near
    title = html.escape(os.path.basename(chosen.name).replace("_", " "))
    sections = [
        ("Plan", plan(result)),
        ("Look", VIEW % result.movement.max() + pictures(result)),
        ("Profile", profile_picture(result, known, plane, before) + (
            table(("", "", "before", "after", "change"), rows) if rows else
            "<p>No angles: not all landmarks that one needs are on the skin.</p>")),
        ("Landmarks", landmark_table(placed, lost) if placed else "<p>None are given.</p>"),
        ("Tissue", tissue(result)), ("Accuracy", accuracy(result)),
        ("Where this comes from", provenance(chosen, result))]
    body = "".join(f"<section><h2>{head}</h2>{text}</section>" for head, text in sections)
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title><style>{STYLE}</style></head><body>
<h1>{title}</h1><p class="verdict">{verdict}. A prediction of a model; not a medical device.</p>
{"".join(warnings(result))}{body}
<script type="application/json" id="meshes">{meshes(result)}</script>
<script>{read_text(HERE / "report_viewer.js")}</script></body></html>
"""


def main():
    chosen = arguments()
    if not os.path.isdir(os.path.dirname(os.path.abspath(chosen.output))):
        refuse(f"-output {chosen.output}: make its folder first")
    result = Result(chosen.name + ".h5")
    landmarks = read_landmarks(chosen.landmarks) if chosen.landmarks else {}
    written = page(chosen, result, *place_landmarks(result, landmarks))
    pathlib.Path(chosen.output + ".part").write_text(written, encoding="utf-8")
    os.replace(chosen.output + ".part", chosen.output)
    print(chosen.output)


main()
