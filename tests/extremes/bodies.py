"""Small bodies of tissue as the arrays of a model file: slabs of prisms, fans, chains of
springs."""

import numpy as np

from continuum import volumes, with_material
from networks import springs, springs_of


def model_of_points(position, fixed, target=None, force=None):
    """A model's datasets of points; `fixed` ones are held, and go to their targets."""
    count = len(position)
    target = np.where(fixed[:, None], position if target is None else target, position)
    return {
        "gravity": np.zeros(3),
        "point/position": position.astype(float),
        "point/set": np.where(fixed, 3, 0).astype("i1"),
        "point/target": target.astype(float),
        "point/layer": np.zeros(count, "i4"),
        "point/column": np.arange(count),
        "point/bone": np.full(count, -1, "i4"),
        "point/mass": np.zeros(count),
        "point/external_force": np.zeros((count, 3)) if force is None else force,
        "bone": np.zeros(0, "S1"),
    }


def in_layers(skin, triangles, layers, thickness):
    """Points [V · layers, 3], column by column, and prisms below a skin that faces +z."""
    vertices = len(skin)
    depth = -thickness * np.arange(layers) / (layers - 1)
    points = np.repeat(skin[:, None], layers, 1)
    points[:, :, 2] += depth
    top = np.asarray(triangles)[:, [0, 2, 1]] * layers  # so that volumes are above 0
    prisms = np.concatenate([np.hstack([top + a, top + a + 1]) for a in range(layers - 1)])
    layer = np.tile(np.arange(layers), vertices)
    return points.reshape(-1, 3), prisms, layer


def grid(cells, size):
    """A square skin of cells × cells squares, each of two triangles, and which vertices are its
    rim."""
    at = np.linspace(0, size, cells + 1)
    x, y = np.meshgrid(at, at, indexing="ij")
    skin = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    a, b, c, d = corner, corner + cells + 1, corner + cells + 2, corner + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    rim = (np.minimum(skin[:, 0], skin[:, 1]) == 0) | (np.maximum(skin[:, 0], skin[:, 1]) == size)
    return skin, triangles, rim


def block(cells=3, layers=3, size=12.0, thickness=6.0, move=(1.0, 0.5, 0.7), jitter=0.15):
    """A slab whose deepest points are held and whose half of them moves: (points' datasets,
    prisms)."""
    skin, triangles, _ = grid(cells, size)
    points, prisms, layer = in_layers(skin, triangles, layers, thickness)
    random = np.random.default_rng(7)
    points += jitter * random.uniform(-1, 1, points.shape) * size / cells / 4
    deepest = layer == layers - 1
    moved = deepest & (points[:, 0] > size / 2)
    model = model_of_points(points, deepest, points + np.where(moved[:, None], move, 0))
    model["point/layer"] = layer.astype("i4")
    model["point/column"] = np.arange(len(points)) // layers
    return model, prisms


def of_springs(model, prisms, stiffness=1.0, **more):
    """The model as springs, with its prisms for a volume term."""
    return (
        model
        | springs_of(model["point/position"], prisms, stiffness, **more)
        | {"prism/points": prisms, "prism/rest_volume": volumes(model["point/position"], prisms)[0]}
    )


def of_solid(model, prisms, young=0.03, poisson=0.45):
    """The model as a neo-Hookean solid."""
    return with_material(model | {"prism/points": prisms}, young, poisson)


def line(count, length=1.0):
    """Points on the x axis, both ends held."""
    position = np.zeros((count, 3))
    position[:, 0] = np.linspace(0, length * (count - 1), count)
    fixed = np.zeros(count, bool)
    fixed[[0, -1]] = True
    return position, fixed


def chain(count, stiffness, force, **more):
    """A chain of springs along x between held ends."""
    position, fixed = line(count)
    loads = np.zeros((count, 3))
    loads[1:-1, 0] = force
    model = model_of_points(position, fixed, force=loads)
    ends = np.stack([np.arange(count - 1), np.arange(1, count)], 1)
    return model | springs(position, ends, stiffness, **more)


def fan(rays, radius=10.0, thickness=2.0, move=(0.4, 0.2, 0.6), sweep=2 * np.pi):
    """One vertex with many neighbors, two layers; deepest points held, the middle one of them
    moved.

    A sweep below 2π gives slivers: an open fan.
    """
    turn = np.linspace(0, sweep, rays, endpoint=sweep < 2 * np.pi)
    around = radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)
    skin = np.vstack([np.zeros(3), around])
    first = 1 + np.arange(rays - (sweep < 2 * np.pi))
    triangles = np.stack([0 * first, first, 1 + first % rays], 1)
    points, prisms, layer = in_layers(skin, triangles, 2, thickness)
    deepest = layer == 1
    target = points.copy()
    target[1] += move
    model = model_of_points(points, deepest, target)
    model["point/layer"], model["point/column"] = layer.astype("i4"), np.arange(len(points)) // 2
    return model, prisms
