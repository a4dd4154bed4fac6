"""The initial equilibrium: nothing moves under the gravity of the recording, another gravity moves the
face, a scene that asks for the impossible is refused."""

import re

import numpy as np
import pytest

from conftest import PROJECT
from tissue import last, model_of, skin, steps

LYING, UPRIGHT, BOWED = [0, 9.80665, 0], [0, 0, -9.80665], [0, -9.80665, 0]  # N/kg, in LPS axes
LIPS = "{path: [[-20, -92, -35], [0, -98, -35], [20, -92, -35]], layers: 2}"
LOOSE = ("stiffness: 1.0, law: quartic, reference: 1.0", "modulus: 0.01, law: quartic")


@pytest.fixture(scope="module")
def posture(tmp_path_factory):
    """posture(gravity, springs=…) → a scene recorded lying, with turgor, weight and no move."""
    folder = tmp_path_factory.mktemp("posture")

    def write(gravity, turgor=0.1, density=1e-6, name="posture"):
        text = (PROJECT / "meshes/paper_jaw_advance.yaml").read_text().replace(*LOOSE)
        text = text.replace(": paper_", f": {PROJECT}/meshes/paper_")
        text = text.replace("  layers: 4 ", f"  turgor: {turgor}\n  density: {density}\n  layers: 4 ")
        text = text[:text.index("moves:")] + text[text.index("solve:"):]
        text += f"gravity: {gravity}\nscan_gravity: {LYING}\n"
        file = folder / f"{name}_{abs(hash((tuple(gravity), turgor, density)))}.yaml"
        file.write_text(text)
        return file

    return write


def as_solid(text, preset):
    """A scene of posture(…) with a solid in place of its springs."""
    text = re.sub(r"  springs:.*?\n(?=\S)", f"  material: {{preset: {preset}}}\n", text, flags=re.S)
    return text[:text.index("solve:")] + text[text.index("gravity:"):]


@pytest.mark.quick
@pytest.mark.parametrize("ranks", [1, 3])
def test_nothing_moves_under_the_gravity_of_the_recording(solved, posture, ranks):
    file = solved(posture(LYING), "-stability", ranks=ranks)
    assert np.abs(last(file)["point/displacement"]).max() < 1e-9
    assert all(step["smallest_eigenvalue"] > 0 for step in steps(file))
    pull = np.linalg.norm(last(file)["point/residual_force"], axis=1)
    assert pull.max() < 1e-12 * np.abs(last(file)["spring/tension"]).max()


@pytest.mark.parametrize("tissue", ["springs", "solid"])
@pytest.mark.parametrize("ranks", [1, 3])
def test_lips_stay_closed_where_an_incision_opens(solved, posture, ranks, tissue):
    """Lips are parted before the equilibrium; a cut along the same path is made after it."""
    text = posture(LYING, turgor=0.05, name="lips").read_text()
    if tissue == "solid":
        text = as_solid(text, "skin_on_fat")
    moved = []
    for cut in (f"mouth: {LIPS.replace(', layers: 2', '')}\n", f"incisions: [{LIPS}]\n"):
        scene = posture(LYING, turgor=0.05, name=f"{cut[:5]}_{tissue}_{ranks}")
        scene.write_text(text + cut)
        file = solved(scene, "-accuracy", 0.01, ranks=ranks)
        model = model_of(file)
        layers, columns = (model[f"point/{key}"].max() + 1 for key in ("layer", "column"))
        assert len(model["point/layer"]) > layers * columns, "nothing was cut"
        moved.append(np.abs(last(file)["point/displacement"]).max())
    assert moved[0] < 1e-9 and moved[1] > 0.1, moved


def test_another_posture_moves_the_face_with_gravity(solved, posture):
    upright, bowed = (skin(solved(posture(g), "-stability"))[1] for g in (UPRIGHT, BOWED))
    assert np.linalg.norm(upright, axis=1).max() > 0.5
    assert upright[:, 2].mean() < -0.1 and abs(upright[:, 2].mean()) > abs(upright[:, 0].mean())
    assert bowed[:, 1].mean() < -0.1 and bowed[:, 1].mean() < upright[:, 1].mean()
    for gravity in (UPRIGHT, BOWED):
        assert last(solved(posture(gravity), "-stability"))["smallest_eigenvalue"] > 0


def test_rest_lengths_do_not_depend_on_the_posture_after(solved, posture):
    one, other = (model_of(solved(posture(g), "-stability")) for g in (UPRIGHT, BOWED))
    assert np.array_equal(one["spring/rest_length"], other["spring/rest_length"])
    assert not np.array_equal(one["gravity"], other["gravity"])


@pytest.mark.parametrize("tissue", ["springs", "material"])
def test_tissue_that_slides_on_bone_begins_in_equilibrium(solved, posture, tissue):
    scene = posture(LYING, turgor=0.01 if tissue == "springs" else 0, name=f"sliding_{tissue}")
    text = scene.read_text()
    if tissue == "material":
        text = as_solid(text, "face")
    scene.write_text(text + "teeth:\n  - {sphere: {center: [0, -90, -30], radius: 40}}\n")
    file = solved(scene)
    model, step = model_of(file), last(file)
    assert (model["contact/binding"] == 1).any()
    assert np.abs(step["point/displacement"]).max() < 1e-6
    assert step["gradient_max"] < 1e-9 * np.linalg.norm(
        model["point/mass"][:, None] * LYING, axis=1).max()


@pytest.mark.parametrize("ranks", [1, 3])
@pytest.mark.parametrize("turgor, density", [(1.0, 1e-6), (0.0, 1e-1)], ids=["turgor", "weight"])
def test_impossible_equilibria_are_refused_with_spring_and_place(run, posture, tmp_path, ranks,
                                                                  turgor, density):
    result = run("repose-solve", posture(LYING, turgor, density), ranks=ranks)
    assert result.returncode == 1, result.stdout
    assert len(result.stderr.splitlines()) == 1
    for words in ("negative rest lengths", "is spring ", "near (", "lower tissue.turgor"):
        assert words in result.stderr
    assert not list(tmp_path.glob("*.h5*"))


def test_gravity_of_the_recording_needs_gravity(run, posture):
    scene = posture(LYING, name="lonely")
    scene.write_text(scene.read_text().replace(f"\ngravity: {LYING}", ""))
    result = run("repose-solve", scene)
    assert result.returncode == 1 and len(result.stderr.splitlines()) == 1
    assert "scan_gravity" in result.stderr and "needs gravity" in result.stderr
