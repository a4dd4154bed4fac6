"""The rest position is a minimum of the model as docs/theory/model.md writes it: numpy computes the same
objective and gradient, and scipy's minimizer, started elsewhere, comes back to it."""

import numpy as np
import pytest
from scipy.optimize import minimize

from conftest import PROJECT
from tissue import Tissue, last, model_of

LOADS = """
gravity: [0, 0, -9.80665]
forces:
  - {at: [0, -90, 0], radius: 30, force: [0, 0, -0.5]}
"""
# Laws and references of all kinds, a skin under tension, weight and a force.
SPRINGS = """  turgor: 0.02
  mass: [0.05, 0.05, 0.05, 0.05]
  springs:
    default: {modulus: 0.3, law: quadratic, reference: initial}
    "layer 0": {stiffness: 2.0, law: linear}
    diagonal: {stiffness: 0.5, law: quartic, reference: 2.0}
"""


def loaded_scene(file):
    """The jaw advance with much that a scene can say of the tissue."""
    text = (PROJECT / "meshes/paper_jaw_advance.yaml").read_text()
    text = text.replace(": paper_", f": {PROJECT}/meshes/paper_")
    begin, end = text.index("  springs:"), text.index("moves:")
    file.write_text(text[:begin] + SPRINGS + text[end:] + LOADS)
    return file


CASES = {
    "advance": ("paper_jaw_advance.yaml", "penalty", ["-accuracy", 1e-8]),
    "opening": ("paper_jaw_opening.yaml", "penalty", ["-accuracy", 1e-8]),
    "loaded": (loaded_scene, "penalty", ["-accuracy", 1e-8]),
    "paper": (loaded_scene, "paper", ["-accuracy", 1e-8, "-volume", "paper", "-lambda", 0.95]),
    "springs": ("paper_jaw_advance.yaml", "none", ["-accuracy", 1e-8, "-volume", "none"]),
}


@pytest.fixture(params=[pytest.param(case, marks=[pytest.mark.long] if case in ("advance", "opening", "paper") else [])
                        for case in CASES], scope="module")
def found(request, solved, tmp_path_factory):
    """The model in numpy, and the last step of the result."""
    scene, volume, options = CASES[request.param]
    if callable(scene):
        scene = scene(tmp_path_factory.mktemp("scene") / "scene.yaml")
    file = solved(scene, *options)
    step = last(file)
    weight = step["lambda"] if volume == "paper" else step["bulk_modulus"]
    assert step["volume"].decode() == volume
    return Tissue(model_of(file), volume, weight), step


@pytest.mark.quick
def test_numpy_gradient_is_the_derivative(found):
    tissue, step = found
    random = np.random.default_rng(3)
    x = step["point/position"] + random.normal(0, 0.3, step["point/position"].shape)
    way = random.normal(0, 1, x.shape) * tissue.soft[:, None]
    slope = (tissue.value_and_gradient(x)[1] * way).sum()
    h = 1e-4
    there, back = (tissue.value_and_gradient(x + sign * h * way)[0] for sign in (1, -1))
    assert (there - back) / (2 * h) == pytest.approx(slope, rel=1e-6)


@pytest.mark.quick
def test_numbers_of_the_result(found):
    tissue, step = found
    value, gradient = tissue.value_and_gradient(step["point/position"])
    _, tension, _ = tissue.springs(step["point/position"])
    assert value == pytest.approx(step["objective"], rel=1e-12)
    assert np.abs(tension - step["spring/tension"]).max() <= 1e-11 * np.abs(tension).max()
    largest = np.linalg.norm(gradient, axis=1).max()
    assert abs(largest - step["gradient_max"]) <= 1e-9 * np.abs(tension).max()
    assert largest <= 1e-6 * np.abs(tension).max()


def test_an_independent_minimizer_comes_back(found):
    tissue, step = found
    rest = step["point/position"]
    soft = tissue.soft

    def objective(unknowns):
        x = rest.copy()
        x[soft] = unknowns.reshape(-1, 3)
        value, gradient = tissue.value_and_gradient(x)
        return value, gradient[soft].ravel()

    start = rest[soft] + np.random.default_rng(4).uniform(-0.3, 0.3, rest[soft].shape)
    assert objective(start.ravel())[0] > step["objective"]
    end = minimize(objective, start.ravel(), jac=True, method="L-BFGS-B",
                   options={"maxiter": 20000, "maxfun": 20000, "maxcor": 30, "ftol": 0, "gtol": 1e-4})
    assert end.fun >= step["objective"] * (1 - 1e-12)
    distance = np.linalg.norm(end.x.reshape(-1, 3) - rest[soft], axis=1).max()
    assert distance < 1e-3, (distance, end.nit, end.message)
