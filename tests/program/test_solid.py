"""The solid of the programs against the one in continuum.py, on the head of the paper's size."""

import numpy as np
import pytest

from conftest import PROJECT, runner
from continuum import (Solid, edges_of, moduli, rest_position, volumes, wedge_laplacians,
                       with_material)
from tissue import last, model_of, write_model

MESHES = PROJECT / "meshes"
MATERIALS = {"plain": (0.015, 0.45, ""), "incompressible": (0.015, 0.49, ""),
             "averaged": (0.015, 0.49, ", dilatation: nodal"),
             "skin": (0.015, 0.45, ", skin: {thickness: 1.5, young: 0.08}")}
JAW_OPENS = """
moves:
  - {bone: mandible, rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: 8}}
"""
HANGING = "  turgor: 0.05\n  density: 1.0e-6\n"
LYING, UPRIGHT = [0, 9.80665, 0], [0, 0, -9.80665]  # N/kg


def tissue_of(material):
    """The text of a scene of this material without moves."""
    young, poisson, skin = MATERIALS[material]
    return f"""
skin: {MESHES}/paper_skin.ply
contact: {{bones: off, cuts: off}}
bones:
  - {{name: skull, file: {MESHES}/paper_skull.ply}}
  - {{name: mandible, file: {MESHES}/paper_mandible.ply}}
tissue:
  layers: 4
  release: 0
  material: {{law: neo_hookean, young: {young}, poisson: {poisson}{skin}}}
"""


@pytest.fixture(params=MATERIALS, scope="module")
def face(request, tmp_path_factory, environment):
    """A result to 1e-6 mm and its material."""
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "scene.yaml").write_text(tissue_of(request.param) + JAW_OPENS)
    result = runner(folder, environment)(
        "repose-solve", "scene.yaml", "-accuracy", 1e-6, "-output", "face")
    assert (result.returncode, result.stderr) == (0, ""), result
    return folder / "face.h5", request.param


def sorted_edges(model):
    """Edges by their points, the lower first, and their weights."""
    ends = np.sort(model["edge/points"], axis=1)
    order = np.lexsort(ends.T[::-1])
    return ends[order], model["edge/weight"][order]


@pytest.mark.quick
def test_edges_are_the_integrals(face):
    model = model_of(face[0])
    x, prisms = model["point/position"], model["prism/points"]
    edges, weights = edges_of(wedge_laplacians(x, prisms), prisms, model["prism/shear_modulus"])
    mine, found = sorted_edges(model)
    assert np.array_equal(mine, edges)
    assert abs(found - weights).max() < 1e-12 * abs(weights).max()


@pytest.mark.quick
def test_moduli_are_the_scenes(face):
    file, name = face
    model = model_of(file)
    mu, kappa, t = (model[f"prism/{key}"] for key in ("shear_modulus", "modulus", "target_volume"))
    deep = moduli(*MATERIALS[name][:2])
    lowest = model["point/layer"][model["prism/points"]].max(1) == model["point/layer"].max()
    assert np.stack([mu, kappa])[:, lowest] == pytest.approx(
        np.repeat(np.array(deep)[:, None], lowest.sum(), 1), rel=1e-12)
    if name == "skin":
        assert mu.max() > 1.5 * deep[0]
    else:
        assert np.ptp(mu) == np.ptp(kappa) == 0
    volume = volumes(model["point/position"], model["prism/points"])[0]
    assert t == pytest.approx(volume * (1 + mu / kappa), rel=1e-12)


def test_rest_position_is_the_references(face):
    model, step = model_of(face[0]), last(face[0])
    solid = Solid(model)
    x = rest_position(solid)
    assert np.linalg.norm(step["point/position"] - x, axis=1).max() < 2e-6
    assert step["objective"] == pytest.approx(solid.value(x), rel=1e-9)


@pytest.mark.quick
def test_residual_force_is_the_energys_slope(face):
    model, step = model_of(face[0]), last(face[0])
    force = -Solid(model).value_and_gradient(step["point/position"])[1]
    force[model["point/set"] != 0] = 0
    assert abs(step["point/residual_force"] - force).max() < 1e-12
    assert step["gradient_max"] == pytest.approx(np.linalg.norm(force, axis=1).max(), rel=1e-3)


@pytest.mark.quick
def test_a_face_at_rest_lying_hangs_upright_as_the_references(run, tmp_path):
    """Skin tension and weight are in balance as recorded, by the edges' weights and the prisms'
    targets in the file; then the weight turns."""
    text = tissue_of("skin") + HANGING + f"scan_gravity: {LYING}\ngravity: {UPRIGHT}\n"
    (tmp_path / "face.yaml").write_text(text)
    result = run("repose-solve", "face.yaml", "-accuracy", 1e-6)
    assert (result.returncode, result.stderr) == (0, ""), result
    model, step = model_of(tmp_path / "face.h5"), last(tmp_path / "face.h5")
    solid = Solid(model)
    lying, upright = (np.outer(model["point/mass"], field) for field in (LYING, UPRIGHT))
    left = (solid.value_and_gradient(solid.rest)[1] - lying)[solid.soft]
    assert abs(left).max() < 1e-10 * abs(upright[solid.soft]).max()
    x = rest_position(solid, force=upright, loads=1)
    assert np.linalg.norm(x - solid.rest, axis=1).max() > 0.1
    assert np.linalg.norm(step["point/position"] - x, axis=1).max() < 2e-6


def test_a_model_of_the_references_making_is_solved(face, run, tmp_path):
    file, _ = face
    model = model_of(file)
    made = with_material({key: value for key, value in model.items() if not key.startswith("edge")},
                         *elasticity(model["prism/shear_modulus"], model["prism/modulus"]))
    write_model(tmp_path / "made.h5", made)
    result = run("repose-solve", "made.h5", "-accuracy", 1e-6, "-output", "again")
    assert (result.returncode, result.stderr) == (0, ""), result
    apart = last(tmp_path / "again.h5")["point/position"] - last(file)["point/position"]
    assert np.linalg.norm(apart, axis=1).max() < 2e-6


def elasticity(mu, kappa):
    """Young's modulus (N/mm²) and Poisson's ratio of these moduli."""
    poisson = (kappa - mu) / (2 * kappa)
    return 2 * mu * (1 + poisson), poisson
