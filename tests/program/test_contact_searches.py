"""Every search keeps tissue out of what it touches, or the program refuses it: each pair of the
features that choose a search, with a ball that is pushed into a cheek."""

import itertools

import numpy as np
import pytest

from conftest import PROJECT, runner
from tissue import as_springs, last, model_of

CENTER, RADIUS = np.array([54, -86, -10]), 20  # mm, of the ball at the end of its push
DEEPEST = 0.1  # mm
SCENE = as_springs((PROJECT / "meshes/head_instrument.yaml").read_text()).replace(
    "stiffness: 1.0", "modulus: 0.05").replace("head_", f"{PROJECT}/meshes/paper_").replace(
    "sphere: {center: [57, -90, -10], radius: 10}",
    "skin: slide, sphere: {center: [63, -98, -10], radius: 20}").replace(
    "tissue:", "tissue:\n  density: 1.0e-6", 1)
# name: (options, lines of the scene); features of one group exclude one another
GROUPS = [
    {"force": (["-functional", "force"], "")},
    {kind: (["-tao_type", kind], "") for kind in ("ntr", "lmvm", "cg", "nls")},
    {form: (["-volume", form], "") for form in ("none", "paper")},
    {"steps": (["-load_steps", "3"], "")},
    {"restart": (["-restart", "first.h5"], "")},
    {"weight": ([], "gravity: [0, 0, -9.80665]\n")},
    {"ranks": ([], "")},
]
PAIRS = [(one, other) for a, b in itertools.combinations(GROUPS, 2) for one in a for other in b]
QUICK = {("force", "steps"), ("ntr", "none"), ("lmvm", "restart"), ("cg", "weight"), ("nls", "ranks"),
         ("paper", "steps")}  # every feature once
REFUSED = {"force": "functional force"}


@pytest.mark.quick
def test_the_quick_pairs_hold_every_feature():
    assert QUICK <= set(PAIRS)
    assert {name for pair in QUICK for name in pair} == {name for group in GROUPS for name in group}


@pytest.fixture(scope="module")
def folder(tmp_path_factory, environment):
    """With the result of a first load step, to restart from."""
    top = tmp_path_factory.mktemp("searches")
    (top / "first.yaml").write_text(SCENE)
    done = runner(top, environment)("repose-solve", "first.yaml")
    assert (done.returncode, done.stderr) == (0, ""), done
    return top


@pytest.mark.parametrize("pair", [
    pytest.param(pair, id="-".join(pair), marks=[] if pair in QUICK else pytest.mark.long) for pair in PAIRS])
def test_a_search_that_ends_well_has_kept_tissue_out(folder, environment, pair):
    run = runner(folder, environment)
    features = {name: of for group in GROUPS for name, of in group.items()}
    name = "-".join(pair)
    lines = "".join(features[one][1] for one in pair)
    (folder / f"{name}.yaml").write_text(SCENE.replace("tissue:", f"{lines}tissue:", 1))
    options = [option for one in pair for option in features[one][0]]
    done = run("repose-solve", f"{name}.yaml", "-accuracy", 0.01, *options,
               ranks=2 if "ranks" in pair else 1)
    refused = [words for one, words in REFUSED.items() if one in pair]
    if refused:
        assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done
        assert any(words in done.stderr for words in refused), done.stderr
        return
    assert done.returncode in (0, 2), done
    if done.returncode == 2:
        return
    step, model = last(folder / f"{name}.h5"), model_of(folder / f"{name}.h5")
    assert step["penetration"] <= DEEPEST and step["penetration_exact"] <= DEEPEST
    skin = model["point/layer"] == 0
    apart = np.linalg.norm(step["point/position"][skin] - CENTER, axis=1)
    assert apart.min() >= RADIUS - DEEPEST
    checked = run("repose-check", f"{name}.h5")
    assert (checked.returncode, checked.stderr) == (0, ""), checked
