"""A model file as input: from a result, or from elsewhere, in any order and with any numeric type
that holds the numbers."""

import numpy as np
import pytest

from tissue import apart, last, model_of, steps, write_model

ACCURACY = 1e-6
SCENE = "paper_jaw_opening.yaml"
KAPPA = []  # what the scene gives its springs


@pytest.fixture
def face(solved):
    file = solved(SCENE, "-accuracy", ACCURACY)
    KAPPA[:] = ["-bulk_modulus", repr(float(last(file)["bulk_modulus"]))]  # no model has it
    return file


def solve(run, folder, model, ranks=1):
    """The last step of the rest position of a model."""
    write_model(folder / "model.h5", model)
    result = run("repose-solve", "model.h5", "-accuracy", ACCURACY, "-output", "out", *KAPPA,
                 ranks=ranks)
    assert (result.returncode, result.stderr) == (0, ""), result
    return last(folder / "out.h5")


def test_a_result_as_input_gives_the_same_face(run, face, tmp_path):
    result = run("repose-solve", face, "-accuracy", ACCURACY, "-output", "again")
    assert (result.returncode, result.stderr) == (0, "")
    before, after = model_of(face), model_of(tmp_path / "again.h5")
    assert before.keys() == after.keys()
    assert all(before[name].tobytes() == after[name].tobytes() for name in before)
    assert len(steps(face)) == len(steps(tmp_path / "again.h5"))
    assert np.array_equal(last(face)["point/position"],
                          last(tmp_path / "again.h5")["point/position"])


def shuffled(model, random):
    """The model with points, springs and prisms in another order, springs turned round and prisms
    counted from another corner; and where each point was before."""
    points = random.permutation(len(model["point/position"]))
    place = np.argsort(points)
    springs = random.permutation(len(model["spring/points"]))
    prisms = random.permutation(len(model["prism/points"]))
    other = dict(model)
    for name in model:
        for start, order in (("point/", points), ("spring/", springs), ("prism/", prisms)):
            if name.startswith(start):
                other[name] = model[name][order]
    ends = place[other["spring/points"]]
    turned = random.random(len(ends)) < 0.5
    ends[turned] = ends[turned, ::-1]
    corners = place[other["prism/points"]].reshape(-1, 2, 3)
    other |= {"spring/points": ends, "prism/points": np.roll(corners, 1, axis=2).reshape(-1, 6)}
    if "skin/points" in model:
        other["skin/points"] = place[model["skin/points"]]
    return other, points


@pytest.mark.parametrize("ranks", [1, 3])
def test_any_order_gives_the_same_face(run, face, tmp_path, ranks):
    model, order = shuffled(model_of(face), np.random.default_rng(5))
    step, rest = solve(run, tmp_path, model, ranks), last(face)
    assert step["objective"] == pytest.approx(rest["objective"], rel=1e-12)
    distance = step["point/position"] - rest["point/position"][order]
    assert np.linalg.norm(distance, axis=1).max() <= 2 * ACCURACY


@pytest.mark.quick
def test_motion_recovered_from_the_targets(run, face, tmp_path):
    model = model_of(face)
    del model["bone_transform"]
    assert apart(solve(run, tmp_path, model), last(face)) <= 2 * ACCURACY


def test_drawings_may_be_missing(run, face, tmp_path):
    model = {name: values for name, values in model_of(face).items()
             if not name.startswith(("skin/", "bone_surface/"))}
    assert np.array_equal(solve(run, tmp_path, model)["point/position"],
                          last(face)["point/position"])
    assert not (tmp_path / "out_skin.xdmf").exists()
    assert not (tmp_path / "out_bones.xdmf").exists()


def test_any_type_that_loses_nothing(run, face, tmp_path):
    model = model_of(face)
    for name, kind in (("spring/stiffness", "f4"), ("spring/reference", "f4"), ("point/mass", "f4"),
                       ("point/external_force", "f4"), ("spring/points", "i4"),
                       ("prism/points", "u2"), ("point/set", "i8"), ("point/column", "u4"),
                       ("point/layer", "u1"), ("point/bone", ">i2"), ("spring/exponent", "u8"),
                       ("spring/set", ">i8"), ("skin/points", "i2"), ("gravity", "f4")):
        assert np.array_equal(model[name].astype(kind), model[name]), name
        model[name] = model[name].astype(kind)
    assert np.array_equal(solve(run, tmp_path, model)["point/position"],
                          last(face)["point/position"])


def test_float32_positions_are_a_model_of_their_own(run, face, tmp_path):
    model = model_of(face)
    del model["bone_transform"]
    for name in ("point/position", "point/target", "spring/rest_length", "prism/rest_volume"):
        model[name] = model[name].astype("f4")
    write_model(tmp_path / "model.h5", model)
    result = run("repose-solve", "model.h5", "-output", "out", *KAPPA)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert apart(last(tmp_path / "out.h5"), last(face)) < 0.2


@pytest.mark.parametrize("ranks", [1, 5])
def test_one_triangle(run, tmp_path, ranks):
    step = solve(run, tmp_path, one_triangle(), ranks)
    corners = one_triangle()["point/target"][3:]
    assert np.abs(step["point/position"][:3] - corners - [0, 0, 5]).max() <= ACCURACY
    assert step["objective"] == pytest.approx(0, abs=1e-9)


def one_triangle():
    """Three soft-tissue points over three of a bone that turns by 30° and moves: the rest position
    is the prism carried along, without any strain."""
    corners = np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]])
    position = np.concatenate([corners + [0, 0, 5], corners])
    turned = corners @ rotation(30).T + [1, 2, 3]
    pairs = np.array([(a, b) for a in range(6) for b in range(a + 1, 6)])
    length = np.linalg.norm(position[pairs[:, 0]] - position[pairs[:, 1]], axis=1)
    bone = np.array([0, 0, 0, 1, 1, 1])
    return {
        "gravity": np.zeros(3), "point/position": position,
        "point/set": (2 * bone).astype("i1"), "point/layer": bone.astype("i4"),
        "point/target": np.concatenate([position[:3], turned]),
        "point/column": np.arange(6) % 3, "point/bone": (bone - 1).astype("i4"),
        "point/mass": np.zeros(6), "point/external_force": np.zeros((6, 3)),
        "spring/points": pairs, "spring/set": np.zeros(15, "i4"), "spring/rest_length": length,
        "spring/stiffness": np.ones(15), "spring/exponent": np.full(15, 2, "i1"),
        "spring/reference": np.ones(15), "prism/points": np.array([[3, 4, 5, 0, 1, 2]]),
        "prism/rest_volume": np.array([250.0]), "spring_set": np.array([b"all"]),
        "bone": np.array([b"jaw"]),
    }


def rotation(degrees):
    """A rotation about z."""
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0],
                     [0, 0, 1]])
