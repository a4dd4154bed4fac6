"""Extremes of whole scenes, on the head of the paper's size, of springs and of a solid."""

import meshio

from conftest import PROJECT
from judge import Row

MESHES = PROJECT / "meshes"
TISSUES = {
    "springs": "springs: {default: {modulus: 0.05, law: quartic, reference: 1.0}}",
    "solid": "material: {preset: face}",
}
SKIN_ON_FAT = "material: {preset: skin_on_fat}"  # has a skin that can be stretched
SLIDE = "sphere: {center: [-63, -98, -10], radius: 20}, push: [9, 12, 0], skin: slide"


ALONE = "contact: {bones: off, cuts: off}\n"  # the judges know of none


def head(tissue, moves="", more=ALONE, layers=4, in_tissue="", solve="", meshes=MESHES):
    """A scene's text; `moves` are those of the mandible."""
    listed = f"moves:\n  - {{bone: mandible, {moves}}}\n" if moves else ""
    return f"""skin: {meshes}/paper_skin.ply
bones:
  - {{name: skull, file: {meshes}/paper_skull.ply}}
  - {{name: mandible, file: {meshes}/paper_mandible.ply}}
tissue:
  layers: {layers}
  {tissue}
{in_tissue}{listed}{more}{solve}"""


def turned(angle):
    return f"rotate: {{axis: [1, 0, 0], center: [0, 0, 0], angle: {angle}}}"


def forward(distance):
    return f"translate: [0, {-distance}, 0]"


def in_unit(tissue, factor):
    """The same surfaces with coordinates in another unit of length."""

    def make(folder):
        for part in ("skin", "skull", "mandible"):
            mesh = meshio.read(MESHES / f"paper_{part}.ply")
            meshio.Mesh(mesh.points.astype(float) * factor, mesh.cells).write(
                folder / f"paper_{part}.ply"
            )
        return head(tissue, forward(6), meshes=folder)

    return make


def everything(tissue, volume):
    more = f"""gravity: [0, 0, -9.80665]
scan_gravity: [0, 9.80665, 0]
forces:
  - {{at: [0, -98, -61], radius: 8, force: [0, -0.05, 0]}}
instruments:
  - {{{SLIDE}}}
incisions:
  - {{path: [[47, -80, 8], [49, -75, -8]], layers: 2}}
collision: {{mode: report}}
"""
    return lambda _: head(
        tissue, turned(8), more, in_tissue="  turgor: 0.03\n  density: 1.0e-6\n", solve=volume
    )


HARD = "FOLDED|minimum|rounding|fails|limit"
LIMITED = ("-time_limit", "200")


def rows_of_turgor(kind, volume):
    """A solid of fat has no skin to stretch; springs that are stretched to twice their length ask
    others to have negative rest lengths."""
    tissue = SKIN_ON_FAT if kind == "solid" else TISSUES[kind]
    for turgor in (0, 0.1, 1):
        scene = head(tissue, forward(6), in_tissue=f"  turgor: {turgor}\n", solve=volume)
        refused = "negative rest lengths" if kind == "springs" and turgor == 1 else ""
        yield Row(
            f"head: turgor {turgor}, jaw 6 mm forward",
            lambda _, scene=scene: scene,
            LIMITED,
            may_end="" if refused else HARD,
            refused=refused,
            slow=turgor > 0,
        )


def rows_of(kind):
    tissue = TISSUES[kind]
    volume = "solve: {volume: {form: penalty, poisson: 0.4967}}\n" if kind == "springs" else ""

    def row(name, *arguments, may_end=HARD, slow=True, **more):
        scene = head(tissue, *arguments, solve=volume, **more)
        return Row(name, lambda _: scene, LIMITED, may_end=may_end, slow=slow)

    yield row("head: jaw 6 mm forward", forward(6), may_end="", slow=False)
    yield row("head: jaw opened by 8°", turned(8), may_end="", slow=False)
    yield row("head: jaw opened by 25°", turned(25))
    yield row("head: jaw opened by 45°", turned(45))
    yield row("head: jaw 15 mm back", forward(-15))
    yield row("head: jaw 40 mm forward", forward(40))
    yield from rows_of_turgor(kind, volume)
    yield row("head: 64 layers, jaw 2 mm forward", forward(2), layers=64)
    for factor, unit in ((1e-3, "meters"), (1e3, "micrometers")):
        yield Row(
            f"head: surfaces in {unit}",
            in_unit(tissue, factor),
            refused="in (meters|micrometers)|20 mm|2000 mm|across",
        )
    yield Row(
        "head: cut, weight, turgor, forces, sliding, contact at once",
        everything(SKIN_ON_FAT if kind == "solid" else tissue, volume),
        LIMITED,
        may_end=HARD + "|SETTLED",
        slow=True,
    )
