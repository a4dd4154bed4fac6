"""Extremes of contact, on the head of the paper's size. The independent minimizers know none: what
a row says is held to the result's own words, and repose-check recomputes gaps, forces and how deep
anything is."""

from judge import Row
from rows_scenes import HARD, SKIN_ON_FAT, forward, head, turned

FACE = "material: {preset: face}"
LIMITED = ("-time_limit", "60")
BALL = "sphere: {{center: [{}], radius: 20}}, push: [{}], skin: slide"


def ball(center, push):
    return f"instruments:\n  - {{{BALL.format(center, push)}}}\n"


def row(name, moves="", more="", in_tissue="", tissue=FACE, may_end="", refused="", slow=False):
    scene = head(tissue, moves, more, in_tissue=in_tissue)
    return Row(
        name,
        lambda _: scene,
        LIMITED,
        may_end=may_end,
        refused=refused,
        slow=slow,
        judged=False,
    )


TENSION = "lower tissue.turgor"
ROWS = [
    row("a jaw moved 60 mm forward, through its skin", forward(60), may_end=HARD),
    row("a jaw moved 40 mm up, into the skull", "translate: [0, 0, 40]", may_end=HARD),
    row("a mouth closed by 20°", turned(-20), may_end=HARD),
    row("a ball pushed 40 mm into the cheek", more=ball("-63, -98, -10", "24, 32, 0"),
        may_end="pierced by an instrument"),
    row("a ball that begins inside the cheek", more=ball("-50, -80, -10", "1, 1, 0"),
        may_end="pierced by an instrument"),
    row("penalty a million times too soft", turned(8), "contact: {stiffness: 1e-7}\n",
        may_end="leave contact.stiffness"),
    row("penalty a million times too stiff", turned(8), "contact: {stiffness: 1e5}\n",
        may_end="leave contact.stiffness"),
    row("a grid of 10 mm", turned(8), "contact: {grid: 10}\n"),
    row("a grid of 0.1 mm", turned(8), "contact: {grid: 0.1}\n", refused="make contact.grid larger",
        slow=True),
    row("teeth where no bone is", turned(8),
        "teeth:\n  - {sphere: {center: [0, -500, 0], radius: 5}}\n",
        refused="holds no column that ends at bone"),
    row("all tissue slides on bone", turned(8), in_tissue="  attach: slide\n", may_end=HARD),
    row("no tissue knows of bone", turned(8), in_tissue="  attach: free\n",
        refused="attach some to be fixed or slide"),
    row("turgor 0.3 and a cut", more="incisions:\n  - {path: [[47, -80, 8], [49, -75, -8]], layers: 3}\n",
        in_tissue="  turgor: 0.3\n", tissue=SKIN_ON_FAT, may_end=TENSION, slow=True),
]
