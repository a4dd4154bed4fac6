"""The solid converges to the continuum as it is refined: an inflated thick sphere against the solution of
its ordinary differential equation, and a block that bends under its own weight against itself."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from continuum import moduli, with_material
from tissue import last, write_model

YOUNG, POISSON = 0.015, 0.45
INNER, OUTER, INFLATED = 20.0, 30.0, 24.0  # mm, radii; the inner one goes to the last


def prisms_of(triangles, layers):
    """Prisms of columns of `layers` points from the top down; triangles counter-clockwise from above."""
    swapped = triangles[:, [0, 2, 1]]
    return np.concatenate([np.hstack([swapped * layers + a, swapped * layers + a + 1])
                           for a in range(layers - 1)])


def model_of_points(x, triangles, layers, fixed, target):
    count = len(x)
    model = {"gravity": np.zeros(3), "point/position": x, "point/target": target,
             "point/set": np.where(fixed, 3, 0).astype(np.int8),
             "point/layer": (np.arange(count) % layers).astype(np.int32),
             "point/column": np.arange(count) // layers,
             "point/bone": np.full(count, -1, np.int32),
             "point/mass": np.zeros(count), "point/external_force": np.zeros((count, 3)),
             "prism/points": prisms_of(triangles, layers)}
    return with_material(model, YOUNG, POISSON)


def solve(run, tmp_path, model):
    file = tmp_path / "model.h5"
    file.unlink(missing_ok=True)
    write_model(file, model)
    result = run("repose-solve", "model.h5", "-accuracy", 1e-6, "-output", "out")
    assert (result.returncode, result.stderr) == (0, ""), result
    return last(tmp_path / "out.h5")


def icosphere(rounds):
    """Unit vectors and triangles, counter-clockwise from outside."""
    golden = (1 + 5 ** 0.5) / 2
    x = np.array([[0, s, t * golden] for s in (-1, 1) for t in (-1, 1)])
    x = np.concatenate([np.roll(x, k, axis=1) for k in range(3)])
    edge = 2.0
    near = np.isclose(np.linalg.norm(x[:, None] - x, axis=2), edge)
    triangles = np.array([(i, j, k) for i in range(12) for j in range(i) for k in range(j)
                          if near[i, j] and near[j, k] and near[i, k]])
    for _ in range(rounds):
        ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
        edges, middle = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
        a, b, c = triangles.T
        p, q, r = (middle.reshape(-1, 3) + len(x)).T
        x = np.concatenate([x, x[edges].mean(axis=1)])
        triangles = np.concatenate([np.stack(t, axis=1) for t in
                                    ((a, p, r), (p, b, q), (r, q, c), (p, q, r))])
    corners = x[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normal * corners.mean(axis=1)).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    return x / np.linalg.norm(x, axis=1)[:, None], triangles


def outer_radius():
    """Outer radius of the inflated shell: r(R) with d(R² ∂W/∂r')/dR = R² ∂W/∂r, no stress outside."""
    mu, kappa = moduli(YOUNG, POISSON)

    def slopes(radius, y):
        r, push = y
        q = r ** 2 / radius ** 2
        by = (push / radius ** 2 + (mu + kappa) * q) / (mu + kappa * q ** 2)
        volume = by * q
        return np.array([by, 2 * mu * r + (kappa * (volume - 1) - mu) * 2 * r * by])

    radius = np.linspace(INNER, OUTER, 400)
    found = solve_bvp(slopes, lambda a, b: np.array([a[0] - INFLATED, b[1]]), radius,
                      np.array([radius + 3, 0 * radius]), tol=1e-10, max_nodes=100000)
    assert found.success
    return found.sol(OUTER)[0]


@pytest.mark.quick
def test_an_inflated_sphere_converges_with_second_order(run, tmp_path):
    exact, errors = outer_radius(), []
    for rounds, layers in (1, 2), (2, 3), (3, 5):
        unit, triangles = icosphere(rounds)
        radii = np.linspace(OUTER, INNER, layers)
        x = (unit[:, None] * radii[:, None]).reshape(-1, 3)
        fixed = np.arange(len(x)) % layers == layers - 1
        target = np.where(fixed[:, None], x * INFLATED / INNER, x)
        step = solve(run, tmp_path, model_of_points(x, triangles, layers, fixed, target))
        outside = step["point/position"][::layers]
        errors.append(abs(np.linalg.norm(outside, axis=1).mean() - exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 0.02 * (exact - OUTER), (errors, exact)
    assert (orders > 1.7).all(), (errors, orders)


def test_a_block_that_bends_under_its_weight_converges(run, tmp_path):
    length, width = 30.0, 10.0
    weight = 2e-6 * 9.80665  # N/mm³
    tips = []
    for cells in 4, 8, 16:
        columns = 3 * cells + 1, cells + 1
        layers = cells + 1
        i, j, a = np.meshgrid(*(np.arange(n) for n in (*columns, layers)), indexing="ij")
        x = np.stack([i * length / (columns[0] - 1), j * width / cells, -a * width / cells],
                     axis=-1).reshape(-1, 3).astype(float)
        column = (np.arange(columns[0])[:, None] * columns[1] + np.arange(columns[1]))
        low, right = column[:-1, :-1].ravel(), column[1:, :-1].ravel()
        up, across = column[:-1, 1:].ravel(), column[1:, 1:].ravel()
        triangles = np.concatenate([np.stack([low, right, across], axis=1),
                                    np.stack([low, across, up], axis=1)])
        model = model_of_points(x, triangles, layers, x[:, 0] == 0, x)
        mass = np.zeros(len(x))
        np.add.at(mass, model["prism/points"].ravel(),
                  np.repeat(model["prism/rest_volume"] / 6, 6))
        model["point/external_force"] = mass[:, None] * [0, 0, -weight]
        step = solve(run, tmp_path, model)
        tips.append(step["point/displacement"][x[:, 0] == length][:, 2].mean())
    one, two = abs(tips[1] - tips[0]), abs(tips[2] - tips[1])
    assert abs(tips[2]) > 1  # mm: large enough to be no small strain
    # The stress is singular along the clamped edges: no more than about the first order.
    assert np.log2(one / two) > 0.8, tips
