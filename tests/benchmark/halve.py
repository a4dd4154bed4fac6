#!/usr/bin/env python3
"""Writes the model of a result with mesh and layers both halved: each prism of a solid becomes
eight, of the same shape together, the same material and the same fixed sides. With -layers 1 the
layers stay as they are.

    tests/benchmark/halve.py RESULT.h5 HALVED.h5 [-layers 2]
    repose-solve HALVED.h5 -output NAME
    tests/benchmark/finite_elements.py NAME.h5 -against RESULT.h5

A point between fixed points is fixed and goes to the middle of their targets. The skin's own
vertices keep their columns' numbers. For models without incisions. Needs: apt-get install
--no-install-recommends python3-h5py python3-numpy
"""

import numpy as np

from page import option_parser  # which adds the folder of the next ones
from continuum import edges_of, volumes, wedge_laplacians
from tissue import model_of, write_model


def edges_and_rows(triangles):
    """Edges [E, 2] of triangles, and each triangle's three: 01, 12, 20."""
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    edges, row = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    return edges, row.reshape(-1, 3)


def grid_of(model):
    """Points by column and layer, [V, n], and the prisms' columns, [M, 3]."""
    column, layer = model["point/column"], model["point/layer"]
    grid = np.full((column.max() + 1, layer.max() + 1), -1)
    grid[column, layer] = np.arange(len(column))
    assert (grid >= 0).all()
    return grid, column[model["prism/points"][:, :3]]


def parents_of(grid, edges, parts):
    """The up to four points between which each new one lies, by column and layer, [V + E, layers,
    4], with gaps between layers in one or two parts."""
    new = np.arange(parts * (grid.shape[1] - 1) + 1)
    upper, lower = new // parts, (new + parts - 1) // parts
    ends = np.vstack([np.repeat(np.arange(len(grid))[:, None], 2, 1), edges])
    return np.concatenate([grid[ends][:, :, upper], grid[ends][:, :, lower]], 1).transpose(0, 2, 1)


def points_of(model, parents):
    """Datasets of the points, layer by layer within columns."""
    columns, layers, _ = parents.shape
    rows = parents.reshape(-1, 4)
    fixed = (model["point/set"][rows] != 0).all(1)
    middle = model["point/position"][rows].mean(1)
    return {"point/position": middle,
            "point/set": np.where(fixed, model["point/set"][rows].max(1), 0).astype(np.int8),
            "point/target": np.where(fixed[:, None], model["point/target"][rows].mean(1), middle),
            "point/bone": np.where(fixed, model["point/bone"][rows].max(1), -1).astype(np.int32),
            "point/layer": np.tile(np.arange(layers, dtype=np.int32), columns),
            "point/column": np.repeat(np.arange(columns), layers)}


def quarters(corners, middles):
    """The four triangles [F, 4, 3] of each with corners 0, 1, 2 and middles of 01, 12, 20."""
    (a, b, c), (ab, bc, ca) = corners.T, middles.T
    return np.stack([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))],
                    1)


def halved(model, parts=2):
    grid, corners = grid_of(model)
    skin = model["point/column"][model["skin/points"]]
    edges, row = edges_and_rows(np.vstack([skin, corners]))
    quarter = quarters(np.vstack([skin, corners]), len(grid) + row)
    parents = parents_of(grid, edges, parts)
    new, layers = points_of(model, parents), parents.shape[1]
    a, b = (model["point/layer"][model["prism/points"][:, corner]] for corner in (0, 3))
    upper = parts * np.minimum(a, b)[:, None] + np.arange(parts)  # of the parts of a gap
    top = layers * quarter[len(skin):, :, None, :] + upper[:, None, :, None]
    prisms = np.concatenate([top, top + 1], 3)
    turned = a > b
    prisms[turned] = prisms[turned][..., [3, 4, 5, 0, 1, 2]]
    new |= {"prism/points": prisms.reshape(-1, 6),
            "skin/points": layers * quarter[:len(skin)].reshape(-1, 3)}
    for name in ("prism/modulus", "prism/shear_modulus", "prism/nodal_modulus"):
        if name in model:
            new[name] = np.repeat(model[name], 4 * parts)
    return new | solid_of(new) | {name: model[name] for name in ("bone", "gravity")}


def solid_of(new):
    x, prisms, mu = new["point/position"], new["prism/points"], new["prism/shear_modulus"]
    edges, weights = edges_of(wedge_laplacians(x, prisms), prisms, mu)
    volume = volumes(x, prisms)[0]
    return {"edge/points": edges, "edge/weight": weights, "prism/rest_volume": volume,
            "prism/target_volume": volume * (1 + mu / new["prism/modulus"])}


def main():
    parser = option_parser(__doc__, layers=2)
    parser.add_argument("files", nargs=2)
    chosen = parser.parse_args()
    write_model(chosen.files[1], halved(model_of(chosen.files[0]), chosen.layers))


if __name__ == "__main__":
    main()
