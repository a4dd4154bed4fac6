"""The planning sheet: one HTML page of one result or of two plans of one patient."""

import html
import math

import numpy as np

from sheet import RAMP, REGION, rounded_up
from sheet.landmarks import BONES, NEAR, Parts, known_places, place_landmarks
from sheet.meshes import Pack, coarser
from sheet.measures import (following, measured, occlusion, reference, shift_in_words, turns,
                            turns_in_words)
from sheet.profile import COLORS, complete, drawing, outlines
from sheet.shown_skin import matching_rows, rows_of_patient
from sheet.result import Figure, rigid
from sheet.tables import folded, table, tenths
from sheet.web_page import web_page
from sheet.words import PUBLISHED, by_part, paragraphs

MOST_TRIANGLES = 80_000  # of the skin, and of all bones, in the view to turn
UNCERTAIN = ("e8f0ea", "f3d9a4", "d9822b", "8c2d04")


class Plan:
    """A result with its name, landmarks and what follows from them."""

    def __init__(self, name, result, marks, norms):
        self.name, self.result = name, result
        placed, self.lost = place_landmarks(result, marks)
        self.placed = placed
        self.known, self.bones = known_places(placed), known_places(placed, BONES)
        self.guessed, self.plane = complete(self.known, result.solved)
        self.parts = Parts.of(self.known)
        self.measures = measured(self.known | self.bones, norms)


# ----- the view


def matched(first, second):
    """After the second plan, the vertices of the first one's skin."""
    one, other = first.result.skin, second.result.skin
    near = rows_of_patient(other, one, [plan.result.file for plan in (first, second)])
    return one.before + (other.after - other.before)[near]


def uncertainties(plans):
    """The uncertainty of each plan at the vertices of the first one's skin; None where it was not estimated."""
    first, found = plans[0].result, []
    for result in (plan.result for plan in plans):
        unsure = result.uncertainty
        if unsure is not None and result is not first:
            unsure = unsure[rows_of_patient(result.skin, first.skin, [first.file, result.file])]
        found.append(unsure)
    return found


def packed_skin(plans, appearance, others, pack):
    """The surface of the skin for the page, and its fields; `others`: its vertices after a second plan."""
    result = plans[0].result
    skin = appearance.skin if appearance else result.skin
    states = [skin.before, skin.after, *others]
    near = None if skin is result.skin else matching_rows(result.skin, skin)
    fields = {"solved": skin.solved}
    for number, unsure in enumerate(uncertainties(plans)):
        if unsure is not None:
            fields[f"uncertainty {number}"] = unsure if near is None else unsure[near]
    if len(plans) == 2 and near is not None:
        states[2] = skin.before + (states[2] - result.skin.before)[near]
    fields |= appearance.arrays() if appearance else {}
    (before, *after), corners, arrays = coarser(states, skin.corners, list(fields.values()),
                                                MOST_TRIANGLES, skin.solved == 0)
    values = dict(zip(fields, arrays))
    surface = {"name": "skin", "kind": "skin", "triangles": pack.add(corners, 32),
               "states": [pack.numbers(before), *(pack.numbers(a - before) for a in after)]}
    surface["oriented"] = is_oriented(before, corners)
    if "colors" in values:
        surface["colors"] = pack.add(np.clip(np.rint(values["colors"]), 0, 255), 8)
    if "uv" in values:
        surface |= {"uv": pack.numbers(values["uv"]), "image": appearance.image}
    return surface, packed_fields(values, len(after), pack)


def is_oriented(points, corners):
    """Returns whether nearly all triangles are counter-clockwise seen from outside."""
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
    _, count = np.unique(ends, axis=0, return_counts=True)
    a, b, c = (points[corners[:, k]] - points.mean(0) for k in range(3))
    return bool((count > 1).sum() < 0.01 * len(count) and (a * np.cross(b, c)).sum() > 0)


def packed_fields(values, count, pack):
    """Fields of the skin: the uncertainty of each plan, and which part was solved."""
    fields = []
    unsure = [values.get(f"uncertainty {number}") for number in range(count)]
    if known := [one for one in unsure if one is not None]:
        most = max(float(np.percentile(np.concatenate(known), 99)), 0.1)
        stored = [None if one is None else pack.numbers(one) for one in unsure]
        fields.append({"name": "uncertainty", "label": "uncertain by, mm", "high": most,
                       "ramp": UNCERTAIN, "states": [stored[0], *stored]})
    if np.ptp(values["solved"]) > 0:
        stored = pack.numbers(values["solved"])
        fields.append({"name": "solved", "label": "part of the skin", "high": 1.0, "ramp": REGION,
                       "ends": ("as scanned", "computed"), "states": [stored] * (count + 1)})
    return fields


def packed_bones(plans, pack):
    """Bones of all plans; one that all share stands once."""
    found, first = [], plans[0].result.bones
    total = sum(len(bone["corners"]) for plan in plans for bone in plan.result.bones)
    for number, plan in enumerate(plans):
        for bone in plan.result.bones:
            twin = next((k for k, other in enumerate(first) if number == 1 and
                         same(bone, other)), None)
            if twin is not None:
                continue
            (before, after), corners, _ = coarser(
                [bone["before"], bone["after"]], bone["corners"], [],
                max(MOST_TRIANGLES * len(bone["corners"]) // max(total, 1), 200))
            states = [pack.numbers(before)] + [None] * len(plans)
            states[number + 1] = pack.numbers(after - before)
            if number == 0 and len(plans) == 2 and any(same(bone, b)
                                                       for b in plans[1].result.bones):
                states[2] = states[1]
            found.append({"name": bone["name"].replace("_", " "), "kind": "bone",
                          "triangles": pack.add(corners, 32), "states": states})
    return found


def same(bone, other):
    return bone["after"].shape == other["after"].shape and \
        np.allclose(bone["before"], other["before"]) and np.allclose(bone["after"], other["after"])


def described(plans, appearance):
    """The description that sheet.js reads, and the packed arrays."""
    pack = Pack()
    others = [matched(*plans)] if len(plans) == 2 else []
    skin, fields = packed_skin(plans, appearance, others, pack)
    largest = max(float(plan.result.solved.movement.max()) for plan in plans)
    low, high = frame(plans)
    shown = {"surfaces": [skin, *packed_bones(plans, pack)], "fields": fields, "ramp": RAMP,
             "states": state_names(plans), "largest": rounded_up(largest),
             "frame": [float(v) for v in (*low, *high)]}
    if others:
        apart = np.linalg.norm(others[0] - plans[0].result.skin.after, axis=1)
        shown["apart"] = rounded_up(float(apart.max()))
    return shown, pack.text()


def frame(plans):
    """Corners of the box that the view fills: skin and bones to the vertex, but of a tall scan not what
    lies below the computed part, nor what stands above a head."""
    solved = [plan.result.solved for plan in plans]
    states = np.concatenate([solved[0].before, *(skin.after for skin in solved)])
    low, high = states.min(0), states.max(0)
    bones = [bone["before"] for bone in plans[0].result.bones]
    points = np.concatenate([states, plans[0].result.skin.before, *bones])
    points = points[(points[:, 2] > low[2] - 5) & (points[:, 2] < high[2] + 150)]
    return points.min(0) - (0, 0, 2), points.max(0) + (0, 0, 2)


def state_names(plans):
    return ["before", "after"] if len(plans) == 1 else ["before", *(plan.name for plan in plans)]


# ----- sections


def figure_of(known, name):
    """The motion of a landmark for a card: its largest part as a number, the rest in small words."""
    shift = known[name][1] - known[name][0]
    axis = int(np.argmax(abs(shift)))
    if abs(shift[axis]) < 0.05:
        return "0.0<small> mm</small>", "does not move"
    alone, rest = np.zeros(3), shift.copy()
    alone[axis], rest[axis] = shift[axis], 0
    number, words = shift_in_words(alone).split(" ", 1)
    return f"{number}<small> {words}</small>", shift_in_words(rest).replace("stays", "")


def numbers(plans):
    """The three numbers that matter, of each plan."""
    cards = []
    for title, landmarks in (("Chin", ("pogonion",)), ("Lips", ("upper lip", "lower lip")),
                             ("Nose", ("pronasale",))):
        parts = [f'<div class="number-card"><h3>{title}</h3>']
        for plan in plans:
            for name in landmarks:
                label = ", ".join(filter(None, (plan.name if len(plans) > 1 else "",
                                                name if len(landmarks) > 1 else "")))
                if name in plan.known:
                    big, rest = figure_of(plan.known, name)
                    message = ": ".join(filter(None, (label, rest)))
                    parts.append(f"<b>{big}</b><p>{html.escape(message)}</p>")
                else:
                    parts.append(f"<b>–</b><p>{html.escape(label)} no landmark</p>")
        cards.append("".join([*parts, "</div>"]))
    return f'<div class="numbers">{"".join(cards)}</div>'


def spoken(name):
    """The name of a file or bone in words."""
    return name.replace("_", " ")


def moved_bones(plan):
    """[(name, place, shift there, rotation)] of the bones that the plan moves, over the whole plan."""
    marks = {name: mark for name, standard in BONES.items() for mark in plan.placed
             if mark["name"] == standard}
    found = []
    for bone in plan.result.bones:
        turn, shift = rigid(bone["before"], bone["planned"])
        place, point = reference(bone, marks)
        step = turn @ point + shift - point
        if np.linalg.norm(bone["planned"] - bone["before"], axis=1).max() > 0.005:
            found.append((spoken(bone["name"]), place, step, turn))
    return found


def plan_lines(plan):
    """The plan in a sentence a piece."""
    lines = []
    for name, _, step, turn in moved_bones(plan):
        turned = turns_in_words(turn)
        message = shift_in_words(step) + (f"; {turned}" if turned else "")
        lines.append(f'<p class="plan-line"><b>{html.escape(name)}</b> {html.escape(message)}</p>')
    return "".join(lines) or "<p>No bone moves.</p>"


def plan_table(plans, frame):
    rows = []
    for plan in plans:
        for name, place, step, turn in moved_bones(plan):
            parts = map(tenths, (-step[1], step[2], step[0], *turns(turn)))
            rows.append((*([plan.name] if len(plans) > 1 else []), name, place, *parts))
    head = ("piece", "measured", "advance, mm", "up, mm", "to the left, mm", "pitch, °", "roll, °",
            "yaw, °")
    page = table(("plan", *head) if len(plans) > 1 else head, rows) if rows else \
        "<p>No bone moves.</p>"
    page += "".join(f'<p class="warning">The face of {html.escape(plan.name)} and its numbers are at '
                    f'{100 * plan.result.end["load"]:.4g} % of its plan.</p>'
                    for plan in plans if plan.result.end["load"] < 1)
    still = sorted({spoken(bone["name"]) for plan in plans for bone in plan.result.bones} -
                   {name for plan in plans for name, *_ in moved_bones(plan)})
    if still:
        page += f'<p class="note">Does not move: {html.escape(", ".join(still))}. '
    else:
        page += '<p class="note">'
    page += ("A negative advance is a setback; up is impaction of an upper jaw. Pitch: front down; "
             "roll: left side up; yaw: front to the patient's left, each positive. Advance, up and left "
             f"are along the axes of {frame}.</p>")
    teeth = [occlusion(plan.bones) for plan in plans]
    for k, (name, before, _) in enumerate(teeth[0] if all(teeth) else ()):
        after = ", ".join(f"{tenths(one[k][2])} mm {title}" for one, title in
                          zip(teeth, state_names(plans)[1:]))
        page += (f'<p class="plan-line"><b>{name}</b> {tenths(before)} mm before, '
                 f"{html.escape(after)}</p>")
    return page


def profile_section(plans):
    first, states = plans[0], COLORS[:len(plans) + 1]
    skin = first.result.skin
    skins = [outlines(skin.before, skin.corners, first.plane)]
    bones = []
    for state, plan in zip(states[1:], plans):
        shown = plan.result.skin
        skins.append(outlines(shown.after, shown.corners, plan.plane))
        for bone in plan.result.bones:
            moves = np.abs(bone["after"] - bone["before"]).max() > 0.005
            for which, name in (("before", "before"), ("after", state)) if moves else \
                    (("before", "fixed"),):
                bones.append((name, outlines(bone[which], bone["corners"], plan.plane)))
    known = {name: (*places, *((plans[1].known[name][1],) if len(plans) > 1 and
                               name in plans[1].known else ()))
             for name, places in first.known.items()}
    legend = "".join(f'<b class="{state}">{html.escape(name)}</b>'
                     for state, name in zip(states, state_names(plans)))
    return drawing(skins, bones, known, states) + \
        f'<p class="legend">{legend}<b class="fixed">bone that stays</b></p>'


def ratio_table(plans):
    rows = []
    for plan in plans:
        for skin, bone, direction, soft, hard, share, published in following(
                plan.known, plan.bones, plan.result):
            label = f"{skin} to {bone}, {direction}"
            rows.append((label if len(plans) == 1 else f"{plan.name}: {label}", tenths(soft),
                         tenths(hard), Figure(f"{share:.0f} %".replace("-", "−")),
                         Figure("{}–{} %".format(*published)) if published else "–"))
    if not rows:
        return '<p class="note">No soft-to-hard ratio: none of the bones under subnasale, lips and ' \
            "chin moves by a millimeter, or their landmarks are not given.</p>"
    return table(("skin to bone", "skin, mm", "bone, mm", "ratio", "published"), rows) + \
        '<p class="note">Published ranges of such a motion: docs/measurements/ratios.md names the ' \
        "sources. A ratio outside them is a reason to look again, not an error.</p>"


def region_columns(plans):
    """[(title, numbers by part, how many of mean, 90 % and 95 % are shown)]"""
    first, many = plans[0], len(plans) > 1
    columns = [(plan.name if many else "moves",
                by_part(plan.result.solved, plan.parts or first.parts, plan.result.solved.movement),
                1 if many else 3) for plan in plans]
    skin = first.result.skin
    if many:
        apart = np.linalg.norm(matched(*plans) - skin.after, axis=1)
        columns.append(("difference", by_part(skin, first.parts, apart), 3))
    elif first.result.uncertainty is not None:
        columns.append(("uncertain by", by_part(skin, first.parts, first.result.uncertainty), 3))
    return columns


def region_table(plans):
    first = plans[0]
    if first.parts is None:
        return '<p class="note">No parts of the face: they need the landmarks pronasale, subnasale, ' \
            "upper_lip, lower_lip and pogonion_soft.</p>"
    columns = region_columns(plans)
    rows = [(name.capitalize(), *(tenths(number) for _, column, shown in columns
                                  for number in column.get(name, (math.nan,) * 3)[:shown]))
            for name in Parts.NAMES if name in columns[0][1]]
    head = ("part", *(f"{title}, {what}" for title, _, shown in columns
                      for what in ("mean, mm", "90 % within", "95 % within")[:shown]))
    published = "; ".join(f"{where} {error} ({who})" for where, error, who in PUBLISHED)
    return table(head, rows) + '<p class="note">By area. How far published planners were from the ' \
        f"operated face: {published}.</p>"


def measure_rows(plans):
    others = {m["name"]: m for m in plans[1].measures} if len(plans) > 1 else {}
    for one in plans[0].measures:
        values = list(one["values"])
        if len(plans) > 1:
            values.append(others.get(one["name"], {"values": (0, math.nan)})["values"][1])
        else:
            values.append(values[1] - values[0])
        values = [tenths(value) if one["unit"] else Figure(f"{value:.2f}".replace("-", "−")) for value in values]
        norm = "; ".join(f"{mean:g} ± {deviation:g} [{number + 1}]".replace("-", "−")
                         for mean, deviation, number in one["norms"])
        yield one["name"], one["definition"], one["unit"], *values, norm


def measure_table(plans, norms):
    rows = list(measure_rows(plans))
    if not rows:
        return "<p>No angles: not all landmarks that one needs are on the skin.</p>"
    states = ("before", "after", "change") if len(plans) == 1 else \
        ("before", plans[0].name, plans[1].name)
    sources = "; ".join(f"[{number}] {group['population']} ({group['source']})"
                        for number, group in enumerate(norms, 1))
    return table(("measure", "definition", "", *states, "norm (mean ± standard deviation)"), rows) + \
        f'<p class="note">Norms: {html.escape(sources)}. Norms are of relaxed lips in natural head ' \
        "position, which a CT rarely has.</p>"


def landmark_table(plan):
    if not plan.placed and not plan.lost:
        return "<p>None are given.</p>"
    rows, rest = [], ", ".join(name.replace("_", " ") for name in plan.lost)
    for mark in plan.placed:
        move = mark["after"] - mark["before"]
        parts = map(float, (-move[1], move[0], move[2], np.linalg.norm(move)))
        rows.append((mark["name"].replace("_", " "), mark["on"], *parts))
    head = ("landmark", "on", "forward, mm", "to the left, mm", "up, mm", "in all, mm")
    lost_ones = f"<p>Farther than {NEAR:g} mm from skin and bones: {html.escape(rest)}.</p>"
    return (table(head, rows) if rows else "") + (lost_ones if rest else "")


# ----- the page


def view(plans):
    """Stage and controls."""
    names = state_names(plans)
    pair = "" if len(plans) == 1 else (
        '<select id="pair" aria-label="what is compared">' + "".join(
            f'<option value="{a} {b}">{html.escape(names[a])} | {html.escape(names[b])}</option>'
            for a, b in ((1, 2), (0, 1), (0, 2))) + "</select>")
    return f"""<div class="stage"><div id="view"></div>
<span class="tag" id="tag-left"></span><span class="tag" id="tag-right"></span>
<div id="bar" hidden></div><div id="tip" hidden></div></div>
<p id="no-view" class="warning" hidden></p>
<div class="controls"><span class="group" role="group" aria-label="direction of view">
<button data-view="front">front</button><button data-view="three-quarter">three-quarter</button>
<button data-view="right">profile</button></span>
<span class="group" role="group" aria-label="arrangement">
<button data-mode="split">split</button><button data-mode="side">side by side</button>
<button data-mode="single">one</button></span>{pair}
<select id="coloring" aria-label="coloring of the skin"><option value="">skin</option></select>
<label id="share-label" hidden><span id="share-from"></span> <input type="range" id="share" min="0" max="1"
step="0.02" value="1"> <span id="share-to"></span></label>
<label>skin <input type="range" id="skin" min="0" max="1" step="0.05" value="1"></label>
<label><input type="checkbox" id="bones" checked> bones</label>
<label><input type="checkbox" id="measure"> measure</label><output id="distance"></output></div>
<p class="note screen">Drag to turn, two fingers or right button to shift, wheel or pinch to zoom.
Point at the skin, or tap it, to read how far it moves.</p>"""


def write(plans, norms, scene, appearance, frame):
    """The page as text; `frame`: whose axes its directions are along."""
    title = " and ".join(plan.name for plan in plans)
    words, packed = described(plans, appearance)
    message = "".join((f"<h3>{html.escape(plan.name)}</h3>" if len(plans) > 1 else "") +
                   paragraphs(plan.result, plan.known, plan.parts, plan.guessed,
                              plan is plans[-1]) + plan_lines(plan) for plan in plans)
    landmarks = "".join((f"<h3>{html.escape(plan.name)}</h3>" if len(plans) > 1 else "") +
                        landmark_table(plan) for plan in plans)
    body = f"""<main><div class="page-one">
<header><h1>{html.escape(title)}</h1><span class="soft">predicted face after the planned surgery</span></header>
<section class="first"><div>{view(plans)}</div><div>{numbers(plans)}{message}</div></section>
<div class="stills" id="stills"></div>
<section><h2>The plan</h2>{plan_table(plans, frame)}</section></div>
<section class="two"><div><h2 class="page-two">Profile</h2>{profile_section(plans)}</div>
<div><h2 class="page-two">How far the skin follows the bone</h2>{ratio_table(plans)}
<h2>Parts of the face</h2>{region_table(plans)}</div></section>
<section class="measures"><h2>Measures of the soft tissue</h2>{measure_table(plans, norms)}</section>
<section class="screen"><h2>Landmarks</h2>{landmarks}</section>
{"".join(folded([(plan.name, plan.result) for plan in plans], scene))}
</main>"""
    return web_page(title, body, ("viewer.css", "sheet.css"), ("three.js", "viewer.js", "pack.js", "plan.js", "sheet.js"),
                    words, packed)
