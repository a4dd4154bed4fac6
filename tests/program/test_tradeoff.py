"""repose-tradeoff: its tables say what was run, what it cost and how far it was from the truth."""

import csv
import shutil
import subprocess
import sys

import numpy as np
import pytest

from conftest import PROJECT
from tissue import last, model_of

SCENE = PROJECT / "meshes/paper_jaw_advance.yaml"
FEW = ("-methods", "ntr,lmvm", "-accuracies", "1,0.01", "-load_steps", "2", "-volumes", "none",
       "-layers", "2,4", "-edges", "20")


def rows(file):
    with open(file, newline="") as table:
        return list(csv.DictReader(table))


@pytest.fixture(scope="module")
def folder(tmp_path_factory, environment):
    from conftest import runner
    top = tmp_path_factory.mktemp("tradeoff")
    result = runner(top, environment)("repose-tradeoff", SCENE, *FEW, "-output", "few")
    assert (result.returncode, result.stderr) == (0, ""), result
    (top / "said").write_text(result.stdout)
    return top


@pytest.mark.quick
def test_every_way_is_there_once(folder):
    found = [(row["study"], row["method"], row["accuracy_mm"], row["volume"], row["load_steps"],
              row["layers"]) for row in rows(folder / "few.csv")]
    solver = [("solver", method, accuracy, "penalty", "auto", "4")
              for method in ("ntr", "lmvm") for accuracy in ("1", "0.01")]
    assert found == solver + [("load steps", "ntr", "0.1", "penalty", "2", "4"),
                              ("volume", "ntr", "0.1", "none", "auto", "4"),
                              ("layers", "ntr", "0.1", "penalty", "auto", "2"),
                              ("layers", "ntr", "0.1", "penalty", "auto", "4"),
                              ("mesh", "ntr", "0.1", "penalty", "auto", "4")]


def test_estimates_bound_the_errors_and_more_accuracy_costs_more(folder):
    table = rows(folder / "few.csv")
    assert all(row["converged"] == "1" for row in table)
    for row in table:
        error, estimate = float(row["error_mm"]), float(row["estimate_mm"])
        assert 0 < error <= estimate <= float(row["accuracy_mm"])
    cost = [int(row["evaluations"]) for row in table[:4]]
    assert cost[0] < cost[1] and cost[2] < cost[3] and 5 * cost[1] < cost[3]


def test_the_reference_has_the_most_layers(folder):
    fewer, most = rows(folder / "few.csv")[-3:-1]
    assert float(most["skin_max_mm"]) <= float(most["error_mm"]) + 1e-9
    assert float(fewer["skin_max_mm"]) > 0.5 > float(most["skin_max_mm"])
    assert float(fewer["skin_rms_mm"]) < float(fewer["skin_95_mm"]) < float(fewer["skin_max_mm"])


def test_a_coarser_mesh_is_further_from_the_reference(folder):
    coarse, own = rows(folder / "few.csv")[-1], rows(folder / "few.csv")[-2]
    assert coarse["edge_mm"] == "20" and int(coarse["points"]) < 0.8 * int(own["points"])
    assert 0.1 < float(coarse["skin_max_mm"]) < 6 and float(coarse["error_mm"]) < 0.1


@pytest.mark.quick
def test_the_runs_are_counted_and_a_conclusion_is_drawn(folder):
    *lines, conclusion, _ = (folder / "said").read_text().splitlines()
    assert lines[0].split() == ["first", "the", "reference"]
    assert [line.split()[:3] for line in lines[1:]] == [[str(k), "of", "9"] for k in range(1, 10)]
    solver = [row for row in rows(folder / "few.csv") if row["study"] == "solver"]
    fastest = min((row for row in solver if row["accuracy_mm"] == "0.01"),
                  key=lambda row: float(row["cpu_s"]))
    assert f"0.01 mm {float(fastest['cpu_s']):.2g} s ({fastest['method']})." in conclusion
    mesh = rows(folder / "few.csv")[-1]
    assert f"edges of 20 mm is {float(mesh['skin_95_mm']):.2g} mm away (95 %)." in conclusion
    assert conclusion.endswith("Compare more layers (-layers) to learn what the model leaves.")


def test_a_conclusion_says_what_to_refine(run):
    result = run("repose-tradeoff", SCENE, "-methods", "ntr", "-accuracies", "1", "-load_steps", ",",
                 "-volumes", ",", "-layers", "4,5", "-edges", ",", "-reference", "1e-4", "-output", "five")
    assert result.returncode == 0, result
    conclusion = result.stdout.splitlines()[-2]
    assert " 4 layers leave 95 % of the skin within " in conclusion and " of 5 layers." in conclusion
    assert conclusion.endswith("Refine layers and mesh before asking for more than 0.1 mm.")


def test_the_map_is_of_the_whole_face(folder):
    with open(folder / "few_map.csv", newline="") as file:
        names, *lines = csv.reader(file)
    assert names == ["x", "y", "z", "load steps: 2", "volume: none", "layers: 2", "layers: 4",
                     "mesh: 20 mm"]
    values = np.array(lines, float)
    triangles = np.genfromtxt(folder / "few_triangles.csv", delimiter=",", skip_header=1, dtype=int)
    assert values.shape == (477, 8) and triangles.shape == (874, 3) and triangles.max() == 476
    largest = [float(row["skin_max_mm"]) for row in rows(folder / "few.csv")[4:]]
    assert values[:, 3:].max(axis=0) == pytest.approx(largest, rel=1e-3)


@pytest.mark.long
def test_two_ranks_find_the_same_errors(run, folder, tmp_path):
    result = run("repose-tradeoff", SCENE, *FEW, "-output", "two", ranks=2)
    assert result.returncode == 0, result
    for one, two in zip(rows(folder / "few.csv"), rows(tmp_path / "two.csv"), strict=True):
        apart = 0.05 + float(one["estimate_mm"]) + float(two["estimate_mm"])
        assert float(two["skin_max_mm"]) == pytest.approx(float(one["skin_max_mm"]), abs=apart)
        assert float(two["error_mm"]) <= float(two["estimate_mm"])


def draw(folder, name):
    pytest.importorskip("matplotlib")
    done = subprocess.run([sys.executable, PROJECT / "drivers/plot_tradeoff.py", name],
                          cwd=folder, text=True, capture_output=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert (folder / f"{name}.png").stat().st_size > 10000 and "| all | " in done.stdout


def test_the_pictures_can_be_drawn(folder):
    draw(folder, "few")
    assert (folder / "few_map.png").stat().st_size > 10000


@pytest.mark.long
def test_a_solid_is_compared_with_springs_and_drawn(run, tmp_path):
    result = run("repose-tradeoff", PROJECT / "meshes/head_solid.yaml", "-methods", "ntr",
                 "-accuracies", "1", "-load_steps", ",", "-layers", "2,3", "-edges", ",",
                 "-reference", "1e-3", "-output", "solid")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert {row["study"] for row in rows(tmp_path / "solid.csv")} == {"solver", "layers", "springs"}
    with open(tmp_path / "solid_map.csv", newline="") as file:
        assert next(csv.reader(file))[3:] == ["layers: 2", "layers: 3", "springs: 2", "springs: 3"]
    draw(tmp_path, "solid")
    assert (tmp_path / "solid_map.png").stat().st_size > 10000


def test_runs_that_did_not_end_are_drawn_too(folder, tmp_path):
    """Without errors, for the reference was not reached, and without another study than solver."""
    unknown = dict.fromkeys(("error_mm", "skin_rms_mm", "skin_95_mm", "skin_max_mm"), "nan")
    for part in ("_map.csv", "_triangles.csv"):
        shutil.copy(folder / f"few{part}", tmp_path / f"nan{part}")
    with open(tmp_path / "nan_map.csv", newline="") as file:
        points = [row[:3] for row in csv.reader(file)]
    with open(tmp_path / "nan_map.csv", "w", newline="") as file:
        csv.writer(file).writerows(points)
    table = [row | unknown for row in rows(folder / "few.csv")]
    with open(tmp_path / "nan.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, table[0].keys())
        writer.writeheader()
        writer.writerows(table)
    draw(tmp_path, "nan")


def test_a_comma_leaves_a_study_out(run, tmp_path):
    result = run("repose-tradeoff", SCENE, "-methods", "ntr", "-accuracies", "1", "-load_steps", ",",
                 "-volumes", ",", "-layers", ",", "-edges", ",", "-output", "one")
    assert result.returncode == 0, result
    assert [row["study"] for row in rows(tmp_path / "one.csv")] == ["solver"]


@pytest.mark.parametrize("options, words", [
    (["-methods", "newton"], ["-methods newton", "'newton' is not one of", "lmvm"]),
    (["-accuracies", "1,x"], ["-accuracies 1,x", "'x'"]),
    (["-layers", "1"], ["-layers 1", "2 … 64"]),
    (["-load_steps", "2.5"], ["-load_steps", "whole number"])])
def test_bad_lists_are_refused_in_a_line(run, options, words):
    result = run("repose-tradeoff", SCENE, *options)
    assert result.returncode == 1 and len(result.stderr.splitlines()) == 1
    assert all(word in result.stderr for word in words), result.stderr


def test_depths_for_other_layers_are_refused(run, tmp_path):
    text = SCENE.read_text().replace("layers: 4 ", "depths: [0, 0.2, 0.5, 1]\n  layers: 4 ")
    for name in ("paper_skin.ply", "paper_skull.ply", "paper_mandible.ply"):
        shutil.copy(PROJECT / "meshes" / name, tmp_path)
    (tmp_path / "scene.yaml").write_text(text)
    result = run("repose-tradeoff", "scene.yaml", *FEW)
    assert result.returncode == 1 and "tissue.depths" in result.stderr


@pytest.mark.long
def test_models_of_other_layers_are_those_of_the_scene(run, tmp_path):
    """What landmarks add to a scene, a vestibule and the tone of the mouth, is in all models."""
    head = PROJECT / "meshes/head"
    done = run("repose-landmarks", f"{head}_skin.ply", "-skull", f"{head}_skull.ply", "-mandible",
               f"{head}_mandible.ply", "-output", "head")
    assert done.returncode == 0, done
    rest = []
    for layers in (2, 3):
        (tmp_path / f"face{layers}.yaml").write_text(
            f"skin: {head}_skin.ply\nbones:\n  - {{name: skull, file: {head}_skull.ply}}\n"
            f"  - {{name: mandible, file: {head}_mandible.ply}}\n"
            f"tissue: {{layers: {layers}}}\nanatomy: {{landmarks: head.mrk.json, tone: 0.3}}\n"
            "moves: [{bone: mandible, clinical: {set_back: 3}}]\n")
        done = run("repose-solve", f"face{layers}.yaml", "-accuracy", 1e-4)
        assert done.returncode == 0 and "vestibule by landmarks" in done.stdout, done
        skin = model_of(tmp_path / f"face{layers}.h5")["point/layer"] == 0
        rest.append(last(tmp_path / f"face{layers}.h5")["point/position"][skin])
    done = run("repose-tradeoff", "face2.yaml", "-methods", "ntr", "-accuracies", "0.001",
               "-load_steps", ",", "-volumes", ",", "-layers", "2,3", "-edges", ",", "-reference",
               "1e-5", "-output", "few")
    assert done.returncode == 0, done
    reference = [[float(row[axis]) for axis in "xyz"]
                 for row in rows(tmp_path / "few_map.csv")]
    assert np.abs(reference - rest[1]).max() < 1e-3
    found = rows(tmp_path / "few.csv")[0]
    true = np.linalg.norm(rest[0] - rest[1], axis=1)
    assert float(found["skin_rms_mm"]) == pytest.approx((true**2).mean()**0.5, rel=0.05)
    assert float(found["skin_max_mm"]) == pytest.approx(true.max(), rel=0.05)
