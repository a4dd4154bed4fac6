"""The benchmarks that write pages run, on their smallest settings, and their pages are whole."""

import csv
import importlib.util
import re
import sys

import pytest

from conftest import PROJECT, finish, programs


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
    assert count["Repose, L-BFGS from the stiffness"] < 1.5 * default


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
        error, told = float(row["error"]), float(row["estimate"])
        assert error <= told + 1e-9 and float(row["elsewhere"]) == 0, row
        assert row["interrupted"] or 1e-7 < told <= float(row["accuracy"]), row
        assert row["converged"] == "True" or row["interrupted"], row


def test_the_page_says_how_many(estimate):
    text = (estimate / "page.md").read_text()
    assert re.search(r"^\| \*\*all\*\* \| \d+ \| 0 \(0\.0%\) \|", text, re.M)


def test_the_picture_is_there(estimate):
    if not importlib.util.find_spec("matplotlib"):
        pytest.skip("matplotlib is not installed")
    assert (estimate / "estimate.png").read_bytes().startswith(b"\x89PNG")
