"""Extremes of springs in small bodies."""

import numpy as np

from bodies import block, chain, fan, grid, in_layers, line, model_of_points, of_springs
from judge import Row, follow
from networks import springs

NONE = ("-volume", "none")
FINE = (*NONE, "-accuracy", "1e-6")


def linear_chain(count, exponents, seed=1, force=3.0):
    """A chain without rest lengths whose stiffnesses spread over so many orders of magnitude, and
    where
    it comes to rest."""
    random = np.random.default_rng(seed)
    stiffness = 10 ** random.uniform(*exponents, count - 1)
    stiffness[[0, -1]] = 10.0 ** np.array(exponents)
    loads = force * random.uniform(-1, 1, count - 2)
    model = chain(count, stiffness, loads, power=0, rest=0.0)

    def truth(model, *_):
        below = np.concatenate([[0], np.cumsum(loads)])
        tension = (count - 1 + (below / stiffness).sum()) / (1 / stiffness).sum() - below
        rest = model["point/position"].copy()
        rest[1:-1, 0] = np.cumsum(tension / stiffness)[:-1]
        return rest

    return model, truth


def chain_row(name, *arguments, **row):
    model, truth = linear_chain(*arguments)
    return Row(name, lambda _: model, NONE, truth=truth, **row)


def plain(**more):
    """A slab of springs, made when its row is run."""
    return lambda _: of_springs(*block(), **more)


def layered(stiffness_of_skin, stiffness):
    def make(_):
        model, prisms = block()
        model = of_springs(model, prisms, stiffness, power=0)
        in_skin = (model["point/layer"][model["spring/points"]] == 0).all(1)
        model["spring/stiffness"][in_skin] = stiffness_of_skin
        return model

    return make


def through_a_point():
    """Two soft points in one place, between held ends: a spring of no initial length joins them."""
    position, fixed = line(4, 1.0)
    position[2] = position[1]
    model = model_of_points(position, fixed)
    ends = np.array([[0, 1], [1, 2], [2, 3]])
    return model, position, ends


def no_length(rest):
    def make(_):
        model, position, ends = through_a_point()
        lengths = np.array([0.5, rest, 0.5])
        return model | springs(position, ends, 1.0, power=0, rest=lengths)

    return make


def in_one_place(_):
    """A free point where its only spring's other end is, which the spring keeps 1 mm away."""
    model = model_of_points(np.zeros((2, 3)), np.array([True, False]))
    return model | springs(np.zeros((2, 3)), np.array([[0, 1]]), 1.0, power=0, rest=1.0)


def pressed_chain(_):
    """A straight chain a fifth too long: it will buckle, and no force says where to."""
    return chain(9, 1.0, 0.0, power=0, rest=1.2)


def pressed_by_targets(_):
    """The same, pressed by an end that moves."""
    model = chain(9, 1.0, 0.0, power=0)
    model["point/target"][-1, 0] -= 2
    return model


def mechanism(_):
    """Two rods in line: the joint between them moves across at no cost of the first order."""
    return chain(3, 1.0, 0.0, power=0)


def floating(_):
    """A part that nothing holds, beside one that is held."""
    model, prisms = block()
    points = len(model["point/position"])
    twice = {
        name: (np.concatenate([values, values]) if name.startswith("point/") else values)
        for name, values in model.items()
    }
    twice["point/position"][points:, 0] += 100
    twice["point/target"][points:, 0] += 100
    twice["point/column"][points:] += points
    twice["point/set"][points:] = 0
    twice["point/target"] = np.where(
        (twice["point/set"] == 0)[:, None], twice["point/position"], twice["point/target"]
    )
    return of_springs(twice, np.concatenate([prisms, prisms + points]))


def apart(_):
    """Two parts that do not hang together, each held."""
    model = floating(None)
    points = len(model["point/position"]) // 2
    model["point/set"][points:] = model["point/set"][:points]
    model["point/target"][points:] = model["point/target"][:points] + [100, 0, 0]
    return model


def moved_away(_):
    """Far from the origin."""
    model = of_springs(*block())
    for name in ("point/position", "point/target"):
        model[name] = model[name] + 1e6
    return model


def scaled(factor):
    """The same slab in another unit of length, its moduli in that unit too."""

    def make(_):
        model = of_springs(*block())
        powers = {
            "point/position": 1,
            "point/target": 1,
            "spring/rest_length": 1,
            "spring/reference": 1,
            "spring/stiffness": 1,
            "prism/rest_volume": 3,
        }
        return model | {name: model[name] * factor**power for name, power in powers.items()}

    return make


def one_triangle(_):
    """A single triangle of skin over a held one."""
    skin = np.array([[0.0, 0, 0], [5, 0, 0], [0, 5, 0]])
    points, prisms, layer = in_layers(skin, [[0, 1, 2]], 2, 3.0)
    deepest = layer == 1
    return of_springs(model_of_points(points, deepest, points + [1, 0.5, 0.2]), prisms)


def slender(ratio):
    """Slabs so thin or so deep."""
    return lambda _: of_springs(*block(thickness=12.0 / 3 * ratio, move=(0.3, 0.2, 0.1), jitter=0))


def flat(_):
    """A prism without volume."""
    model, prisms = block(jitter=0)
    model = of_springs(model, prisms)
    flattened = np.unique(prisms[0, :3])
    model["point/position"][prisms[0, 3:]] = model["point/position"][flattened][:, :]
    model["prism/rest_volume"][0] = 0
    return model


def inverted(_):
    """Prisms whose volumes are below 0."""
    model, prisms = block(jitter=0)
    return of_springs(model, prisms[:, [0, 2, 1, 3, 5, 4]])


def fan_of(rays, sweep=2 * np.pi):
    return lambda _: of_springs(*fan(rays, sweep=sweep))


def deep(layers):
    return lambda _: of_springs(
        *block(cells=2, layers=layers, size=8.0, thickness=16.0, move=(0.5, 0.2, 0.1), jitter=0)
    )


def long_chain(count):
    """A chain of unit springs, its far end pulled out by a thousandth of its length."""
    model = chain(count, 1.0, 0.0, power=0)
    model["point/target"][-1, 0] *= 1.001
    return model


def stretched(model, *_):
    return model["point/position"] * [1.001, 1, 1]


def stretched_by(factor):
    """Rods that one end pulls out to so many times their length."""

    def make(_):
        model = chain(5, 1.0, 0.0)
        model["point/target"][-1, 0] *= factor
        return model

    def truth(model, *_):
        return model["point/position"] * [factor, 1, 1]

    return make, truth


def far_out(factor, **row):
    make, truth = stretched_by(factor)
    return Row(f"a rod pulled out to {factor:g} times its length", make, NONE, truth=truth, **row)


def of_paper(weight, **row):
    options = ("-volume", "paper", "-lambda", weight, "-accuracy", "1e-6")
    return Row(f"lambda {weight}", plain(), options, **row)


BUCKLES = "minimum|buckl|curvature"
ROWS = [
    chain_row("stiffness 1e-9 … 1e12 in a chain", 12, (-9, 12), 1, 1e-9, may_end="too far apart.*closer"),
    chain_row("stiffness 1e-3 … 1e3 in a chain", 41, (-3, 3), 2),
    chain_row("stiffness 1e-6 … 1e6 in a chain", 41, (-6, 6), 3, 1e-3),
    Row("skin of 1e6 on tissue of 1e-6 N/mm", layered(1e6, 1e-6), FINE),
    Row(
        "skin of 1e12 on tissue of 1e-9 N/mm",
        layered(1e12, 1e-9),
        NONE,
        may_end="rounding|not converged",
    ),
    Row("skin of 1e-9 on tissue of 1e12 N/mm", layered(1e-9, 1e12), NONE),
    Row("s_ref 1e-80 mm, σ⁴ beyond all numbers", plain(reference=1e-80), NONE, refused="too large"),
    Row("s_ref 1e-9 mm", plain(reference=1e-9), NONE, truth=follow(8)),
    Row("s_ref 1e-3 mm", plain(reference=1e-3), FINE, truth=follow(8)),
    Row("s_ref 1e9 mm", plain(reference=1e9), FINE, truth=follow(8)),
    Row("springs of no initial length and none at rest", no_length(0.0), FINE),
    Row("a spring of no initial length, 0.1 mm at rest", no_length(0.1), FINE, may_end=BUCKLES),
    Row("a point where its only spring's other end is", in_one_place, FINE, may_end=BUCKLES),
    Row(
        "springs of no rest length",
        plain(rest=0.0, power=0),
        FINE,
        truth=follow(8),
        may_end="folded",
    ),
    Row("a straight chain a fifth too long", pressed_chain, FINE, may_end=BUCKLES),
    Row(
        "a straight chain pressed together by a quarter", pressed_by_targets, FINE, may_end=BUCKLES
    ),
    Row("rods in line, free to move across", mechanism, FINE, may_end="minimum|singular|free"),
    Row("tissue that nothing holds", floating, FINE, refused="hold|float"),
    Row("parts that do not hang together", apart, FINE, truth=follow(8)),
    Row("1e6 mm from the origin", moved_away, (*NONE, "-accuracy", "1e-4"), truth=follow(8)),
    Row("meters", scaled(1e-3), (*NONE, "-accuracy", "1e-9"), truth=follow(8)),
    Row("micrometers", scaled(1e3), (*NONE, "-accuracy", "1e-3"), truth=follow(8)),
    Row("one triangle", one_triangle, FINE, truth=follow(8)),
    Row("slabs ten thousand times thinner than wide", slender(1e-4), FINE, may_end=BUCKLES),
    Row("slabs a hundred times deeper than wide", slender(100), FINE, truth=follow(8)),
    Row("a flat prism", flat, FINE, refused="rest_volume.*flat prisms"),
    Row("prisms inverted at the start", inverted, FINE, refused="rest_volume.*above 0"),
    Row("a vertex with 500 neighbors", fan_of(500), FINE),
    Row("slivers of 0.01°", fan_of(12, sweep=np.deg2rad(0.11)), FINE, may_end=BUCKLES),
    Row("64 layers", deep(64), FINE),
    Row(
        "a chain of 1e5 springs",
        lambda _: long_chain(100001),
        ("-volume", "none", "-accuracy", "0.01"),
        truth=stretched,
        slow=True,
        judged=True,
    ),
    far_out(100.0),
    far_out(1e20, within=1e10, may_end=".", refused="large|expected"),
    far_out(1e80, may_end=".", refused="finite|large|expected"),
    Row(
        "kappa 1e-9 N/mm²", plain(), ("-bulk_modulus", "1e-9", "-accuracy", "1e-6"), truth=follow(8)
    ),
    Row("kappa 1e9 N/mm²", plain(), ("-bulk_modulus", "1e9", "-accuracy", "1e-6")),
    of_paper("1e-9", may_end=BUCKLES),
    of_paper("1"),
    of_paper("0", refused="lambda.*above 0|> 0"),
]
