"""Messages of every script in drivers if something is missing: one line, and what to do."""

import os
import shutil
import sys

import pytest

from conftest import PROJECT, TIME_LIMIT, finish, programs

SCRIPTS = {path.name: path for path in sorted((PROJECT / "drivers").glob("*.py"))}
SCRIPTS["Repose"] = PROJECT / "drivers/slicer/lib/run.py"
MODULES = ("h5py", "numpy", "matplotlib", "vtkmodules", "paraview")
ARGUMENTS = {"plot_incision.py": ["picture.png", "{}"], "plot_equilibrium.py": ["{}", "picture.png"],
             "plan.py": ["{}", "-operation", "jaw, 5 mm forward"], "weights.py": ["-bin", "."],
             "Repose": ["--skin", "skin.ply"]}
OPTIONAL = {("report.py", "matplotlib"),  # a page without pictures says what is missing
            ("paraview_repose.py", "h5py")}  # bones without names have numbers


def imported():
    """[(script, module that it needs)]"""
    needed = [(name, module) for name, path in SCRIPTS.items() for module in MODULES
              if any(f"{word} {module}" in path.read_text() for word in ("import", "from"))]
    return [pair for pair in needed if pair not in OPTIONAL]


@pytest.fixture
def script(tmp_path, environment):
    """script(name, *arguments, without=(…), settings={…}) → CompletedProcess."""

    def run(name, *arguments, without=(), settings=None):
        stubs = tmp_path / "stubs"
        stubs.mkdir(exist_ok=True)
        (stubs / "sitecustomize.py").write_text(
            f"import sys\nsys.modules.update(dict.fromkeys({list(without)}))\n")
        surroundings = environment | {"PYTHONPATH": str(stubs),
                                      "REPOSE_LIVE": str(programs() / "repose-live")}
        surroundings |= settings or {}
        return finish([sys.executable, "-B", str(SCRIPTS[name]), *map(str, arguments)], tmp_path,
                      surroundings, TIME_LIMIT)

    return run


def says(result, name, *parts):
    assert result.returncode == 1, result
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert result.stderr.startswith(f"{name}: "), result.stderr
    for part in parts:
        assert part in result.stderr, result.stderr


@pytest.mark.parametrize("name, module", imported())
def test_a_missing_module_is_one_line_that_says_what_to_install(script, solved, name, module):
    file = solved("paper_jaw_opening.yaml")
    arguments = [a.format(file) for a in ARGUMENTS.get(name, ["{}"])]
    result = script(name, *arguments, without=[module])
    says(result, name, "install ")


@pytest.mark.parametrize("name", SCRIPTS.keys() - {"paraview_repose.py"})
def test_a_missing_file_is_one_line(script, name):
    arguments = [a.format("none.h5") for a in ARGUMENTS.get(name, ["none.h5"])]
    says(script(name, *arguments), name)


def test_springs_are_named_where_a_result_has_none(script, solved):
    pytest.importorskip("matplotlib")
    solid = solved("head_incision.yaml")
    says(script("plot_equilibrium.py", solid, "picture.png"), "plot_equilibrium.py",
         "tissue.springs")


# ----- ParaView, played by modules of its names


SIMPLE = """import sys
from unittest.mock import MagicMock
simple = sys.modules[__name__] = MagicMock(GetParaViewVersion=lambda: {version})
for source in (simple.XDMFReader, simple.WarpByVector):
    source.return_value.GetDataInformation.return_value.GetBounds.return_value = (0, 1) * 3
"""


@pytest.fixture
def paraview(script, solved, tmp_path):
    """paraview(version, windows, DISPLAY) → what the script does under such a ParaView."""

    def run(version, windows, display):
        stubs = tmp_path / "stubs"
        for module, text in (("paraview/simple", SIMPLE.format(version=version)),
                             ("vtkmodules/vtkRenderingOpenGL2", f"{windows} = None\n")):
            (stubs / module).parent.mkdir(parents=True, exist_ok=True)
            (stubs / (module.split("/", maxsplit=1)[0] + "/__init__.py")).write_text("")
            (stubs / f"{module}.py").write_text(text)
        name = solved("paper_jaw_opening.yaml").with_suffix("")
        return script("paraview_repose.py", name, "look.png", settings={"DISPLAY": display})

    return run


@pytest.mark.parametrize("display", ["", ":4711"])
def test_paraview_without_a_display_is_told_of_xvfb(paraview, display):
    says(paraview(5.11, "vtkXOpenGLRenderWindow", display), "paraview_repose.py",
         "no display", "xvfb-run -a pvpython", "look.png")


@pytest.mark.parametrize("version, windows", [(5.11, "vtkEGLRenderWindow"),
                                              (6.0, "vtkXOpenGLRenderWindow")])
def test_a_paraview_that_needs_no_display_draws(paraview, version, windows):
    result = paraview(version, windows, "")
    assert (result.returncode, result.stderr) == (0, ""), result


def test_real_paraview_without_a_display(solved, tmp_path, environment):
    if not shutil.which("pvpython"):
        pytest.skip("ParaView is not installed (python3-paraview)")
    surroundings = {name: value for name, value in environment.items() if name != "DISPLAY"}
    name = solved("paper_jaw_opening.yaml").with_suffix("")
    result = finish(["pvpython", str(SCRIPTS["paraview_repose.py"]), str(name), "look.png"],
                    tmp_path, surroundings, TIME_LIMIT)
    drawn = result.returncode == 0 and os.path.isfile(tmp_path / "look.png")
    assert drawn or "xvfb-run" in result.stderr, result
