"""Bad input of repose-solve: exit status 1, one line on stderr that says what is wrong, no file
written, no hang, alone and on three ranks."""

import shutil

import h5py
import meshio
import numpy as np
import pytest

from conftest import PROJECT, expect_refusal, some_on_ranks

SCENE = """skin: paper_skin.ply
bones:
  - {name: skull, file: paper_skull.ply}
  - {name: mandible, file: paper_mandible.ply}
tissue:
  layers: 2
  mass: [0.1, 0.1]
moves:
  - {bone: mandible, rotate: {axis: [1, 0, 0], center: [0, 10, 20], angle: 3}}
forces:
  - {at: [0, -90, 0], radius: 30, force: [0, 0, -0.1]}
solve:
  accuracy: 0.1
"""


class Input:
    """A folder with the paper-sized head, a scene and a small model file, to be spoiled."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir()
        for part in ("skin", "skull", "mandible"):
            shutil.copy(PROJECT / "meshes" / f"paper_{part}.ply", folder)
        (folder / "scene.yaml").write_text(SCENE)

    def scene(self, old="", new=""):
        """The scene with a text exchanged."""
        assert old in SCENE
        (self.folder / "scene.yaml").write_text(SCENE.replace(old, new, 1))
        return ["scene.yaml"]

    def text(self, name, content):
        """The scene after a file of the folder was given another content."""
        (self.folder / name).write_bytes(content)
        return [name if name.endswith((".yaml", ".h5")) else "scene.yaml"]

    def head_of(self, name, share):
        """The scene after a file of the folder was cut off."""
        content = (self.folder / name).read_bytes()
        return self.text(name, content[:int(share * len(content))])

    def moved(self, name, change):
        """The scene after the points of a mesh were changed."""
        mesh = meshio.read(self.folder / name)
        points = mesh.points.astype(float)
        change(points)
        meshio.Mesh(points, mesh.cells).write(self.folder / name, binary=False)
        return ["scene.yaml"]

    def meters(self):
        for part in ("skin", "skull", "mandible"):
            self.moved(f"paper_{part}.ply", lambda points: points.__imul__(1e-3))
        return ["scene.yaml"]

    def option(self, *options):
        return ["scene.yaml", *options]

    def model(self, spoil=lambda file: None):
        """A model file of one prism on a bone, spoiled."""
        with h5py.File(self.folder / "model.h5", "w") as file:
            write_model(file)
            spoil(file)
        return ["model.h5"]

    def cut_model(self):
        self.model()
        return self.head_of("model.h5", 0.5)


def write_model(file):
    """One triangle in two layers: three soft-tissue points over three bone points that move."""
    file.attrs["format"], file.attrs["version"] = np.bytes_("tissue-model"), 1
    model = file.create_group("model")
    model.attrs["gravity"] = np.zeros(3)
    corners = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0]], float)
    position = np.concatenate([corners + [0, 0, 5], corners])
    bone = np.array([0, 0, 0, 1, 1, 1])
    pairs = [(a, b) for a in range(6) for b in range(a + 1, 6)]
    length = [np.linalg.norm(position[a] - position[b]) for a, b in pairs]
    rows = len(pairs)
    content = {
        "point/position": position, "point/set": (2 * bone).astype(np.int8),
        "point/target": position + bone[:, None] * [0, 0, 1.0],
        "point/layer": bone.astype(np.int32), "point/column": np.arange(6) % 3,
        "point/bone": (bone - 1).astype(np.int32), "point/mass": np.zeros(6),
        "point/external_force": np.zeros((6, 3)),
        "spring/points": np.array(pairs), "spring/set": np.zeros(rows, np.int32),
        "spring/rest_length": np.array(length), "spring/stiffness": np.ones(rows),
        "spring/exponent": np.full(rows, 2, np.int8), "spring/reference": np.ones(rows),
        "prism/points": np.array([[3, 4, 5, 0, 1, 2]]), "prism/rest_volume": np.array([250.0]),
        "spring_set": np.array([b"all"]), "bone": np.array([b"jaw"]),
    }
    for name, value in content.items():
        model[name] = value


def put(name, value):
    """Spoils a model file: another dataset in the place of one."""

    def spoil(file):
        del file[f"model/{name}"]
        file[f"model/{name}"] = value

    return spoil


def first(name, value):
    """Spoils a model file: another first number in a dataset."""

    def spoil(file):
        file[f"model/{name}"][(0,) * file[f"model/{name}"].ndim] = value

    return spoil


def version(file):
    file.attrs["version"] = 99


# What is done to the input, and words that the message must hold.
CASES = {
    "no input": (
        lambda i: [], ["INPUT"]),
    "missing input": (
        lambda i: ["nowhere.yaml"], ["nowhere.yaml"]),
    "a folder as input": (
        lambda i: ["."], ["."]),
    "empty scene": (
        lambda i: i.text("scene.yaml", b""), ["scene.yaml"]),
    "binary scene": (
        lambda i: i.text("scene.yaml", bytes(range(256)) * 8), ["scene.yaml"]),
    "not YAML": (
        lambda i: i.scene("skin: paper_skin.ply", "skin: [paper_skin.ply"), ["scene.yaml:"]),
    "a list as scene": (
        lambda i: i.text("scene.yaml", b"- skin\n"), ["scene.yaml:1"]),
    "unknown key": (
        lambda i: i.scene("layers:", "layrs:"), ["scene.yaml:6:3", "layrs", "layers"]),
    "unknown top key": (
        lambda i: i.scene("moves:", "movs:"), ["scene.yaml:8:1", "movs", "moves"]),
    "missing key": (
        lambda i: i.scene("skin: paper_skin.ply\n"), ["scene.yaml", "skin"]),
    "key given twice": (
        lambda i: i.scene("solve:", "solve: {}\nsolve:"), ["scene.yaml:13", "solve"]),
    "value below range": (
        lambda i: i.scene("layers: 2", "layers: 1"), ["scene.yaml:6:", "layers", "2", "64"]),
    "huge value": (
        lambda i: i.scene("layers: 2", "layers: 9999999999999999"), ["scene.yaml:6:", "layers"]),
    "not a number": (
        lambda i: i.scene("layers: 2", "layers: many"), ["scene.yaml:6:", "many"]),
    "NaN in the scene": (
        lambda i: i.scene("accuracy: 0.1", "accuracy: .nan"), ["scene.yaml:13:", "accuracy"]),
    "a list too short": (
        lambda i: i.scene("[0.1, 0.1]", "[0.1]"), ["scene.yaml:7:", "mass"]),
    "unknown bone": (
        lambda i: i.scene("bone: mandible", "bone: mandibel"),
        ["scene.yaml:9:", "mandibel", "mandible"]),
    "axis of no length": (
        lambda i: i.scene("axis: [1,", "axis: [0,"), ["scene.yaml:9:", "axis"]),
    "curve without a radius": (
        lambda i: i.scene("  mass:", "  unattached: [{curve: [[0, -80, 0], [0, -80, 30]]}]\n  mass:"),
        ["scene.yaml:7:", "radius"]),
    "ball of negative radius": (
        lambda i: i.scene("forces:", "instruments: [{push: [0, 1, 0], sphere: "
                          "{center: [0, -120, 0], radius: -5}}]\nforces:"), ["radius", "-5"]),
    "box of negative size": (
        lambda i: i.scene("forces:", "instruments: [{push: [0, 1, 0], box: "
                          "{center: [0, -120, 0], size: [5, -5, 5]}}]\nforces:"), ["box.size"]),
    "half-space without a normal": (
        lambda i: i.scene("forces:", "instruments: [{push: [0, 1, 0], half_space: "
                          "{point: [0, -120, 0]}}]\nforces:"), ["normal"]),
    "volume term of springs for a solid": (
        lambda i: i.scene("  accuracy: 0.1", "  volume: {form: penalty}"),
        ["scene.yaml: solve.volume", "tissue.springs"]),
    "bulk modulus of springs for a solid": (
        lambda i: i.option("-bulk_modulus", "1000"), ["-bulk_modulus is of springs", "solid"]),
    "weight of springs' volume for a solid": (
        lambda i: i.option("-lambda", "0.3"), ["-lambda is of springs", "solid"]),
    "weight of the paper's volume for a penalty": (
        lambda i: [str(PROJECT / "meshes/paper_jaw_advance.yaml"), "-lambda", "0.3"],
        ["-lambda is of volume form paper, and the form is penalty", "-volume paper"]),
    "bulk modulus without a penalty": (
        lambda i: [str(PROJECT / "meshes/paper_jaw_advance.yaml"), "-volume", "none", "-bulk_modulus", "1"],
        ["-bulk_modulus is of volume form penalty, and the form is none", "-volume penalty"]),
    "force functional of a solid": (
        lambda i: i.scene("  accuracy: 0.1", "  functional: force"), ["scene.yaml", "force"]),
    "law that is not modeled": (
        lambda i: i.scene("  mass:", "  material: {law: ogden}\n  mass:"),
        ["scene.yaml:7:", "ogden", "neo_hookean"]),
    "move that is too far": (
        lambda i: i.scene("center: [0, 10, 20]", "center: [0, 1e300, 20]"),
        ["scene.yaml:9:", "center", "1e300"]),
    "force that is too large": (
        lambda i: i.scene("[0, 0, -0.1]", "[0, 0, -1e300]"), ["scene.yaml:11:", "1e300"]),
    "force beside the skin": (
        lambda i: i.scene("[0, -90, 0]", "[0, -9000, 0]"), ["scene.yaml", "forces[0]", "skin"]),
    "missing mesh": (
        lambda i: i.scene("paper_skin", "no_skin"), ["scene.yaml:1:", "no_skin.ply"]),
    "mesh of text": (
        lambda i: i.text("paper_skin.ply", b"this is no mesh\n" * 9), ["paper_skin.ply"]),
    "empty mesh": (
        lambda i: i.text("paper_skin.ply", b""), ["paper_skin.ply"]),
    "mesh cut off": (
        lambda i: i.head_of("paper_skin.ply", 0.5), ["paper_skin.ply"]),
    "NaN in a mesh": (
        lambda i: i.moved("paper_skin.ply", lambda p: p.__setitem__((7, 1), np.nan)),
        ["paper_skin.ply", "7"]),
    "meshes in meters": (
        lambda i: i.meters(), ["paper_skin.ply", "mm"]),
    "bone that misses the skin": (
        lambda i: i.moved("paper_mandible.ply", lambda p: p.__iadd__(1e3)), ["mandible"]),
    "unknown option": (
        lambda i: i.option("-acuracy", "0.1"), ["-acuracy", "-accuracy"]),
    "option below range": (
        lambda i: i.option("-accuracy", "-1"), ["-accuracy", "-1"]),
    "option above range": (
        lambda i: i.option("-volume", "paper", "-lambda", "1.5"), ["-lambda", "1.5"]),
    "option not a number": (
        lambda i: i.option("-accuracy", "fine"), ["-accuracy", "fine"]),
    "option of unknown choice": (
        lambda i: i.option("-volume", "penalti"), ["-volume", "penalti", "penalty"]),
    "PETSc's option of unknown choice": (
        lambda i: i.option("-tao_type", "fast"), ["-tao_type fast", "must be one of"]),
    "PETSc's option not a number": (
        lambda i: i.option("-tao_max_it", "many"), ["-tao_max_it many", "must be a whole number"]),
    "initial Hessian of unknown name": (
        lambda i: i.option("-tao_type", "lmvm", "-tao_lmvm_initial", "stif"), ["stif", "stiffness"]),
    "force with a penalty": (
        lambda i: [*i.scene("  mass:", "  springs: {default: {modulus: 0.05}}\n  mass:"),
                   "-functional", "force", "-volume", "penalty"], ["force", "penalty"]),
    "force of a solid": (
        lambda i: i.option("-functional", "force"), ["force", "tissue.springs"]),
    "two inputs": (
        lambda i: i.option("scene.yaml"), ["scene.yaml"]),
    "missing output folder": (
        lambda i: i.option("-output", "no/such/folder/x"), ["no/such/folder"]),
    "unwritable output folder": (
        lambda i: i.option("-output", "/proc/x"), ["/proc"]),
    "output below a file": (
        lambda i: i.option("-output", "scene.yaml/x"), ["scene.yaml"]),
    "empty model": (
        lambda i: i.text("model.h5", b""), ["model.h5"]),
    "model of garbage": (
        lambda i: i.text("model.h5", b"\x89HDF\r\n\x1a\n" + bytes(range(256)) * 8), ["model.h5"]),
    "model cut off": (
        lambda i: i.cut_model(), ["model.h5"]),
    "model of another version": (
        lambda i: i.model(version), ["model.h5", "version", "99"]),
    "model without stiffness": (
        lambda i: i.model(lambda f: f.__delitem__("model/spring/stiffness")), ["spring/stiffness"]),
    "model with floats for indices": (
        lambda i: i.model(put("spring/points", np.ones((15, 2)))), ["spring/points"]),
    "misshapen model": (
        lambda i: i.model(put("spring/stiffness", np.ones(14))), ["spring/stiffness"]),
    "model index out of range": (
        lambda i: i.model(first("spring/points", 6)), ["spring/points", "6"]),
    "model with NaN": (
        lambda i: i.model(first("point/position", np.nan)), ["point/position"]),
    "negative stiffness": (
        lambda i: i.model(first("spring/stiffness", -1.0)), ["spring/stiffness", "-1"]),
    "unknown exponent": (
        lambda i: i.model(first("spring/exponent", 3)), ["spring/exponent", "3"]),
}


@pytest.fixture
def given(tmp_path):
    return Input(tmp_path / "input")


@pytest.mark.parametrize("case, ranks", some_on_ranks(CASES, 3))
def test_bad_input_is_refused(run, given, case, ranks):
    spoil, words = CASES[case]
    arguments = spoil(given)
    expect_refusal(run, given.folder, words, "repose-solve", *arguments, ranks=ranks, cwd=given.folder)


@pytest.mark.quick
@pytest.mark.parametrize("ranks", [1, 3])
@pytest.mark.parametrize("name", ["scene.yaml", "model.h5"])
def test_the_unspoiled_input_is_taken(run, given, name, ranks):
    given.model()
    result = run("repose-solve", name, "-dry_run", ranks=ranks, cwd=given.folder)
    assert (result.returncode, result.stderr) == (0, "")
