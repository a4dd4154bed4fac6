"""Extremes of the neo-Hookean solid in small bodies."""

import numpy as np

from bodies import block, fan, grid, in_layers, model_of_points, of_solid
from judge import Row, follow
from rows_springs import BUCKLES, floating, apart

FINE = ("-accuracy", "1e-6")


def plain(young=0.03, poisson=0.45, **more):
    return lambda _: of_solid(*block(**more), young, poisson)


def layered(in_skin, below, poisson=0.3):
    """Young's moduli of the first gap and of the second."""

    def make(_):
        model, prisms = block()
        first = model["point/layer"][prisms].max(1) == 1
        return of_solid(model, prisms, np.where(first, in_skin, below), poisson)

    return make


def as_if(in_skin, below):
    mild = layered(in_skin, below)
    return lambda _, found, step: follow(8)(mild(None), found, step)


def moved(change):
    """The slab with all its points and targets changed alike."""

    def make(_):
        model, prisms = block()
        for name in ("point/position", "point/target"):
            model[name] = change(model[name])
        return of_solid(model, prisms)

    return make


def scaled(factor):
    """The same slab in another unit of length; moduli in that unit are those of before over its
    square, so that forces are the same."""

    def make(_):
        model, prisms = block()
        for name in ("point/position", "point/target"):
            model[name] = model[name] * factor
        return of_solid(model, prisms, 0.03 / factor**2)

    return make


def one_triangle(_):
    skin = np.array([[0.0, 0, 0], [5, 0, 0], [0, 5, 0]])
    points, prisms, layer = in_layers(skin, [[0, 1, 2]], 2, 3.0)
    return of_solid(model_of_points(points, layer == 1, points + [1, 0.5, 0.2]), prisms)


def thick(thickness, **more):
    return lambda _: of_solid(*block(thickness=thickness, jitter=0, move=(0.3, 0.2, 0.1), **more))


def wrong(name, value):
    """The slab with a prism's datum that cannot be."""

    def make(_):
        model = of_solid(*block(jitter=0))
        model[name] = model[name].copy()
        model[name][0] = value
        return model

    return make


def as_solid(make):
    """A model of springs as a solid."""

    def made(_):
        model = make(None)
        prisms = model["prism/points"]
        return of_solid(
            {
                name: values
                for name, values in model.items()
                if not name.startswith(("spring", "prism"))
            },
            prisms,
        )

    return made


def slab_pulled(factor):
    """A slab whose bottom is held and whose top is pulled up to so many times its thickness."""

    def make(_):
        skin, triangles, _ = grid(3, 12.0)
        points, prisms, layer = in_layers(skin, triangles, 3, 6.0)
        target = points + np.where((layer == 0)[:, None], [0, 0, 6.0 * (factor - 1)], 0)
        return of_solid(model_of_points(points, layer != 1, target), prisms)

    return make


def inside_out(_):
    """A slab whose bottom is moved up through its top."""
    model, prisms = block(move=(0, 0, 9.0))
    return of_solid(model, prisms)


def fan_of(rays, **more):
    return lambda _: of_solid(*fan(rays, **more))


FOLDED = "folded|minimum"
ROWS = [
    Row(
        "Young 1e-9 below 1e12 N/mm²",
        layered(1e12, 1e-9),
        truth=as_if(1.0, 1e-9),
        may_end="rounding|not converged",
    ),
    Row(
        "Young 1e12 below 1e-9 N/mm²",
        layered(1e-9, 1e12),
        truth=as_if(1e4, 1e12),
        within=1e-3,
        may_end="too far apart",
    ),
    Row("Young 1e3 below 1e-3 N/mm²", layered(1e-3, 1e3), FINE, truth=follow(8)),
    *(
        Row(f"Poisson {nu}", plain(poisson=nu), FINE, truth=follow(8))
        for nu in (-0.9, -0.5, 0.0, 0.49, 0.4999)
    ),
    Row("meters", scaled(1e-3), ("-accuracy", "1e-9"), truth=follow(8)),
    Row("micrometers", scaled(1e3), ("-accuracy", "1e-3"), truth=follow(8)),
    Row(
        "1e6 mm from the origin",
        moved(lambda x: x + 1e6),
        ("-accuracy", "1e-4"),
        truth=follow(8),
        within=2e-4,
    ),
    Row("one triangle", one_triangle, FINE, truth=follow(8)),
    Row(
        "slabs ten thousand times thinner than wide", thick(12.0 / 3 * 1e-4), FINE, may_end=BUCKLES
    ),
    Row("slabs a hundred times deeper than wide", thick(400.0), FINE, truth=follow(8)),
    Row("64 layers", thick(16.0, layers=64, cells=2, size=8.0), FINE, truth=follow(4)),
    Row("a vertex with 500 neighbors", fan_of(500), FINE, truth=follow(8)),
    Row("slivers of 0.01°", fan_of(12, sweep=np.deg2rad(0.11)), FINE, may_end=BUCKLES),
    Row("a flat prism", wrong("prism/rest_volume", 0.0), FINE, refused="rest_volume.*flat prisms"),
    Row(
        "a negative shear modulus",
        wrong("prism/shear_modulus", -1.0),
        FINE,
        refused="shear_modulus",
    ),
    Row("tissue that nothing holds", as_solid(floating), FINE, refused="hold|float"),
    Row("parts that do not hang together", as_solid(apart), FINE, truth=follow(8)),
    Row("pulled out to twice its thickness", slab_pulled(2.0), FINE, truth=follow(16)),
    Row("pulled out to 10 times its thickness", slab_pulled(10.0), FINE, may_end=BUCKLES),
    Row("pulled out to 1e6 times its thickness", slab_pulled(1e6), ("-accuracy", "1"), may_end="."),
    Row("pressed to a tenth of its thickness", slab_pulled(0.1), FINE, may_end=FOLDED),
    Row("moved through its own skin", inside_out, FINE, may_end=FOLDED),
]
