"""The page of the paper's experiments, made with small limits."""

import importlib.util
import re
import sys

import pytest

from conftest import PATIENCE, PROJECT, finish, runner

MESHES = PROJECT / "meshes"
QUICK = ["-layers", 2, "-limit", 1000, "-seconds", 0.3 * PATIENCE, "-path_seconds", 2 * PATIENCE]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, environment):
    top = tmp_path_factory.mktemp("paper")
    result = runner(top, environment)("repose-paper", "-meshes", MESHES, *QUICK, "-output", "page")
    assert (result.returncode, result.stderr) == (0, ""), result
    return top / "page"


def tables(text):
    """Each table of a page as rows of cells, heads and rules left out."""
    found = []
    for block in re.findall(r"(?:^\|.*\n)+", text, re.M):
        rows = [[cell.strip() for cell in line.strip("|").split("|")]
                for line in block.splitlines()]
        assert len({len(row) for row in rows}) == 1, block
        found.append(rows[2:])
    return found


def evaluations(cell):
    """Evaluations of a method that found the rest position, else None."""
    match = re.match(r"(\d+) · ", cell)
    return match and int(match[1])


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "paper.md").read_text(encoding="utf-8")


def verdicts(claims):
    """{title: verdict} of the claims."""
    return dict(re.findall(r"^\*\*(.+?)\*\* (Holds|Does not hold|Cannot be judged)\b", claims, re.M))


def test_table_1_is_the_papers(page):
    row = tables(page)[0][0]
    assert row[:4] == ["2", "954 (954)", "5881 (5881)", "874 (1748)"]
    assert all(0 < float(cell) < 100 * PATIENCE for cell in row[4:])


def test_energy_is_minimized(page):
    springs, volumes = tables(page)[1]
    assert (springs[:2], volumes[:2]) == (["f_e", "2"], ["f_e + f_v", "2"])
    *_, newton, default = springs
    assert 5 < evaluations(newton) < 100 and 5 < evaluations(default) < 200
    assert evaluations(springs[4]) < 300  # lmvm
    assert springs[2].startswith("> 1000")


def test_default_is_as_near_as_it_says(page):
    for row in tables(page)[1]:
        distance = re.search(r"ms \(([\d.e-]+) mm\)", row[-1])
        assert 0 < float(distance[1]) <= 0.1


def test_force_rows_and_motion_are_there(page):
    assert [row[0].rstrip(" *") for row in tables(page)[2]] == ["f_f", "f_f + f_v"]
    euler, runge_kutta = tables(page)[3]
    assert 50 < evaluations(euler[2]) < 1000 and euler[1].startswith("semi-implicit Euler")
    assert runge_kutta[1].startswith("Runge–Kutta")


def test_every_claim_has_a_verdict(page):
    claims = page.split("## The claims")[1].split("## Figures")[0]
    assert len(verdicts(claims)) == len(re.findall(r"^\*\*", claims, re.M)) == 7


def test_claims_without_converged_runs_are_not_judged(run, tmp_path):
    for limits in (["-limit", 5], ["-limit", 5, "-seconds", 0.01, "-path_seconds", 0.01]):
        result = run("repose-paper", "-meshes", MESHES, "-layers", 3, *limits)
        assert (result.returncode, result.stderr) == (0, ""), result
        claims = (tmp_path / "paper/paper.md").read_text(encoding="utf-8").split("## The claims")[1]
        assert "9223372036854775807" not in claims and "within  with" not in claims
        judged = [title for title, words in verdicts(claims).items() if words != "Cannot be judged"]
        assert judged == ["No preprocessing."], "the only one that needs no runs"


def test_what_the_pictures_need_is_written(folder):
    assert {path.name for path in folder.iterdir()} >= {
        "laws.csv", "equilibrium.csv", "opening.h5", "forward.h5", "turned.h5"}
    rows = (folder / "equilibrium.csv").read_text().splitlines()
    after = [max(abs(float(v)) for v in row.split(",")[6:9]) for row in rows[1:]]
    assert max(after) < 1e-6


def test_pictures_are_drawn(folder, environment):
    if not importlib.util.find_spec("matplotlib"):
        pytest.skip("matplotlib is not installed")
    script = PROJECT / "drivers/plot_paper.py"
    result = finish([sys.executable, str(script), str(folder)], folder, environment, 120)
    assert (result.returncode, result.stderr) == (0, ""), result
    for name in re.findall(r"\]\((paper_\w+\.png)\)", (folder / "paper.md").read_text()):
        assert (folder / name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("layers", ["1", "2,x", "", "65"])
def test_layers_that_are_none_are_refused(run, layers):
    result = run("repose-paper", "-meshes", MESHES, "-layers", layers)
    assert result.returncode == 1 and "-layers" in result.stderr
