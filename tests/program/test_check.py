"""repose-check against a result that numpy made on its own: it must find every number right, and
each single one wrong after a change in its seventh digit."""

import subprocess

import h5py
import meshio
import numpy as np
import pytest

from conftest import programs

GRAVITY = np.array([0.3, -0.2, -9.80665])
LOAD, LAMBDA, KAPPA, EPSILON = 0.5, 0.7, 0.05, 1e-3
AXIS, CENTER, ANGLE, SLIDE = np.array([1.0, 2.0, 2.0]) / 3, np.array([3.0, -4.0, 5.0]), 0.3, 2.0


def screw(load):
    """The motion of the moving bone: about AXIS through CENTER by ANGLE, along it by SLIDE."""
    x, y, z = AXIS
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + np.sin(load * ANGLE) * cross + (1 - np.cos(load * ANGLE)) * cross @ cross
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    matrix[:3, 3] = CENTER - turn @ CENTER + load * SLIDE * AXIS
    return matrix


def moved(points, load):
    matrix = screw(load)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def make_model():
    """A block of 3 × 3 columns of 3 layers, a little irregular; every set of points occurs."""
    random = np.random.default_rng(1)
    grid = [(i, j, a) for i in range(3) for j in range(3) for a in range(3)]
    row = {place: n for n, place in enumerate(grid)}
    x = np.array([(5.0 * i, 5.0 * j, -4.0 * a) for i, j, a in grid])
    x += random.uniform(-0.5, 0.5, x.shape)
    sets = np.array([2 if a == 2 else 0 for _, _, a in grid], dtype="i1")
    sets[row[0, 0, 0]], sets[row[2, 2, 0]] = 1, 3
    bone = np.array([(0 if i == 0 else 1) if a == 2 else -1 for i, _, a in grid], dtype="i4")
    target = x.copy()
    target[bone == 1] = moved(x[bone == 1], 1)
    target[row[2, 2, 0]] += (1, -2, 3)
    near = [(p, q) for p in range(27) for q in range(p + 1, 27)
            if max(abs(np.subtract(grid[p], grid[q]))) == 1]
    prisms = []
    for i in range(2):
        for j in range(2):
            for a in range(2):
                for t in ([(i, j), (i, j + 1), (i + 1, j)], [(i + 1, j), (i, j + 1), (i + 1, j + 1)]):
                    prisms.append([row[k, m, a] for k, m in t] + [row[k, m, a + 1] for k, m in t])
    springs, prisms = np.array(near), np.array(prisms)
    skin = [prism[:3] for prism in prisms if prism[0] % 3 == 0]  # of the outermost layer
    length = np.linalg.norm(x[springs[:, 1]] - x[springs[:, 0]], axis=1)
    count = len(springs)
    return {
        "point/position": x, "point/set": sets, "point/target": target,
        "point/layer": np.array([a for _, _, a in grid], dtype="i4"),
        "point/column": np.array([3 * i + j for i, j, _ in grid]),
        "point/bone": bone, "point/mass": random.uniform(0, 1e-3, 27),
        "point/external_force": random.uniform(-0.1, 0.1, (27, 3)),
        "spring/points": springs, "spring/set": np.zeros(count, dtype="i4"),
        "spring/rest_length": length * random.uniform(0.8, 1.05, count),
        "spring/stiffness": random.uniform(0.1, 3, count),
        "spring/exponent": (np.arange(count) % 3).astype("i1"),
        "spring/reference": random.uniform(0.5, 5, count),
        "prism/points": prisms, "prism/rest_volume": volumes(x, prisms),
        "skin/points": np.array(skin),
    }


def volumes(x, prisms):
    a0, a1, a2, b0, b1, b2 = (x[prisms[:, c]] for c in range(6))
    normals = (2 * np.cross(a1 - a0, a2 - a0) + np.cross(a1 - a0, b2 - b0)
               + np.cross(b1 - b0, a2 - a0) + 2 * np.cross(b1 - b0, b2 - b0))
    return ((b0 - a0 + b1 - a1 + b2 - a2) * normals).sum(1) / 36


def length_of(vectors):
    """Euclidean length that complex numbers differentiate."""
    return np.sqrt((vectors * vectors).sum(-1))


def outward(model):
    """Unit vectors along the skin's normals above the points."""
    x, skin, column = model["point/position"], model["skin/points"], model["point/column"]
    areas = np.cross(x[skin[:, 1]] - x[skin[:, 0]], x[skin[:, 2]] - x[skin[:, 0]])
    of_column = np.zeros((9, 3))
    for corner in skin.T:
        np.add.at(of_column, column[corner], areas)
    return (of_column / np.linalg.norm(of_column, axis=1)[:, None])[column]


def evaluate(model, x, functional, volume):
    """All that a step holds, at positions x (complex x: for derivatives)."""
    soft = model["point/set"] == 0
    p, q = model["spring/points"].T
    d = x[q] - x[p]
    r = length_of(d)
    s = r - model["spring/rest_length"]
    sigma2, k = (s / model["spring/reference"])**2, model["spring/stiffness"]
    power = model["spring/exponent"].astype(int)
    tension = k * (1 + sigma2)**power * s
    energy = k * s**2 / 2 * np.choose(power, [1, 1 + sigma2 / 2, 1 + sigma2 + sigma2**2 / 3])
    counted = soft[p] | soft[q]
    load = model["point/mass"][:, None] * GRAVITY + model["point/external_force"]
    force = load.astype(x.dtype)
    pull = (tension / r)[:, None] * d
    np.add.at(force, p, pull)
    np.add.at(force, q, -pull)
    force[~soft] = 0
    v, v0 = volumes(x, model["prism/points"]), model["prism/rest_volume"]
    within = soft[model["prism/points"]].any(1)
    n = {"f_e": energy[counted].sum(),
         "potential": -(load * (x - model["point/position"]))[soft].sum(),
         "f_f": length_of(force[soft]).sum(),
         "f_v": ((v - v0)[within]**2).sum(),
         "penalty": 0.0}
    if volume == "penalty":
        n["penalty"] = (KAPPA / 2 * (v - v0)**2 / v0)[within].sum()
    f = n["f_e"] + n["potential"]
    if functional == "force":
        f = (np.sqrt(length_of(force[soft])**2 + EPSILON**2) - EPSILON).sum()
    n["objective"] = LAMBDA * f + (1 - LAMBDA) * n["f_v"] if volume == "paper" else f + n["penalty"]
    displacement = x - model["point/position"]
    arrays = {"point/position": x, "point/displacement": displacement,
              "point/advance": (displacement * outward(model)).sum(1),
              "point/residual_force": force, "prism/volume_ratio": v / v0,
              "spring/elongation": s, "spring/tension": tension}
    return n, arrays, within


def gradient_max(model, x, functional, volume):
    """Complex-step derivative of the objective: exact to rounding."""
    largest = 0
    for i in np.flatnonzero(model["point/set"] == 0):
        slope = np.zeros(3)
        for axis in range(3):
            shifted = x.astype(complex)
            shifted[i, axis] += 1e-30j
            slope[axis] = evaluate(model, shifted, functional, volume)[0]["objective"].imag / 1e-30
        largest = max(largest, np.linalg.norm(slope))
    return largest


def positions(model):
    """Bones, held and boundary points where they are at LOAD, tissue anywhere; one prism inverted."""
    x, sets = model["point/position"].copy(), model["point/set"]
    random = np.random.default_rng(2)
    x[sets == 0] += random.uniform(-0.8, 0.8, (np.sum(sets == 0), 3))
    x[sets == 3] += LOAD * (model["point/target"] - x)[sets == 3]
    moving = model["point/bone"] == 1
    x[moving] = moved(x[moving], LOAD)
    x[1, 2] += 20
    return x


def write_result(file, functional, volume):
    model = make_model()
    x = positions(model)
    numbers, arrays, within = evaluate(model, x, functional, volume)
    ratio = arrays["prism/volume_ratio"][within]
    numbers |= {
        "load": LOAD, "functional": functional, "volume": volume,
        "lambda": LAMBDA if volume == "paper" else 1.0,
        "bulk_modulus": KAPPA if volume == "penalty" else 0.0,
        "epsilon": EPSILON if functional == "force" else 0.0,
        "gradient_max": gradient_max(model, x, functional, volume),
        "volume_error_max": abs(ratio - 1).max(), "inverted_prisms": int((ratio <= 0).sum()),
        "displacement_error": 0.01, "iterations": 7, "evaluations": 9, "seconds": 0.5,
        "reason": "accuracy reached", "converged": 0}
    bone = moved(np.array([[0.0, 0, -9], [9, 0, -9], [0, 9, -9]]), 0)
    with h5py.File(file, "w") as h5:
        h5.attrs.update(format=np.bytes_("tissue-model"), version=1)
        for name, values in model.items():
            h5[f"model/{name}"] = values
        h5["model"].attrs["gravity"] = GRAVITY
        h5["model/spring_set"] = np.array([b"all"])
        h5["model/bone"] = np.array([b"skull", b"mandible"])
        h5["model/bone_transform"] = np.array([np.eye(4), screw(1)])
        for b in range(2):
            h5[f"model/bone_surface/{b}/points"] = bone
            h5[f"model/bone_surface/{b}/triangles"] = np.array([[0, 1, 2]])
        there = np.vstack([bone, moved(bone, LOAD)])
        h5["step/0000/bone_surface/points"] = there
        h5["step/0000/bone_surface/displacement"] = there - np.vstack([bone, bone])
        for name, values in arrays.items():
            h5[f"step/0000/{name}"] = values
        for name, value in numbers.items():
            h5["step/0000"].attrs[name] = np.bytes_(value) if isinstance(value, str) else value
    assert numbers["inverted_prisms"] > 0
    return file


@pytest.mark.quick
@pytest.mark.parametrize("functional, volume", [
    ("energy", "none"), ("energy", "paper"), ("energy", "penalty"),
    ("force", "none"), ("force", "paper")])
def test_agrees_with_numpy(run, tmp_path, functional, volume):
    result = run("repose-check", write_result(tmp_path / "a.h5", functional, volume))
    assert result.returncode == 0, result.stdout + result.stderr
    assert "numbers agree to 1e-09" in result.stdout
    assert result.stderr == ""


ATTRIBUTES = ["f_e", "potential", "f_f", "f_v", "penalty", "objective", "gradient_max",
              "volume_error_max"]
ARRAYS = ["point/displacement", "point/advance", "point/residual_force", "prism/volume_ratio",
          "spring/elongation",
          "spring/tension", "bone_surface/points", "bone_surface/displacement"]


def refused(result, *words):
    assert result.returncode == 1, result.stdout
    assert len(result.stderr.splitlines()) == 1, result.stderr
    for word in words:
        assert word in result.stderr


@pytest.mark.parametrize("functional, volume", [("energy", "penalty"), ("force", "paper")])
def test_finds_each_wrong_number(run, tmp_path, functional, volume):
    file = write_result(tmp_path / "a.h5", functional, volume)
    for name in ATTRIBUTES:
        if name == "penalty" and volume != "penalty":
            continue
        with h5py.File(file, "r+") as h5:
            attributes = h5["step/0000"].attrs
            right = attributes[name]
            attributes[name] = right * (1 + 1e-7)
        refused(run("repose-check", file), "1 of ", f"the worst: step 0000 {name}: stored")
        with h5py.File(file, "r+") as h5:
            h5["step/0000"].attrs[name] = right
    for name in ARRAYS:
        with h5py.File(file, "r+") as h5:
            dataset = h5[f"step/0000/{name}"]
            place = np.unravel_index(np.argmax(abs(dataset[...])), dataset.shape)
            right = dataset[place]
            dataset[place] = right * (1 + 1e-7)
        refused(run("repose-check", file), "1 of ", f"the worst: step 0000 {name}: stored")
        with h5py.File(file, "r+") as h5:
            h5[f"step/0000/{name}"][place] = right
    assert run("repose-check", file).returncode == 0


@pytest.mark.parametrize("name, value", [
    ("load", 1.5), ("lambda", -0.1), ("bulk_modulus", -1.0), ("epsilon", -1e-9),
    ("displacement_error", -1.0), ("iterations", -1), ("evaluations", -1), ("seconds", -0.5)])
def test_finds_what_is_out_of_range(run, tmp_path, name, value):
    file = write_result(tmp_path / "a.h5", "energy", "none")
    with h5py.File(file, "r+") as h5:
        h5["step/0000"].attrs[name] = value
    assert f"{name} " in next(line for line in run("repose-check", file).stdout.splitlines()
                              if "OUT OF RANGE" in line)


def test_a_distance_may_be_infinite_but_must_be_a_number(run, tmp_path):
    file = write_result(tmp_path / "a.h5", "energy", "none")
    for value, status in ((np.inf, 0), (np.nan, 1)):
        with h5py.File(file, "r+") as h5:
            h5["step/0000"].attrs["displacement_error"] = value
        assert run("repose-check", file).returncode == status


@pytest.mark.quick
def test_finds_a_count_that_is_off_by_one_and_a_false_end(run, tmp_path):
    file = write_result(tmp_path / "a.h5", "energy", "none")
    with h5py.File(file, "r+") as h5:
        h5["step/0000"].attrs["inverted_prisms"] += 1
        h5["step/0000"].attrs["converged"] = 1
    result = run("repose-check", file)
    refused(result, "2 of ")
    assert "inverted_prisms" in result.stdout and "NOT SO" in result.stdout


def test_finds_a_bone_point_in_the_wrong_place(run, tmp_path):
    file = write_result(tmp_path / "a.h5", "energy", "none")
    with h5py.File(file, "r+") as h5:
        point = int(np.flatnonzero(h5["model/point/bone"][:] == 1)[0])
        for name in ("point/position", "point/displacement"):
            h5[f"step/0000/{name}"][point, 0] += 1e-5
    result = run("repose-check", file)
    refused(result)
    assert "point/position, fixed" in [line for line in result.stdout.splitlines()
                                       if "1 of 81 DISAGREE" in line][0]


def test_prints_a_row_for_each_kind_and_all_where_asked(run, tmp_path):
    file = write_result(tmp_path / "a.h5", "energy", "none")
    with h5py.File(file, "r+") as h5:
        for step in range(1, 9):
            h5.copy("step/0000", f"step/{step:04}")
            h5[f"step/{step:04}"].attrs["load"] = LOAD + step / 100
            h5[f"step/{step:04}"].attrs["f_e"] *= 1 + step * 1e-7
    rows = run("repose-check", file).stdout.splitlines()
    assert len([row for row in rows if row.startswith("f_e ")]) == 1
    worst = next(row for row in rows if row.startswith("f_e "))
    assert "step 0008" in worst and "8 of 9 DISAGREE" in worst
    every = run("repose-check", file, "-verbose").stdout.splitlines()
    assert len([row for row in every if " f_e " in row]) == 9 and len(every) > 150 > 30 > len(rows)


def test_a_checkpoint_is_no_end(run, tmp_path):
    file = write_result(tmp_path / "a.h5", "energy", "none")
    with h5py.File(file, "r+") as h5:
        h5["step/0000"].attrs["converged"] = 1
    refused(run("repose-check", file), "not so: converged is 0 where the last load is below 1")
    with h5py.File(file, "r+") as h5:
        h5.attrs["checkpoint"] = 1
    assert run("repose-check", file).returncode == 0


FAR = """skin: far_skin.ply
bones:
  - {name: skull, file: far_skull.ply}
  - {name: mandible, file: far_mandible.ply}
tissue: {layers: 4}
contact: {}
moves: [{bone: mandible, translate: [0, -2, 0]}]
solve: {accuracy: 1}
"""


def test_a_head_far_from_the_origin_agrees(run, tmp_path):
    """9000 km away, where coordinates are rounded to 2e-9 mm."""
    made = run("repose-phantom", "-skin_vertices", 2000, "-output", "head")
    assert made.returncode == 0, made
    for name in ("skin", "skull", "mandible"):
        mesh = meshio.read(tmp_path / f"head_{name}.ply")
        mesh.points = mesh.points.astype(float) + [9e6, -9e6, 9e6]
        mesh.write(tmp_path / f"far_{name}.ply", binary=True)
    (tmp_path / "far.yaml").write_text(FAR)
    solved = run("repose-solve", "far.yaml")
    assert solved.returncode == 0, solved
    result = run("repose-check", "far.h5")
    assert (result.returncode, result.stderr) == (0, ""), result


def test_a_reader_that_goes_away_is_no_fault(run, environment, tmp_path):
    file = write_result(tmp_path / "a.h5", "energy", "none")
    command = [programs() / "repose-check", file, "-verbose"]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0


@pytest.mark.quick
def test_refuses_what_is_no_result(run, tmp_path):
    refused(run("repose-check", tmp_path / "none.h5"), "none.h5: no such file")
    (tmp_path / "text.h5").write_text("text\n")
    refused(run("repose-check", tmp_path / "text.h5"), "text.h5: is not an HDF5 file")
    file = write_result(tmp_path / "a.h5", "energy", "none")
    with h5py.File(file, "r+") as h5:
        del h5["step"]
    refused(run("repose-check", file), "/step holds no step")
