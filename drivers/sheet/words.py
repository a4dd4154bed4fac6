"""What the planning sheet says in plain words: how far to trust the face, and where not."""

import html
import math
import re

import numpy as np

from sheet.landmarks import Parts, place_in_words
from sheet.summary import sentence

LARGE_VOLUME, LARGE_ERROR = 0.2, 0.5  # relative, mm: beyond, the page warns
PUBLISHED = (
    ("whole face", "0.9 ± 0.3 mm on average, 90 % of it within 1.9 mm", "Liebregts 2015, 100 patients"),
    ("regions", "0.7 to 1.4 mm on average, the lower lip worst", "Lee 2021, 10 patients"),
    ("lower lip", "1.2 ± 0.5 mm", "Liebregts 2015, 100 patients"),
    ("upper lip", "2.7 ± 1.7 mm", "Shafi 2013, 13 patients"))


def weighted_percentile(values, weights, share):
    """The value below which lies a share of the weight."""
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, share * sums[-1])])


def areas(skin):
    """mm² at each vertex."""
    a, b, c = (skin.before[skin.corners[:, k]] for k in range(3))
    third = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6
    return np.bincount(skin.corners.ravel(), np.repeat(third, 3), len(skin.before))


def by_part(skin, parts, values):
    """{part: (mean, 90 %, 95 %)} of values of the vertices, by area."""
    area, part = areas(skin), parts.at(skin.before)
    found = {}
    for row, name in enumerate(Parts.NAMES):
        here = (part == row) & (area > 0)
        if here.any():
            found[name] = (float(np.average(values[here], weights=area[here])),
                           *(weighted_percentile(values[here], area[here], share)
                             for share in (0.9, 0.95)))
    return found


def verdict(result):
    """One sentence: whether the face is the model's answer, and how near."""
    end, error = result.end, float(result.end["displacement_error"])
    near = f"within {error:.2g} mm of" if math.isfinite(error) else "at an unknown distance from"
    if end["load"] < 1:
        return (f"NOT FINISHED: the face shown is at {100 * end['load']:.4g} % of the planned motion, {near} rest "
                "there. Do not plan by it.")
    if end["converged"]:
        return f"The computation is finished: this face is {near} the answer of the model."
    return f"NOT FINISHED: the face shown is {near} the answer of the model. Do not plan by it."


def cautions(result, known, parts, guessed):
    """Yields a sentence for each reason not to trust the face."""
    end = result.end
    if not end["converged"]:
        yield f"The run did not reach its accuracy: {end['reason']}."
    if end["displacement_error"] > LARGE_ERROR:
        yield "The face is not known to half a millimeter."
    if end.get("smallest_eigenvalue", 1) <= 0:
        yield "The rest position is not stable: the tissue may buckle."
    where = [place_in_words(place, known, parts) for place in result.places[result.ratio <= 0]]
    if end["inverted_prisms"]:
        named = f" {where[0]}" if where else ""
        yield f"Tissue is folded{named}. Do not trust the face there."
    elif end["volume_error_max"] > LARGE_VOLUME and len(result.ratio):
        worst = int(np.argmax(abs(result.ratio - 1)))
        kind = "stretched" if result.ratio[worst] > 1 else "squeezed"
        yield (f"Tissue is {kind} by {100 * end['volume_error_max']:.0f} % of its volume "
               f"{place_in_words(result.places[worst], known, parts)}: less certain there.")
    yield from summary_cautions(result, known, parts)
    yield from mesh_caution(result, parts)
    if guessed:
        yield ("Not all landmarks were given: " + ", ".join(guessed) + " were found by the shape of "
               "the profile. Check them in the drawing before using numbers that need them. The summary of "
               "repose-solve has other points for a scene without landmarks, by the teeth: its numbers differ.")


def summary_cautions(result, known, parts):
    """Warnings of the summary of repose-solve."""
    for name, before, place, after in result.cautions:
        where = "" if place is None else place_in_words(place, known, parts)
        yield sentence(name, f"{before}{where}{after}")


def mesh_caution(result, parts):
    if result.uncertainty is None or parts is None:
        return
    found = by_part(result.skin, parts, result.uncertainty)
    large = [f"by up to {numbers[2]:.1f} mm at the {name}" for name, numbers in found.items()
             if numbers[2] > LARGE_ERROR]
    if large:
        yield (f"The mesh is coarse: the face may be off {', '.join(large)} (95 % of each). A finer "
               "mesh helps (tissue.edge, or repose-solve -adapt).")


def trust(result):
    """The paragraph that every sheet carries."""
    known = "" if result.uncertainty is not None else \
        " How much the mesh adds was not estimated (repose-solve -discretisation does)."
    return ("Trust it least at the lips: published planners of this kind err there by 1 to 3 mm, by "
            f"about 1 mm elsewhere.{known} Good for showing and comparing plans; it is a prediction, "
            "not a medical device.")


def to_html(text):
    """The text as HTML, in which no line ends within a command."""
    return re.sub(r"repose-\w+ -\w+", r"<code>\g<0></code>", html.escape(text))


def paragraphs(result, known, parts, guessed, trusted=True):
    """The verdict with its cautions; `trusted`: with what every sheet says once."""
    message = "".join(f'<p class="warning">{to_html(line)}</p>'
                   for line in cautions(result, known, parts, guessed))
    rest = to_html(trust(result)) if trusted else ""
    return f'<p class="verdict"><b>{html.escape(verdict(result))}</b> {rest}</p>{message}'
