"""Reads operations from a text such as "Le Fort I, 5 mm forward, yaw 2 degrees to the right".

Every word and number is used exactly once, or the text is refused: a movement is a number and a word, in either
order, and a side for yaw. Commas, periods, "and" and "with" separate movements. A text of several operations names
each before its movements."""

import re
from typing import NamedTuple


class NotUnderstood(ValueError):
    """One line that names what is not understood."""


class Operation(NamedTuple):
    name: str
    move: dict  # key of a clinical move → mm or degrees


class Token(NamedTuple):
    kind: str  # number, movement, operation or boundary
    text: str
    value: float = 0.0
    unit: str = ""


ORDER = ("Le Fort I", "sagittal split", "jaw", "genioplasty")
NAMES = {"maxilla": "Le Fort I", "maxillary": "Le Fort I", "bsso": "sagittal split", "jaw": "jaw",
         "mandible": "jaw", "mandibular": "jaw", "genioplasty": "genioplasty", "chin": "genioplasty"}
# Phrases, and the word that is read in place of each.
PHRASES = {r"\ble[ -]?fort[ -]?(1(?!\w|[.,]\d)|i(?!\w|\.\d))": "maxilla", r"\bupper[ -]jaw\b": "maxilla",
           r"\blower[ -]jaw\b": "jaw", r"\b(bilateral )?sagittal[ -]split\b": "bsso",
           r"\bset[ -]back\b": "setback", r"\bopen[ -]bite\b": ""}
# Key of a clinical move, and its sign → words that mean it.
MOVEMENT_WORDS = {
    ("advance", 1): "forward forwards advance advances advanced advancing advancement",
    ("set_back", 1): "back backward backwards setback",
    ("impaction", 1): "up upward upwards impaction impact impacted",
    ("lower", 1): "down downward downwards lower lowers lowered lowering",
    ("left", 1): "left", ("left", -1): "right", ("yaw", 1): "yaw", ("roll", 1): "roll", ("pitch", 1): "pitch",
    ("open", 1): "open opens opened opening", ("open", -1): "close closes closed closing",
    ("overjet", 1): "overjet", ("overbite", 1): "overbite"}
MOVEMENTS = {word: move for move, words in MOVEMENT_WORDS.items() for word in words.split()}
ROTATIONS = {"yaw", "roll", "pitch", "open"}
EXCLUSIVE = ({"advance", "set_back", "overjet"}, {"impaction", "lower", "overbite"})
OF_TEETH = {"overjet", "overbite"}  # targets, which the incisors reach
YAW_TO_A_SIDE = {("number", "yaw", "side"), ("yaw", "number", "side"), ("number", "side", "yaw"),
                 ("yaw", "side", "number"), ("side", "yaw", "number")}
LONGEST = 15  # tokens between boundaries: a movement of each kind, and a side
LIMITS = {"mm": 30, "degrees": 45}  # those of the scene's keys
UNITS = {"mm": "mm", "°": "degrees", "deg": "degrees", "degree": "degrees", "degrees": "degrees"}
BOUNDARIES = {",", ";", ".", "+", "and", "with", "plus", "then"}
IGNORED = set("a an by of the to patient patient's move moves moved movement osteotomy surgery".split())
KNOWN = ("name Le Fort I, sagittal split, genioplasty or jaw, with movements in mm (forward, back, up, down, left, "
         "right) or degrees (yaw, roll, pitch, open, close)")
TOKEN = re.compile(r"(?P<number>((?<![^\s,;:])[-+])?(\.|(?<!\w),)?[0-9]+([.,][0-9]+)*)"
                   r"|(?P<word>[^\W\d_]+('s)?|[°,;.+])|(?P<blank>[\s:]+)|(?P<other>.)")


def read_number(text):
    if not re.fullmatch(r"[-+]?[0-9]+(\.[0-9]+)?", text):
        raise NotUnderstood(f"{text!r} is not a number: write digits and a decimal point, such as 5.5")
    return Token("number", text, float(text))


def tokenize(text):
    """Returns the tokens of a text, its units joined to their numbers and its ignored words left out."""
    text = re.sub("[−–]", "-", " ".join(text.lower().split()).replace("’", "'"))
    for phrase, word in PHRASES.items():
        text = re.sub(phrase, word, text)
    if re.search(r"\ble[ -]?fort", text):
        raise NotUnderstood("'Le Fort' is understood as Le Fort I only: write Le Fort I, with a blank before a number")
    tokens = []
    for match in TOKEN.finditer(text):
        kind, word = match.lastgroup, match[0]
        if kind == "number":
            tokens.append(read_number(word))
        elif word in UNITS:
            if not tokens or tokens[-1].kind != "number" or tokens[-1].unit:
                raise NotUnderstood(f"{word!r} has no number before it")
            tokens[-1] = tokens[-1]._replace(text=f"{tokens[-1].text} {word}", unit=UNITS[word])
        elif word in BOUNDARIES:
            tokens.append(Token("boundary", word))
        elif word in NAMES:
            tokens.append(Token("operation", NAMES[word]))
        elif word in MOVEMENTS:
            tokens.append(Token("movement", word))
        elif kind != "blank" and word not in IGNORED:
            raise NotUnderstood(f"{word!r} is not understood; {KNOWN}")
    split, jaw = (Token("operation", name) for name in ("sagittal split", "jaw"))
    return [split if token == jaw and split in tokens else token for token in tokens]  # the jaw is its piece


def split_clauses(tokens):
    """Returns {operation: tokens}: all tokens of a single operation, or those that follow each name."""
    named = {token.text: [] for token in tokens if token.kind == "operation"}
    if not named and any(MOVEMENTS.get(token.text, ("",))[0] == "open" for token in tokens):
        named = {"jaw": []}
    if not named:
        raise NotUnderstood(f"no operation is named; {KNOWN}")
    if len(named) == 1:
        return {name: [token for token in tokens if token.kind != "operation"] for name in named}
    current, previous = None, Token("boundary", "")
    for token in tokens:
        if token.kind == "operation" and token.text != current and previous.kind == "boundary":
            current = token.text
        elif token.kind == "operation" and token.text != current or not current:
            raise NotUnderstood(f"several operations ({', '.join(named)}): name each, after a comma, before its "
                                "movements")
        named[current].append(previous := token)
    return named


def read_movement(group, units_matter):
    """Returns (key, mm or degrees) of two or three adjacent tokens, None where they are not one movement."""
    shape = tuple("number" if token.kind == "number" else "side" if token.text in ("left", "right") else token.text
                  for token in group)
    if shape.count("number") != 1 or len(shape) == 3 and shape not in YAW_TO_A_SIDE:
        return None
    amount = group[shape.index("number")]
    words = [token.text for token in group if token.kind == "movement"]
    key, sign = MOVEMENTS["yaw" if len(group) == 3 else words[0]]
    if units_matter and amount.unit not in ("", unit_of(key)):
        return None
    return key, amount.value * (-1 if len(group) == 3 and "right" in words else sign)


def unit_of(key):
    return "degrees" if key in ROTATIONS else "mm"


def list_readings(segment, units_matter=True):
    """Returns all ways to read tokens as movements of two or three adjacent tokens each."""
    if not segment:
        return [[]]
    heads = [(size, read_movement(segment[:size], units_matter)) for size in (2, 3) if size <= len(segment)]
    return [[head, *rest] for size, head in heads if head for rest in list_readings(segment[size:], units_matter)]


def read_segment(segment):
    """Returns the movements between two boundaries, which have one reading."""
    text = " ".join(token.text for token in segment)
    if len(segment) > LONGEST:
        raise NotUnderstood(f"{text[:60]!r} … is too long: put a comma after each movement")
    found = list_readings(segment)
    if len(found) == 1:
        return found[0]
    if found:
        raise NotUnderstood(f"{text!r} can be read in several ways: put a comma after each movement")
    if wrong := list_readings(segment, units_matter=False):
        units = ", ".join(f"{key.replace('_', ' ')} is in {unit_of(key)}" for key, _ in wrong[0])
        raise NotUnderstood(f"{text!r} has a wrong unit: {units}")
    raise NotUnderstood(f"{text!r}: a movement is one number and one word, such as 5 mm forward or roll 2 degrees "
                        "(the left side rises); a yaw may have a side, such as yaw 2 degrees to the right")


def read_move(name, tokens):
    """Returns the clinical move of an operation, checked against what the scene accepts."""
    segments = [[]]
    for token in tokens:
        if token.kind == "boundary":
            segments.append([])
        elif token.kind != "operation":
            segments[-1].append(token)
    move = {}
    for key, value in (movement for segment in segments for movement in read_segment(segment)):
        alike = next((group for group in EXCLUSIVE if key in group), {key})
        if other := next((known for known in move if known in alike), None):
            raise NotUnderstood(f"{name}: {describe(other, move[other])} and {describe(key, value)} exclude each "
                                "other: remove one of them")
        if key == "open" and name not in ("sagittal split", "jaw"):
            raise NotUnderstood(f"{name}: {describe(key, value)} is a movement of the lower jaw")
        if key in OF_TEETH and name == "genioplasty":
            raise NotUnderstood(f"{name}: {describe(key, value)} is a target of a jaw with teeth")
        if abs(value) > LIMITS[unit_of(key)]:
            raise NotUnderstood(f"{name}: {describe(key, value)} is more than {LIMITS[unit_of(key)]} {unit_of(key)}")
        move[key] = value
    if not move:
        raise NotUnderstood(f"{name}: give a movement, such as 5 mm forward or yaw 2 degrees")
    return move


def read_operations(text):
    """Returns the operations of a text, upper jaw first and chin last; raises NotUnderstood."""
    clauses = split_clauses(tokenize(text))
    return [Operation(name, read_move(name, clauses[name])) for name in ORDER if name in clauses]


def describe(key, value):
    """Describes a movement in words that are read as the same movement."""
    opposite, unit = {"left": "right", "open": "close"}, unit_of(key)
    if key == "yaw":
        return f"yaw {abs(value):g} degrees to the {'right' if value < 0 else 'left'}"
    if value < 0 and key in opposite:
        key, value = opposite[key], -value
    return f"{key.replace('_', ' ')} {value:g} {unit}"


def summarize(operations):
    """Describes operations in one line."""
    return "; ".join(f"{name}: {', '.join(describe(*movement) for movement in move.items())}"
                     for name, move in operations)
