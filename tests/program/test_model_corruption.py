"""A model file with any one of its arrays spoiled: refused in one line that names the file and an
array, or solved where the other value is allowed; never a crash, a hang or an internal error."""

import concurrent.futures
import shutil

import h5py
import numpy as np
import pytest

from conftest import RUNS_ALL
from test_bad_input import write_model

TETRAHEDRON = np.array([[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
WORKERS = 2


def springs(file):
    """A prism of springs with all that /model may hold, obstacles of every kind among it."""
    write_model(file)
    model = file["model"]
    model["skin/points"] = np.array([[0, 1, 2]])
    model["bone_surface/0/points"] = TETRAHEDRON - [0, 0, 40]
    model["bone_surface/0/triangles"] = FACES
    model["bone_transform"] = np.eye(4)[None]
    model["bone_transform"][0, 2, 3] = 1.0
    contact = model.create_group("contact")
    contact.attrs["stiffness"], contact.attrs["grid"] = 0.1, 1.0
    kinds = np.array([1, 2, 3, 5, 4, 0])  # a sphere, capsule, box, mesh, half-space and bone
    shape = np.zeros((6, 7))
    shape[0, 2:4] = 200, 5
    shape[1] = 0, 0, 200, 9, 0, 200, 5
    shape[2, 2:6] = 200, 5, 5, 5
    shape[4, 2:6] = 300, 0, 0, -1
    contact["body"] = np.array([b"ball", b"rod", b"box", b"mesh", b"wall", b"jaw"])
    contact["body_bone"] = np.where(kinds == 0, 0, -1).astype(np.int32)
    contact["body_kind"] = kinds.astype(np.int8)
    contact["body_push"] = np.zeros((6, 3))
    contact["body_shape"] = shape
    contact["body_mesh/3/points"] = TETRAHEDRON + [0, 0, 200]
    contact["body_mesh/3/triangles"] = FACES
    contact["point"] = np.zeros(6, np.int64)
    contact["body_row"] = np.arange(6, dtype=np.int32)
    contact["binding"] = np.zeros(6, np.int8)
    contact["area"] = np.ones(6)
    contact["wall/net"] = np.array([[2, 2]])  # each control at one point
    contact["wall/begin"] = np.arange(9)
    contact["wall/point"] = np.array([0, 1, 3, 4, 0, 2, 3, 5])
    contact["wall/weight"], contact["wall/area"] = np.ones(8), np.zeros(4)
    adhesion = model.create_group("adhesion")
    adhesion.attrs["tension"], adhesion.attrs["range"] = 5e-4, 2.0
    adhesion["bone"], adhesion["upper"] = np.zeros(1, np.int32), np.ones(1, np.int8)
    adhesion["box"], adhesion["reach"] = np.array([[0, 0, 0, 9, 9, 9.0]]), np.ones(1)
    adhesion["axes"] = np.eye(3)
    adhesion["lip_line"], adhesion["cut_column"] = np.eye(3), np.array([1, 2])


def solid(file):
    """The prism as a solid."""
    write_model(file)
    model = file["model"]
    del model["spring"], model["spring_set"]
    model["prism/shear_modulus"], model["prism/modulus"] = np.array([0.01]), np.array([0.1])
    model["prism/target_volume"] = np.array([250.0])
    model["prism/nodal_modulus"] = np.array([0.05])
    pairs = [(a, b) for a in range(6) for b in range(a + 1, 6)]
    model["edge/points"], model["edge/weight"] = np.array(pairs), np.full(15, 0.01)


MODELS = {"springs": springs, "solid": solid}
SOLID_ALONE = ("prism/", "edge/")  # the rest is the same


def arrays(model):
    """Names of all datasets of a model."""
    names = []
    model.visit(names.append)
    return [name for name in names if isinstance(model[name], h5py.Dataset)]


def put(model, name, value):
    del model[name]
    model[name] = value


def change(model, name, value):
    """Another value in the first and the last row."""
    data = model[name][()]
    data[0] = data[-1] = value
    model[name][...] = data


def largest(data):
    return 1e300 if data.dtype.kind == "f" else np.iinfo(data.dtype).max


SPOILS = {
    "NaN": lambda m, n: change(m, n, np.nan),
    "-1": lambda m, n: change(m, n, -1),
    "huge": lambda m, n: change(m, n, largest(m[n])),
    "shape": lambda m, n: put(m, n, m[n][()][..., None]),
    "type": lambda m, n: put(m, n, np.ones(m[n].shape) if m[n].dtype.kind in "iS"
                             else np.full(m[n].shape, b"x")),
    "missing": lambda m, n: m.__delitem__(n),
    "empty": lambda m, n: put(m, n, m[n][:0]),
}

# Values that a model may have, and arrays that it need not have; these are solved, or not converged.
ALLOWED = {
    *((name, "missing") for name in (
        "point/mass", "point/external_force", "bone_transform", "skin/points",
        "prism/nodal_modulus")),
    ("skin/points", "empty"), ("adhesion/cut_column", "empty"),
    *((name, "-1") for name in (
        "point/external_force", "edge/weight", "prism/target_volume",
        "contact/body_push", "adhesion/lip_line", "adhesion/box")),
    ("point/layer", "huge"), ("point/column", "huge"), ("adhesion/cut_column", "huge"),
}


def cases():
    for kind, make in MODELS.items():
        with h5py.File("memory", "w", driver="core", backing_store=False) as file:
            make(file)
            names = [name for name in arrays(file["model"])
                     if kind == "springs" or name.startswith(SOLID_ALONE)]
            for name in names:
                of_text = file["model"][name].dtype.kind == "S"
                whole = file["model"][name].dtype.kind == "i"
                for spoil in SPOILS:
                    if not (of_text and spoil in ("NaN", "-1", "huge") or whole and spoil == "NaN"):
                        yield kind, name, spoil


def spoiled(folder, case):
    kind, name, spoil = case
    file = folder / "-".join([kind, name.replace("/", "."), spoil]) / "model.h5"
    file.parent.mkdir()
    shutil.copy(folder / f"{kind}.h5", file)
    with h5py.File(file, "r+") as opened:
        SPOILS[spoil](opened["model"], name)
    return file


def fault(result, case, file):
    """Returns the faults of a run's outcome, empty if there are none."""
    lines = result.stderr.splitlines()
    if case[1:] in ALLOWED:
        good = result.returncode in (0, 2) and "error" not in result.stderr
    else:
        good = (result.returncode == 1 and len(lines) == 1
                and lines[0].startswith(f"error: {file.name}: /model"))
    return "" if good else f"{case}: {result.returncode} {result.stderr.strip()[:300]}"


def faults(run, folder, chosen, ranks):
    for kind, make in MODELS.items():
        with h5py.File(folder / f"{kind}.h5", "w") as file:
            make(file)

    def one(case):
        file = spoiled(folder, case)
        result = run("repose-solve", file.name, "-output", "out", cwd=file.parent, ranks=ranks)
        return fault(result, case, file)

    with concurrent.futures.ThreadPoolExecutor(WORKERS if ranks == 1 else 1) as pool:
        return [text for text in pool.map(one, chosen) if text]


@pytest.mark.quick
@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("ranks", [1, 2])
def test_the_models_themselves_are_solved(run, tmp_path, kind, ranks):
    with h5py.File(tmp_path / "model.h5", "w") as file:
        MODELS[kind](file)
    result = run("repose-solve", "model.h5", "-output", "out", ranks=ranks)
    assert (result.returncode, result.stderr) == (0, ""), result


def test_a_spoiled_array_is_refused(run, tmp_path):
    found = faults(run, tmp_path, list(cases())[::1 if RUNS_ALL else 12], 1)
    assert not found, "\n".join(found)


def test_a_spoiled_array_is_refused_on_two_ranks(run, tmp_path):
    """Allowed values are accepted, and some of the others refused."""
    chosen = [case for number, case in enumerate(cases())
              if case[1:] in ALLOWED or number % 23 == 0]
    chosen = chosen[::1 if RUNS_ALL else 12]
    found = faults(run, tmp_path, chosen, 2)
    assert not found, "\n".join(found)


def broken_mesh(model):
    model["contact/body_mesh/3/triangles"][...] = FACES[[0, 1, 2, 2]]


def set_rows(name, rows, value):
    def spoil(model):
        data = model[name][()]
        data[rows] = value
        model[name][...] = data
    return spoil


# Rows that are wrong beside the others, and words that the refusal holds.
BESIDE_OTHERS = {
    "a ball without a radius": (set_rows("contact/body_shape", (0, 3), 0), ["body_shape: row 0"]),
    "a ball of negative radius": (set_rows("contact/body_shape", (0, 3), -5), ["row 0", "-5"]),
    "a rod of negative radius": (set_rows("contact/body_shape", (1, 6), -5), ["row 1", "-5"]),
    "a box of negative size": (set_rows("contact/body_shape", (2, 4), -1), ["row 2", "-1"]),
    "a half-space without a normal": (set_rows("contact/body_shape", (4, 5), 0), ["row 4"]),
    "an open mesh": (broken_mesh, ["contact/body_mesh/3", "closed"]),
    "adhesion to a jaw neither upper nor lower": (set_rows("adhesion/upper", 0, 2),
                                                  ["adhesion/upper: row 0 is 2"]),
    "a bone without its row": (set_rows("contact/body_bone", 5, -1), ["body_kind: row 5"]),
    "a ball with a bone": (set_rows("contact/body_bone", 0, 0), ["body_kind: row 0"]),
    "a shape of no kind": (set_rows("contact/body_kind", 3, 6), ["body_kind: row 3 is 6"]),
    "a bone without a surface": (lambda m: m.__delitem__("bone_surface"), ["bone_surface"]),
    "an edge from a point to itself": (set_rows("spring/points", 2, 3), ["spring/points: row 2"]),
    "a prism with a point twice": (set_rows("prism/points", (0, 1), 3), ["prism/points: row 0"]),
    "a bone moved by 1e300 mm": (set_rows("bone_transform", (0, 0, 3), 1e300),
                                 ["bone_transform: row 0"]),
    "a bone point that its bone does not take along": (
        set_rows("point/target", (5, 1), 11), ["point/target: row 5", "11", "bone_transform"]),
    "a soft point with a target of its own": (
        set_rows("point/target", (1, 1), 1), ["point/target: row 1", "point/position"]),
}


@pytest.mark.parametrize("ranks", [1, 3])
@pytest.mark.parametrize("case", BESIDE_OTHERS)
def test_a_row_that_is_wrong_beside_others_is_refused(run, tmp_path, case, ranks):
    spoil, words = BESIDE_OTHERS[case]
    with h5py.File(tmp_path / "model.h5", "w") as file:
        springs(file)
        spoil(file["model"])
    result = run("repose-solve", "model.h5", "-output", "out", ranks=ranks)
    assert result.returncode == 1 and len(result.stderr.splitlines()) == 1, result
    assert result.stderr.startswith("error: model.h5: /model/"), result.stderr
    assert [word for word in words if word not in result.stderr] == [], result.stderr


def test_all_points_may_have_the_largest_layer_number(run, tmp_path):
    with h5py.File(tmp_path / "model.h5", "w") as file:
        springs(file)
        file["model/point/layer"][...] = largest(file["model/point/layer"])
        file["model/point/column"][...] = 0
    result = run("repose-solve", "model.h5", "-output", "out")
    assert (result.returncode, result.stderr) == (0, ""), result


def chain(file, held):
    """A chain of springs through points in such an order that all ranks hold parts of it."""
    points = 30
    write_model(file)
    model = file["model"]
    for group in [name for name in model if name not in ("point", "spring")]:
        del model[group]
    for name in arrays(model):
        rows = np.repeat(model[name][:1], points - name.startswith("spring/"), axis=0)
        del model[name]
        model[name] = rows
    model["spring_set"] = np.array([b"all"])
    order = np.arange(points) * 7 % points
    place = np.argsort(order)
    model["point/position"][:, 0] = model["point/target"][:, 0] = place * 10.0
    model["point/column"][...] = np.arange(points)
    model["spring/points"][...] = np.stack([order[:-1], order[1:]], axis=1)
    if held:
        model["point/set"][order[-1]] = 1


@pytest.mark.parametrize("ranks", [1, 2, 3])
@pytest.mark.parametrize("held", [True, False])
def test_tissue_over_several_ranks_must_be_held_somewhere(run, tmp_path, held, ranks):
    with h5py.File(tmp_path / "model.h5", "w") as file:
        chain(file, held)
    result = run("repose-solve", "model.h5", "-dry_run", ranks=ranks)
    refusal = ("error: model.h5: /model/point: row 0 at (0, 0, 5) mm is soft tissue, and nothing "
               "holds it or what it is joined to; make a point there a boundary point (set 1), "
               "or remove the part\n")
    assert (result.returncode, result.stderr) == ((0, "") if held else (1, refusal)), result


def test_a_refusal_during_the_solve_names_the_file(run, tmp_path):
    with h5py.File(tmp_path / "model.h5", "w") as file:
        springs(file)
        file["model/spring/reference"][...] = 1e-300
    result = run("repose-solve", "model.h5", "-output", "out")
    assert result.returncode == 1 and len(result.stderr.splitlines()) == 1, result
    assert result.stderr.startswith("error: model.h5: "), result.stderr
