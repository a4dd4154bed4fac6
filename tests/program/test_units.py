"""The answer does not depend on the unit of length or on where the axes lie."""

import sys

import meshio
import numpy as np
import pytest

from conftest import PROJECT
from tissue import last, write_model

sys.path.append(str(PROJECT / "tests/extremes"))
from bodies import block, of_solid, of_springs  # noqa: E402

pytestmark = pytest.mark.quick

YOUNG = 0.03  # N/mm²
VECTORS = ("point/position", "point/target")
POWERS = {
    "point/position": 1,
    "point/target": 1,
    "spring/rest_length": 1,
    "spring/reference": 1,
    "spring/stiffness": -1,
    "prism/rest_volume": 3,
}


def body(tissue):
    slab = block()
    return of_solid(*slab, YOUNG) if tissue == "solid" else of_springs(*slab)


def in_unit(tissue, factor):
    """The model with lengths in another unit and forces in N: a length is `factor` times as
    many."""
    if tissue == "springs":
        model = body(tissue)
        return model | {name: model[name] * factor ** POWERS[name] for name in POWERS}
    model, prisms = block()
    model |= {name: model[name] * factor for name in VECTORS}
    return of_solid(model, prisms, YOUNG / factor**2)


def rest(run, folder, name, model, factor=1.0):
    """Returns the rest position, to 1e-9 mm, and the objective."""
    write_model(folder / f"{name}.h5", model)
    volume = ("-volume", "none") if "spring/points" in model else ()
    result = run(
        "repose-solve",
        f"{name}.h5",
        *volume,
        "-accuracy",
        1e-9 * factor,
        "-load_steps",
        1,
        "-output",
        f"{name}_out",
    )
    assert (result.returncode, result.stderr) == (0, ""), result
    step = last(folder / f"{name}_out.h5")
    return step["point/position"], step["objective"]


@pytest.mark.parametrize("tissue", ["springs", "solid"])
@pytest.mark.parametrize("unit, factor", [("m", 1e-3), ("µm", 1e3)])
def test_a_scene_is_the_same_in_every_unit(run, tmp_path, tissue, unit, factor):
    position, energy = rest(run, tmp_path, "mm", in_unit(tissue, 1.0))
    other, other_energy = rest(run, tmp_path, unit, in_unit(tissue, factor), factor)
    assert np.abs(other / factor - position).max() < 1e-9 * np.ptp(position)
    assert other_energy / factor == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("tissue", ["springs", "solid"])
def test_a_scene_turned_and_moved_is_turned_and_moved(run, tmp_path, tissue):
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = np.array([200.0, -300.0, 400.0])
    model = body(tissue)
    position, energy = rest(run, tmp_path, "here", model)
    there, energy_there = rest(
        run, tmp_path, "there", model | {name: model[name] @ turn.T + shift for name in VECTORS}
    )
    assert np.abs(there - (position @ turn.T + shift)).max() < 5e-9
    assert energy_there == pytest.approx(energy, rel=1e-9)


CHEEK = {"center": np.array([-63.0, -98.0, -10.0]), "push": np.array([9.0, 12.0, 0.0])}


def pressed_cheek(run, folder, name, turn, shift):
    """The paper's head, turned and moved, with a ball that slides on its cheek: the step at rest."""
    for part in ("skin", "skull", "mandible"):
        mesh = meshio.read(PROJECT / f"meshes/paper_{part}.ply")
        points = mesh.points.astype(float) @ turn.T + shift
        meshio.Mesh(points, mesh.cells).write(folder / f"{name}_{part}.ply")
    center, push = (list(map(float, v)) for v in (turn @ CHEEK["center"] + shift, turn @ CHEEK["push"]))
    (folder / f"{name}.yaml").write_text(f"""skin: {name}_skin.ply
bones:
  - {{name: skull, file: {name}_skull.ply}}
  - {{name: mandible, file: {name}_mandible.ply}}
tissue:
  layers: 4
  material: {{preset: face}}
contact: {{bones: off}}
instruments:
  - {{sphere: {{center: {center}, radius: 20}}, push: {push}, skin: slide}}
""")
    result = run("repose-solve", f"{name}.yaml", "-accuracy", 1e-5)
    assert (result.returncode, result.stderr) == (0, ""), result
    return last(folder / f"{name}.h5")


def test_a_scene_of_contact_turned_and_moved_is_turned_and_moved(run, tmp_path):
    """A ball's distance is exact; grids of meshes lie along the axes, and are left out."""
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = np.array([200.0, -300.0, 400.0])
    here = pressed_cheek(run, tmp_path, "here", np.eye(3), np.zeros(3))
    there = pressed_cheek(run, tmp_path, "there", turn, shift)
    assert (here["point/contact_pressure"] > 0).sum() >= 5
    moved = here["point/position"] @ turn.T + shift
    assert np.linalg.norm(there["point/position"] - moved, axis=1).max() <= 2e-5
    assert there["point/contact_force"] == pytest.approx(here["point/contact_force"] @ turn.T,
                                                         abs=1e-5)
