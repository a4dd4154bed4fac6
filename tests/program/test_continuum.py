"""The solid's closed forms, of the reference in continuum.py that judges the programs."""

import numpy as np
import pytest
from scipy.optimize import brentq

from continuum import Solid, jacobians, moduli, rest_position, volumes, with_material
from tissue import prism_volumes

pytestmark = pytest.mark.quick

YOUNG, POISSON = 0.015, 0.45
MU, KAPPA = moduli(YOUNG, POISSON)
LOW, HIGH = 0, 3  # mm, of the block


def block(count=3, layers=4, noise=0.0, fixed=lambda x: x[:, 2] == LOW):
    """A model of a block of count × count squares of two triangles each and so many point layers,
    every point moved at random by up to `noise` mm except along a face's normal."""
    side = np.linspace(LOW, HIGH, count + 1)
    x = np.stack(np.meshgrid(side, side, np.linspace(LOW, HIGH, layers), indexing="ij"), -1)
    number = np.arange(x[..., 0].size).reshape(x.shape[:3])
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack(t, -1).reshape(-1, layers, 3)
                                for t in ((a, b, c), (a, c, d))])
    prisms = np.concatenate([triangles[:, :-1], triangles[:, 1:]], 2).reshape(-1, 6)
    x = x.reshape(-1, 3)
    moved = noise * np.random.default_rng(1).uniform(-1, 1, x.shape)
    x = x + np.where((x == LOW) | (x == HIGH), 0, moved)
    held = fixed(x).astype(np.int8)
    return with_material({"point/position": x, "point/set": held, "point/target": x.copy(),
                          "prism/points": prisms}, YOUNG, POISSON)


def surface(x):
    return ((x == LOW) | (x == HIGH)).any(1)


def area_force(solid, x, face):
    """Reaction of the points of a face, N."""
    return solid.value_and_gradient(x)[1][face].sum(0)


def test_a_solid_at_rest_has_no_energy_and_no_force():
    solid = Solid(block(noise=0.2))
    value, gradient = solid.value_and_gradient(solid.rest)
    assert abs(value) < 1e-12 * solid.at_rest and abs(gradient).max() < 1e-14


def test_rigid_motions_cost_nothing():
    solid = Solid(block(noise=0.2))
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    value, gradient = solid.value_and_gradient(solid.rest @ turn.T + [5, -7, 300])
    assert abs(value) < 1e-11 * solid.at_rest and abs(gradient).max() < 1e-13


def averaged(model):
    """Returns the model with volumes averaged around points."""
    return model | {"prism/nodal_modulus": 0.9 * model["prism/modulus"]}


@pytest.mark.parametrize("made", [lambda model: model, averaged])
@pytest.mark.parametrize("order", [1, 2])
def test_slopes_are_those_of_the_energy(order, made):
    solid = Solid(made(block(noise=0.2)))
    random = np.random.default_rng(3)
    x = solid.rest + random.normal(size=solid.rest.shape) / 5
    way = random.normal(size=x.shape)
    gradients = [solid.value_and_gradient(x + h * way)[1] for h in (-1e-4, 1e-4)]
    if order == 1:
        values = [solid.value(x + h * way) for h in (-1e-4, 1e-4)]
        slope = (solid.value_and_gradient(x)[1] * way).sum()
        assert (values[1] - values[0]) / 2e-4 == pytest.approx(slope, rel=1e-6)
    else:
        bent = (solid.hessian(x) @ way.ravel()).reshape(-1, 3)
        assert (gradients[1] - gradients[0]) / 2e-4 == pytest.approx(bent, rel=1e-6, abs=1e-8)


def test_volumes_are_those_of_the_polynomial():
    model = block(noise=0.2)
    x, prisms = model["point/position"], model["prism/points"]
    for mine, other in zip(volumes(x, prisms), prism_volumes(x, prisms)):
        assert mine == pytest.approx(other, abs=1e-12)
    assert volumes(x, prisms)[0].sum() == pytest.approx((HIGH - LOW)**3, rel=1e-12)


@pytest.mark.parametrize("made", [lambda model: model, averaged])
@pytest.mark.parametrize("change", ["small", "large"])
def test_patch(change, made):
    """Any affine map of the surface is the affine map of the inside, exactly."""
    model = made(block(count=4, noise=0.2, fixed=surface))
    random = np.random.default_rng(4)
    map_ = np.eye(3) + random.uniform(-1, 1, (3, 3)) * (0.01 if change == "small" else 0.3)
    goal = model["point/position"] @ map_.T
    assert abs(rest_position(Solid(model), goal) - goal).max() < 1e-9


@pytest.mark.parametrize("stretch", [0.6, 0.99, 1.7])
def test_uniaxial_stretch(stretch):
    """The stretched block's sides are free of forces; its ends are pulled as the formula says."""
    def lateral_stress(across):
        det = stretch * across**2
        return MU * across - MU * stretch * across + KAPPA * (det - 1) * stretch * across

    across = brentq(lateral_stress, 0.3, 3)
    solid = Solid(block(noise=0.2))
    x = solid.rest * [across, across, stretch]
    ends = (solid.rest[:, 2] == LOW) | (solid.rest[:, 2] == HIGH)
    assert abs(solid.value_and_gradient(x)[1][~ends]).max() < 1e-14
    stress = MU * stretch + (KAPPA * (stretch * across**2 - 1) - MU) * across**2
    pull = area_force(solid, x, solid.rest[:, 2] == HIGH)
    assert pull == pytest.approx(np.array([0, 0, stress * (HIGH - LOW)**2]), abs=1e-13)


def test_simple_shear():
    solid = Solid(block(noise=0.2))
    shear = 0.8
    x = solid.rest + shear * solid.rest[:, [2]] * [1, 0, 0]
    pull = area_force(solid, x, solid.rest[:, 2] == HIGH)
    assert pull[0] == pytest.approx(MU * shear * (HIGH - LOW)**2, rel=1e-12)
    assert volumes(x, solid.prisms)[0] == pytest.approx(solid.volume, rel=1e-12)


def test_small_strains_are_hookes():
    solid = Solid(block(noise=0.2))
    strain = 1e-5
    x = solid.rest * [1 - POISSON * strain, 1 - POISSON * strain, 1 + strain]
    pull = area_force(solid, x, solid.rest[:, 2] == HIGH)
    assert pull == pytest.approx([0, 0, YOUNG * strain * (HIGH - LOW)**2], rel=1e-4, abs=1e-9)


def test_a_column_hangs_by_its_weight():
    """Under dead forces what holds the fixed points carries them all."""
    model = block(noise=0.1)
    solid = Solid(model)
    weight = np.zeros_like(solid.rest)
    weight[solid.soft, 0] = 1e-4
    x = rest_position(solid, force=weight)
    held = area_force(solid, x, model["point/set"] == 1)
    assert held == pytest.approx(-weight.sum(0), abs=1e-12)
    assert np.linalg.det(jacobians(x, solid.prisms)).min() > 0


def test_a_degenerate_prism_is_refused():
    model = block()
    x = model["point/position"].copy()
    x[model["prism/points"][5, 3]] = x[model["prism/points"][5, 0]] - [0, 0, 0.5]
    with pytest.raises(ValueError, match="det"):
        with_material(model | {"point/position": x}, YOUNG, POISSON)
