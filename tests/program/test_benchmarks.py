"""The benchmarks that write pages run, on their smallest settings, and their pages are whole."""

import csv
import importlib.util
import re
import sys

import numpy as np
import pytest

from conftest import PROJECT, can_draw, finish, programs
from tissue import last, model_of, prism_volumes

sys.path.append(str(PROJECT / "tests/benchmark"))

METHODS = "default,default_end,stiffness,stiffness_step,lmvm,polak_ribiere,liblbfgs,L-BFGS-B"


def run_script(name, folder, environment, *options):
    command = [sys.executable, str(PROJECT / "tests/benchmark" / name), "-bin", str(programs()),
               *map(str, options)]
    return finish(command, folder, environment, 300)


@pytest.fixture(scope="module")
def contest(tmp_path_factory, environment):
    """Cells of the rows of the contest's page, by the method's name."""
    for package in ("scipy", "numpy", "h5py"):
        pytest.importorskip(package)
    folder = tmp_path_factory.mktemp("contest")
    result = run_script("contest.py", folder, environment, "-cases", "forward", "-rounds", 1,
                        "-accuracy", 0.5, "-methods", METHODS, "-output", folder / "page.md")
    assert (result.returncode, result.stderr) == (0, ""), result
    rows = re.findall(r"^\| (.+?) \|(.*)\|$", (folder / "page.md").read_text(), re.M)
    return {name: [cell.strip() for cell in cells.split("|")] for name, cells in rows}


def evaluations(row):
    return int(row[0].split()[0])


def test_every_method_comes_to_rest(contest):
    ends = {name: row for name, row in contest.items() if row[-1].endswith(" mm")}
    if len(ends) == 7 and not any(name.startswith("liblbfgs") for name in ends):
        pytest.skip("liblbfgs is not built in: apt-get install liblbfgs-dev")
    assert len(ends) == 8, ends
    own = [row for name, row in ends.items() if "own estimate" not in name]
    assert all(float(row[-1].split()[0]) <= 0.5 and evaluations(row) > 2 for row in own)


def test_counts_are_in_their_order(contest):
    count = {name: evaluations(row) for name, row in contest.items() if row[-1].endswith(" mm")}
    default = count["**Repose**, its default"]
    assert default < count["Repose `-tao_type lmvm`, no load steps"]
    assert default < count["SciPy L-BFGS-B, NumPy kernel"]
    assert 10 * default < count["the paper's: Polak–Ribière, Brent"]
    hessians, factors, actions, applied = map(int, contest["**Repose**, its default"][1].split(","))
    assert 0 < factors <= hessians < min(default, actions) and actions <= applied
    assert count["Repose, L-BFGS from the stiffness"] < 2 * default


def test_goals_have_verdicts(contest):
    verdicts = [row[0] for name, row in contest.items() if "goal" in name]
    assert len(verdicts) == 4 and all(re.search("reached|missed|not", row) for row in verdicts)


def test_a_missing_case_is_refused(environment, tmp_path):
    pytest.importorskip("scipy")
    result = run_script("contest.py", tmp_path, environment, "-cases", "sideways")
    assert result.returncode == 2 and "sideways: choose from" in result.stderr


@pytest.fixture(scope="module")
def estimate(tmp_path_factory, environment):
    """Folder of the study's page, its picture and its rows."""
    for package in ("numpy", "h5py"):
        pytest.importorskip(package)
    folder = tmp_path_factory.mktemp("estimate")
    result = run_script("estimate.py", folder, environment, "-few", "-seeds", 1, "-rows",
                        folder / "rows.csv", "-output", folder / "page.md", "-picture",
                        folder / "estimate.png")
    assert (result.returncode, result.stderr) == (0, ""), result
    return folder


def test_estimates_of_a_few_runs(estimate):
    with open(estimate / "rows.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["solver"] for row in rows} == {"ntr", "lmvm"} and len(rows) == 6
    for row in rows:
        error, report = float(row["error"]), float(row["estimate"])
        assert error <= report + 1e-9 and float(row["elsewhere"]) == 0, row
        assert row["interrupted"] or 1e-7 < report <= float(row["accuracy"]), row
        assert row["converged"] == "True" or row["interrupted"], row


def test_the_page_says_how_many(estimate):
    text = (estimate / "page.md").read_text()
    assert re.search(r"^\| \*\*all\*\* \| \d+ \| 0 \(0\.0%\) \|", text, re.M)


def test_the_picture_is_there(estimate):
    if not importlib.util.find_spec("matplotlib"):
        pytest.skip("matplotlib is not installed")
    assert (estimate / "estimate.png").read_bytes().startswith(b"\x89PNG")


FORWARD = """skin: {meshes}/paper_skin.ply
bones:
  - {{name: skull, file: {meshes}/paper_skull.ply}}
  - {{name: mandible, file: {meshes}/paper_mandible.ply}}
tissue: {{layers: 4}}
boundary: {{rim: fixed}}
contact: {{bones: off, cuts: off}}
moves: [{{bone: mandible, translate: [0, -3, 0]}}]
"""


@pytest.mark.parametrize("layers", [1, 2])
def test_a_halved_model_is_the_same_body(run, environment, tmp_path, layers):
    (tmp_path / "scene.yaml").write_text(FORWARD.format(meshes=PROJECT / "meshes"))
    assert run("repose-solve", "scene.yaml", "-output", "whole").returncode == 0
    halving = run_script("halve.py", tmp_path, environment, "whole.h5", "m.h5", "-layers", layers)
    assert (halving.returncode, halving.stderr) == (0, ""), halving
    assert run("repose-solve", "m.h5", "-output", "half").returncode == 0
    one, other = (model_of(tmp_path / f"{name}.h5") for name in ("whole", "half"))
    parts = [prism_volumes(m["point/position"], m["prism/points"])[0] for m in (one, other)]
    assert parts[1].min() > 0 and len(parts[1]) == 4 * layers * len(parts[0])
    assert parts[1].reshape(len(parts[0]), -1).sum(1) == pytest.approx(parts[0], rel=1e-12)
    skin = [m["point/layer"] == 0 for m in (one, other)]
    moved = [last(tmp_path / f"{name}.h5")["point/displacement"] for name in ("whole", "half")]
    count = skin[0].sum()
    apart = np.linalg.norm(moved[0][skin[0]] - moved[1][skin[1]][:count], axis=1)
    assert 0.02 < apart.mean() < 0.1 * np.linalg.norm(moved[0][skin[0]], axis=1).mean()


@pytest.mark.quick
def test_the_page_of_plans_holds_the_operations_and_what_runs_print():
    import plans
    page = (PROJECT / "docs/start/from_ct.md").read_text()
    for mark, _, operations in plans.HEADS.values():
        table = page.partition(f"<!-- {mark} -->\n\n{plans.HEAD}\n")[2].partition(f"\n<!-- end of {mark} -->\n")[0]
        assert re.findall(r"^\| (.+?) \| 0 \| [A-Z]", table, re.M) == operations
    summary = ["Chin 4.9 mm back; nose 0.3 mm down; largest movement 5.1 mm (at (1, 2, 3)). Within 0.02 mm of rest.",
               "  warning                bones 'skull' and 'jaw' end 3.0 mm inside one another; repose-collide …",
               "  accuracy               0.0216 mm reached, 0.1 mm requested",
               "  pierced by bone        2 prisms", "  pierced by bone        3 columns"]
    assert plans.row_of("jaw, 5 mm back", 0, summary) == \
        "| jaw, 5 mm back | 0 | Chin 4.9 mm back; nose 0.3 mm down | bones 'skull' and 'jaw' end 3.0 mm inside one " \
        "another; *pierced by bone* |"


def test_the_cookbook_holds_its_recipes(environment, tmp_path):
    page, count = tmp_path / "page.md", r"\| (\d+) \| (\d+) \| (\d+) \| ([\d.]+) \|"
    page.write_text("<!-- measured -->\n<!-- end of measured -->\nrest\n")
    result = run_script("cookbook.py", tmp_path, environment, "-scenes", "paper_jaw_advance",
                        "-recipes", ";-accuracy 0.000001", "-output", page)
    assert (result.returncode, result.stderr) == (0, ""), result
    rows = re.findall(r"^\| (.+?) " + count, page.read_text(), re.M)
    assert [row[0] for row in rows] == ["none", "`-accuracy 0.000001`"]
    assert page.read_text().endswith("rest\n") and rows[0][4] == "1"
    assert all(int(more) > int(few) > 0 for few, more in zip(rows[0][1:4], rows[1][1:4]))
    script = (PROJECT / "tests/benchmark/cookbook.py").read_text()
    recipes = re.findall(r'"(-[^"]*)"', script.partition("RECIPES = [")[2].partition("]\n")[0])
    guide = (PROJECT / "docs/guide/solver.md").read_text()
    assert [row[0] for row in re.findall(r"^\| `(.+?)` " + count, guide, re.M)] == recipes


def test_ratios_of_a_mirrored_head_are_those_of_the_head(environment, tmp_path):
    for package in ("scipy", "meshio", "h5py"):
        pytest.importorskip(package)
    found = []
    result = run_script("ratios.py", tmp_path, environment, "-phantoms", 1, "-edge", 4, "-ways", "default",
                        "-operations", "chin", "-keep", "kept")
    assert (result.returncode, "error" in result.stderr) == (0, False), result
    found.append(float(re.findall(r"^\| chin 8 .*$", result.stdout, re.M)[0].split("|")[4]))
    result = run_script("ratios.py", tmp_path, environment, "-head", "kept/phantom_1", "-edge", 4, "-ways",
                        "default", "-operations", "chin", "-variants", "mirrored;yaw 5;landmarks ± 1")
    assert (result.returncode, "error" in result.stderr) == (0, False), result
    row, = re.findall(r"^\| chin 8 .*$", result.stdout, re.M)
    found += [float(cell.strip(" *")) for cell in row.split("|")[4:7]]
    given, mirrored, turned, noisy = found
    assert 0.6 < given < 1
    assert max(abs(mirrored - given), abs(turned - given)) < 0.05 and abs(noisy - given) < 0.1



def test_ratios_of_synthetic_heads_and_their_pictures(environment, tmp_path):
    for package in ("scipy", "meshio", "h5py", "vtkmodules"):
        pytest.importorskip(package)
    if not can_draw():
        pytest.skip("VTK cannot draw here")
    (tmp_path / "page.md").write_text("<!-- phantoms -->\n<!-- end of phantoms -->\n")
    result = run_script("ratios.py", tmp_path, environment, "-phantoms", 1, "-edge", 4, "-ways",
                        "default", "-operations", "impaction", "-keep", "kept", "-output", "page.md")
    assert (result.returncode, result.stderr) == (0, ""), result
    row, = re.findall(r"^\| impaction 4 .*$", (tmp_path / "page.md").read_text(), re.M)
    median, ends, outside = (cell.strip() for cell in row.split("|")[4:7])
    assert ends == f"{median} … {median}" and 0.2 < float(median) < 0.7
    assert outside in ("0, 0 of 1", "0, 1 of 1")
    result = finish([sys.executable, PROJECT / "tests/benchmark/ratios_picture.py", "kept/phantom_1",
                     "pictures"], tmp_path, environment, 60)
    assert result.returncode == 0, result
    assert (tmp_path / "pictures/impaction.png").stat().st_size > 50_000
