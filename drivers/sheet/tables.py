"""Tables of a page, and what stands folded at its end: tissue, search, settings, origin."""

import datetime
import hashlib
import html
import math
import os
import pathlib

import numpy as np

from sheet.result import Figure
from sheet.words import to_html


def shown(value):
    if not isinstance(value, float):
        return str(value)
    return f"{round(value, 2) + 0:.2f}" if math.isfinite(value) else "not known"


def tenths(value):
    """A number as one reads it on a sheet: to a tenth."""
    return Figure(f"{round(value, 1) + 0:.1f}".replace("-", "−") if math.isfinite(value) else "–")


def table(head, rows):
    """Rows of cells; numbers stand right."""
    def cell(value):
        kind = ' class="number"' if isinstance(value, (int, float, Figure)) else ""
        return f"<td{kind}>{html.escape(shown(value))}</td>"

    body = "".join(f"<tr>{''.join(map(cell, row))}</tr>" for row in rows)
    heads = "".join(f"<th>{html.escape(h)}</th>" for h in head)
    return f'<div class="wide"><table><thead><tr>{heads}</tr></thead>' \
           f"<tbody>{body}</tbody></table></div>"


def opening(skin):
    """Largest final distance, mm, between sides of cuts and lips, which begin at one place."""
    _, place, count = np.unique(skin.before, axis=0, return_inverse=True, return_counts=True)
    place, farthest = place.ravel(), 0.0
    for shared in np.flatnonzero(count > 1):
        sides = skin.after[place == shared]
        farthest = max(farthest, *np.linalg.norm(sides - sides[0], axis=1))
    return farthest if (count > 1).any() else None


def tissue(result):
    ratio, change = result.ratio, result.volume * (result.ratio - 1)
    movement = result.solved.movement
    rows = [("largest movement of the skin, mm", float(movement.max())),
            ("median movement of the skin that moves by more than 0.1 mm, mm",
             float(np.median(movement[movement > 0.1])) if (movement > 0.1).any() else 0.0),
            ("change of the tissue's volume, mm³", float(change.sum())),
            ("… of its volume, %",
             float(100 * change.sum() / result.volume.sum()) if len(ratio) else 0.0),
            ("prisms: largest change of volume, %", float(100 * abs(ratio - 1).max(initial=0))),
            ("prisms: 95 % change by less than, %",
             float(100 * np.percentile(abs(ratio - 1), 95)) if len(ratio) else 0.0),
            ("prisms inside out", int(result.end["inverted_prisms"])), *result.strain.items()]
    if (apart := opening(result.solved)) is not None:
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
    return f"<p>What mesh and layers leave out: {to_html(left)}.</p>{steady}" + table(
        ("load", "converged", "to the rest position, mm", "iterations", "evaluations", "s", ""),
        rows)


def is_scene_of(scene, result):
    """Returns whether the bones and pieces of a scene are those of a result."""
    from sheet.scene import bones_of  # needs PyYAML
    bones = bones_of(scene)
    return not bones or bones == set(result.bone_names)


def provenance(result, scene):
    file = pathlib.Path(result.file)
    written = datetime.datetime.fromtimestamp(file.stat().st_mtime).strftime("%Y-%m-%d %H:%M")
    rows = [("result", file.name), ("written", written),
            *result.origin.items(), ("SHA-256", hashlib.sha256(file.read_bytes()).hexdigest()),
            ("functional", result.end["functional"]), ("volume term", result.end["volume"]),
            ("bulk modulus, N/mm²", f"{result.end['bulk_modulus']:.4g}"),
            ("λ", f"{result.end['lambda']:g}"),
            *((name, str(count)) for name, count in result.counts.items())]
    page = table(("", ""), rows)
    if scene and is_scene_of(scene, result):
        written = pathlib.Path(scene).read_text(encoding="utf-8-sig")
        page += f"<h3>{html.escape(os.path.basename(scene))}</h3><pre>{html.escape(written)}</pre>"
    return page


def folded(plans, scene):
    """Details of the solver, a fold a plan."""
    for name, result in plans:
        title = "Details of the computation" + (f": {html.escape(name)}" if len(plans) > 1 else "")
        yield (f"<details><summary>{title}</summary><h3>Tissue</h3>{tissue(result)}"
               f"<h3>Search</h3>{accuracy(result)}"
               f"<h3>Where this comes from</h3>{provenance(result, scene)}</details>")
