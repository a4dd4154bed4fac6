"""Rows of the summary of repose-solve that warn."""

import re

# Rows that pages repeat, and words that only those have that warn
CAUTIONS = {"warning": "", "other rest position": "", "pierced by bone": "", "pierced by instrument": "",
            "skin on bone": "", "exact penetration": "points are deeper", "bone through skin": "",
            "border of the skin": "", "self-contact": "", "path": "DEPENDS"}
PLACE = re.compile(r"(?:at|about) \((\S+), (\S+), (\S+)\)(?: mm)?")


def cautions(lines):
    """Those of the lines of a summary: (name of the row, text)."""
    for line in lines:
        name, told = line[:24].strip(), line[25:]
        if name in CAUTIONS and CAUTIONS[name] in told:
            yield name, told


def parted(told):
    """The text of a caution as text before a place, place or None, mm, and text after it."""
    place = PLACE.search(told)
    if not place:
        return told, None, ""
    return told[:place.start()], [float(number) for number in place.groups()], told[place.end():]


def sentence(name, told):
    """A caution as the sentence of a page."""
    told = told.replace("THE REST POSITION", "the rest position")
    line = told if name == "warning" else f"{name}: {told}"
    return f"{line[0].upper()}{line[1:]}."
