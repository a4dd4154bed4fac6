"""Messages of every script in drivers if something is missing, wrong or damaged: one line, and what to do."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest

from conftest import PROJECT, TIME_LIMIT, can_draw, finish, programs

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
        path = os.pathsep.join([str(stubs), *filter(None, [environment.get("PYTHONPATH")])])
        surroundings = environment | {"PYTHONPATH": path,
                                      "REPOSE_LIVE": str(programs() / "repose-live")}
        surroundings |= settings or {}
        return finish([sys.executable, "-B", str(SCRIPTS[name]), *map(str, arguments)], tmp_path,
                      surroundings, TIME_LIMIT)

    return run


def require_matplotlib(name):
    """Skips a test of a script that draws where Matplotlib is missing."""
    if "import matplotlib" in SCRIPTS[name].read_text():
        pytest.importorskip("matplotlib")


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
    with_paraview = ("render.py", "paraview_repose.py") if shutil.which("pvbatch") else ("paraview_repose.py",)
    says(result, name, "install ", *([] if name in ("plan.py", *with_paraview) else [sys.executable]))


@pytest.mark.skipif(not os.path.exists("/usr/bin/python3"), reason="no Python of the system")
def test_a_python_that_apt_does_not_serve_is_told_of_the_one_that_it_does(script, solved, tmp_path):
    python = tmp_path / "python3"
    shutil.copy(sys.executable, python)
    names = "import sys; sys.path.insert(0, sys.argv[1]); sys.argv[0] = 'report.py'; from sheet.script import *; "
    result = finish([python, "-c", f"{names} refuse_missing(ImportError(name='numpy'), 'apt-get install')",
                     PROJECT / "drivers"], tmp_path, os.environ, TIME_LIMIT)
    says(result, "report.py", f"numpy is missing in {python}: apt-get install; ", "/usr/bin/python3 report.py")


@pytest.mark.parametrize("name", SCRIPTS.keys() - {"paraview_repose.py"})
def test_a_missing_file_is_one_line(script, name):
    arguments = [a.format("none.h5") for a in ARGUMENTS.get(name, ["none.h5"])]
    says(script(name, *arguments), name)


FOLDERS = {name: (["folder"], "folder") for name in ("report.py", "render.py", "map.py", "live.py", "proposal.py")}
FOLDERS |= {"scene of report.py": (["r", "-scene", "folder"], "folder"),
            "scene of render.py": (["r", "-scene", "folder"], "-scene folder"),
            "ending of report.py": (["folder/r"], "folder/r.h5"),
            "weights.py": (["folder", "-bin", "."], "./repose-solve")}


@pytest.mark.quick
@pytest.mark.parametrize("case", FOLDERS)
def test_a_folder_in_place_of_a_file_is_named_as_one(script, result, tmp_path, case):
    (tmp_path / "folder/r.h5").mkdir(parents=True)
    (tmp_path / "repose-solve").mkdir()
    (arguments, file), name = FOLDERS[case], case.split()[-1]
    says(script(name, *arguments), name, f"{name}: {file}: is a folder; ")


@pytest.mark.quick
def test_springs_are_named_where_a_result_has_none(script, solved):
    pytest.importorskip("matplotlib")
    solid = solved("head_incision.yaml")
    says(script("plot_equilibrium.py", solid, "picture.png"), "plot_equilibrium.py",
         "tissue.springs")


def test_a_result_without_initial_forces_is_refused(script, solved, tmp_path):
    pytest.importorskip("matplotlib")
    says(script("plot_equilibrium.py", solved("paper_jaw_advance.yaml"), "picture.png"), "plot_equilibrium.py",
         "no forces to draw: its skin has neither tension nor weight")
    assert not (tmp_path / "picture.png").exists()


def test_a_table_without_rows_is_refused(script, tmp_path):
    pytest.importorskip("matplotlib")
    (tmp_path / "study.csv").write_text("study,method\n")
    says(script("plot_tradeoff.py", "study"), "plot_tradeoff.py", "study.csv: has no rows")
    for name in ("laws.csv", "equilibrium.csv", "opening.h5", "forward.h5", "turned.h5"):
        (tmp_path / name).write_text("s,linear\n")
    says(script("plot_paper.py", "."), "plot_paper.py", "laws.csv: has no rows")


TRADEOFF = {
    "study.csv": ("study,method,accuracy_mm,volume,load_steps,layers,edge_mm,converged,cpu_s,evaluations,estimate_mm,"
                  "error_mm,skin_rms_mm,skin_95_mm,skin_max_mm,reason\n" +
                  'layers,ntr,0.1,none,auto,4,0,1,0.2,9,0.01,0.002,nan,0.3,0.4,"a, b"\n' * 2),
    "study_map.csv": 'x,y,z,"layers: 4"\n0,0,0,0.1\n1,0,0,0.2\n0,0,1,0.3\n',
    "study_triangles.csv": "a,b,c\n0,1,2\n"}


@pytest.mark.parametrize("file, old, new, part", [
    ("study.csv", "", "", None), ("study.csv", "study,", "way,", "it has no column study"),
    ("study.csv", "method", "x", "no column method"), ("study.csv", "converged", "x", "no column converged"),
    ("study.csv", "layers,edge", "x,edge", "no column layers"), ("study.csv", ',"a, b"', "", "row 1 does not have 16 values"),
    ("study.csv", "0.2,9,", "x,9,", "row 1 of column cpu_s holds 'x', no finite number from 0"),
    ("study.csv", "0.2,9,", "0,9,", None), ("study.csv", "4,0,1,", "4,0,yes,", "no whole number from 0 to 1"),
    ("study.csv", "0.002", "-1", "'-1', no finite number from 0"), ("study.csv", "0.002", "nan", None),
    ("study.csv", '"a, b"', '"' + "a" * 200_000 + '"', "line 2: field larger"),
    ("study_map.csv", "\n0,0,0,0.1\n1,0,0,0.2\n0,0,1,0.3", "", "has no rows"),
    ("study_map.csv", "x,y", "x,w", "it has no column y"), ("study_map.csv", "1,0,0,0.2", "1,0,0", "row 2 does not have 4"),
    ("study_map.csv", "0.3", "x", "row 3 of column layers: 4 holds 'x', no finite number from 0"),
    ("study_map.csv", "0,0,1,", "0,0,nan,", "row 3 of column z holds 'nan', no finite number"),
    ("study_triangles.csv", "0,1,2\n", "", "has no rows"), ("study_triangles.csv", "2", "x", "row 1 of column c holds 'x'"),
    ("study_triangles.csv", "2", "3", "row 1 of column c holds '3', no whole number from 0 to 2"),
    ("study_triangles.csv", "2", "-1", "no whole number from 0 to 2"), ("study_triangles.csv", "2", "1.5", "no whole number"),
    ("study_triangles.csv", "0,1,2\n", "0\n", "row 1 does not have 3 values")])
def test_a_damaged_table_of_a_study_is_refused(script, tmp_path, file, old, new, part):
    pytest.importorskip("matplotlib")
    for name, text in TRADEOFF.items():
        (tmp_path / name).write_text(text.replace(old, new, 1) if name == file else text)
    done = script("plot_tradeoff.py", "study")
    if part:
        says(done, "plot_tradeoff.py", f"{file}: ", part)
    else:
        assert (done.returncode, done.stderr) == (0, ""), done
        assert (tmp_path / "study_map.png").exists()


# ----- programs that scripts start


@pytest.mark.quick
def test_a_loop_of_the_shell_keeps_its_lines(tmp_path, environment):
    loop = f"""printf 'a\nb\n' | while read -r line; do echo "$line"
        {sys.executable} -B -c 'from sheet.script import start; start("cat")'
    done"""
    done = finish(["bash", "-c", loop], tmp_path, environment | {"PYTHONPATH": str(PROJECT / "drivers")}, TIME_LIMIT)
    assert (done.stdout, done.stderr) == ("a\nb\n", "")


@pytest.mark.quick
def test_no_script_gives_a_program_its_own_standard_input():
    starts = {".py": r"subprocess\.(?:run|Popen|call|check_\w+)\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)",
              ".sh": r"(?m)^ *mpirun .*", ".slurm": r"(?m)^ *srun .*"}
    calls = [(path.name, call) for path in (PROJECT / "drivers").rglob("*.*") if path.suffix in starts
             for call in re.findall(starts[path.suffix], path.read_text())]
    assert len(calls) == 6 and [name for name, call in calls if not re.search("stdin=|</dev/null", call)] == [], calls


# ----- arguments

OWN = sorted(SCRIPTS.keys() - {"paraview_repose.py", "plan.py", "Repose"})


@pytest.mark.parametrize("name", [*OWN, "figures.sh", "demo.sh"])
def test_help_is_printed_and_nothing_is_done(script, environment, tmp_path, name):
    for word in ("-h", "-help", "--help"):
        result = script(name, word, without=MODULES) if name in SCRIPTS else \
            finish([PROJECT / "drivers" / name, word], tmp_path, environment, TIME_LIMIT)
        assert (result.returncode, result.stderr) == (0, ""), result
        assert len(result.stdout.splitlines()) > 4
    assert not [path for path in tmp_path.iterdir() if path.name != "stubs"]


@pytest.mark.parametrize("name", OWN)
def test_wrong_arguments_are_one_line(script, name):
    for arguments in (["-nonsense"], [], [""]):
        if (name, arguments) != ("weights.py", []):
            says(script(name, *arguments), name)


@pytest.mark.parametrize("arguments, part", [
    (["-port", "-1"], "-port: -1: must be a whole number from 0 to 65535"),
    (["-port", "99999"], "must be a whole number from 0 to 65535"), (["-ranks", "0"], "-ranks: 0: must be a whole number from 1"),
    (["-ranks", "x"], "-ranks: x: must be a whole number from 1"), (["-ranks", "1.5"], "-ranks: 1.5: must be a whole number from 1")])
def test_numbers_out_of_range_are_refused(script, arguments, part):
    says(script("live.py", PROJECT / "meshes/head_live.yaml", "-no_browser", *arguments), "live.py", part)


@pytest.mark.parametrize("option, value, limits", [
    ("-level", "nan", "from -32768 to 65535"), ("-bone", "inf", "from -32768 to 65535"), ("-edge", "-4", "from 1 to 20"),
    ("-edge", "nan", "from 1 to 20"), ("-edge", "4,5", "from 1 to 20"), ("-level", "4 mm", "from -32768 to 65535")])
def test_numbers_out_of_range_are_refused_before_a_folder_is_made(script, tmp_path, option, value, limits):
    volume = tmp_path / "head.mhd"
    volume.touch()
    result = script("plan.py", volume, "-operation", "jaw, 5 mm forward", option, value)
    says(result, "plan.py", f"argument {option}: {value}: must be a number {limits}")
    assert not (tmp_path / "plan").exists()


def test_a_level_of_bone_below_the_skin_is_refused_at_once(script, tmp_path):
    for name in ("ct.mhd", "labels.nii", "head.seg.nrrd"):
        (tmp_path / name).touch()
    for levels in (["-level", 724], ["-bone", -300], ["-level", 100, "-bone", 50]):
        says(script("plan.py", "ct.mhd", "-operation", "jaw, 5 mm forward", *levels), "plan.py", f"{levels[-1]}",
             "the skin's level must be below that of bone")
    says(script("plan.py", "ct.mhd", "-operation", "jaw, 5 mm forward", "-level", 724), "plan.py", "-level 724 -bone 1250")
    assert not (tmp_path / "plan").exists()
    for volumes in (["ct.mhd", "labels.nii"], ["head.seg.nrrd"]):
        assert "level" not in script("plan.py", *volumes, "-operation", "jaw, 5 mm forward", "-level", 724).stderr


def test_a_file_in_place_of_the_folder_of_a_plan_is_refused(script, tmp_path):
    for name in ("head.mhd", "plan"):
        (tmp_path / name).touch()
    says(script("plan.py", "head.mhd", "-operation", "jaw, 5 mm forward"), "plan.py",
         "-output plan: is a file, not a folder; choose another name")


@pytest.mark.parametrize("folder, part", [("/proc/x", "-output /proc/x: cannot be made: "),
                                          ("/proc", "/proc/scene.yaml: cannot be written: ")])
def test_a_folder_of_a_plan_that_cannot_be_written_is_refused_with_a_remedy(script, tmp_path, folder, part):
    (tmp_path / "head.mhd").touch()
    refused = script("plan.py", "head.mhd", "-operation", "jaw, 5 mm forward", "-output", folder)
    says(refused, "plan.py", part, "; choose another ")


def test_an_option_given_twice_is_named_with_both_values(script, solved, tmp_path):
    result = script("report.py", solved("paper_jaw_opening.yaml"), "-output", "a.html", "-output", "b.html")
    assert result.returncode == 0 and (tmp_path / "b.html").exists() and not (tmp_path / "a.html").exists()
    assert result.stderr == ("report.py: warning: option -output is given several times: b.html is used, not a.html; "
                             "give it once\n")


@pytest.mark.quick
def test_a_solver_that_is_not_there_is_named(script):
    says(script("live.py", PROJECT / "meshes/head_live.yaml", settings={"REPOSE_LIVE": "bin/none"}), "live.py",
         "bin/none: no such program; set REPOSE_LIVE")


# ----- inputs are kept


def linked(file, name):
    """Another name of a file."""
    os.link(file, file.with_name(name))
    return name


@pytest.fixture
def result(solved, tmp_path):
    shutil.copy(solved("paper_jaw_opening.yaml"), tmp_path / "r.h5")
    return tmp_path / "r.h5"


@pytest.fixture
def scene(tmp_path):
    for file in PROJECT.glob("meshes/head*"):
        (tmp_path / file.name).symlink_to(file)
    (tmp_path / "head_live.yaml").unlink()
    return shutil.copy(PROJECT / "meshes/head_live.yaml", tmp_path)


REPLACED = {"report.py": (["r", "-output"], ".html"), "render.py": (["r", "-output"], ".png"),
            "plot_incision.py": (["{}", "r.h5"], ".png"), "plot_equilibrium.py": (["r.h5"], ".png")}


@pytest.mark.parametrize("name", REPLACED)
def test_a_script_does_not_replace_the_result_that_it_reads(script, result, name):
    require_matplotlib(name)
    arguments, ending = REPLACED[name]
    content = result.read_bytes()
    for target, part in (("r.h5", "does not end in " + ending), (linked(result, "r" + ending), "is an input")):
        words = [word.format(target) for word in arguments]
        says(script(name, *words, *([] if "{}" in arguments else [target])), name, target, part)
        assert result.read_bytes() == content


@pytest.mark.parametrize("name, ending", [("map.py", ".html"), ("proposal.py", ".png")])
def test_a_script_does_not_replace_the_scene_that_it_reads(script, scene, tmp_path, name, ending):
    content = (tmp_path / "head_live.yaml").read_bytes()
    for target, part in (("head_live.yaml", "does not end in " + ending),
                         (linked(tmp_path / "head_live.yaml", "page" + ending), "is an input")):
        says(script(name, "head_live.yaml", "-output", target), name, target, part)
        assert (tmp_path / "head_live.yaml").read_bytes() == content


def test_a_page_without_a_mark_is_not_filled(script, tmp_path):
    (tmp_path / "page.md").write_text("a page\n")
    says(script("weights.py", "-bin", programs(), "-output", "page.md"), "weights.py", "<!-- measured -->")
    assert (tmp_path / "page.md").read_text() == "a page\n"


# ----- damaged files


def set_rows(h5):
    h5["model/skin/points"][0] = [0, 1, 10_000_000]


def set_negative_rows(h5):
    h5["model/skin/points"][0] = [0, 1, -1]


def set_positions(h5):
    h5["step"][sorted(h5["step"])[-1]]["point/position"][5] = np.nan


def remove_model(h5):
    del h5["model/point"]


DRAWN = {"report.py": ["r.h5"], "render.py": ["r.h5"], "plot_incision.py": ["picture.png", "r"],
         "plot_equilibrium.py": ["r", "picture.png"]}


@pytest.mark.parametrize("damage", [set_rows, set_negative_rows, set_positions, remove_model])
@pytest.mark.parametrize("name", DRAWN)
def test_a_damaged_result_is_refused(script, result, name, damage):
    require_matplotlib(name)
    if name == "render.py" and not can_draw():
        pytest.skip("no VTK")
    if name == "plot_equilibrium.py":  # reads springs, of the initial position
        damage = {set_rows: lambda h5: h5["model/spring/points"].__setitem__(0, [0, 10_000_000]),
                  set_negative_rows: lambda h5: h5["model/spring/points"].__setitem__(0, [0, -1]),
                  set_positions: lambda h5: h5["model/point/position"].__setitem__(5, np.nan)}.get(damage, damage)
    with h5py.File(result, "r+") as h5:
        damage(h5)
    says(script(name, *DRAWN[name]), name, "r.h5: damaged, or not a result")


@pytest.mark.parametrize("name", DRAWN)
def test_a_truncated_or_foreign_result_is_refused(script, result, name):
    require_matplotlib(name)
    if name == "render.py" and not can_draw():
        pytest.skip("no VTK")
    content = result.read_bytes()
    result.write_bytes(content[:len(content) // 2])
    says(script(name, *DRAWN[name]), name, "r.h5: ")
    with h5py.File(result, "w") as h5:
        h5["numbers"] = [1, 2]
    says(script(name, *DRAWN[name]), name, "r.h5: ")


@pytest.mark.parametrize("option, file, content", [
    ("-landmarks", "null.json", b"null"), ("-landmarks", "deep.json", b"[" * 100_000),
    ("-scene", "scene.yaml", b"skin: \xff\xfe.ply\n"), ("-norms", "deep.json", b"[" * 100_000),
    ("-skin", "skin.ply", b"ply\nformat ascii 1.0\nelement vertex x\nend_header\n")],
    ids=["null landmarks", "nested landmarks", "scene", "norms", "skin"])
def test_files_beside_a_result_that_are_damaged_are_refused(script, result, option, file, content):
    result.with_name(file).write_bytes(content)
    says(script("report.py", "r", option, file), "report.py", f"{file}: ")


@pytest.mark.parametrize("content", [b"", b"[" * 10_000, b"\x00\xff", b"- 3\n"],
                         ids=["empty", "nested", "binary", "list"])
def test_what_is_no_scene_is_refused(script, tmp_path, content):
    (tmp_path / "scene.yaml").write_bytes(content)
    if can_draw():
        says(script("proposal.py", "scene.yaml"), "proposal.py", "scene.yaml: ")
    for name in ("map.py", "live.py"):
        says(script(name, "scene.yaml"), name, "scene.yaml")


@pytest.mark.parametrize("name", ["map.py", "live.py"])
def test_a_result_in_place_of_a_scene_is_refused(script, result, name):
    says(script(name, "r.h5"), name, "r.h5: ", "give a scene file (.yaml)")


def test_weights_end_at_the_first_refusal(script):
    done = script("weights.py", PROJECT / "meshes/head_solid.yaml", "-bin", programs())
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (1, "", 1), done


SOLVER = """#!{}
import sys, h5py
last, folded, slow = sys.argv[-3], "1e-6" in sys.argv, "1e-9" in sys.argv
with h5py.File(last + ".h5", "w") as h5:
    h5.create_group("step/0000").attrs.update(
        smallest_eigenvalue=1.0, largest_eigenvalue=2.0, load=1.0, converged=int(not slow), iterations=1, evaluations=2,
        seconds=1.0, volume_error_max=0.5, inverted_prisms=int(folded), displacement_error=0.01)
sys.exit(2 if folded or slow else 0)
"""


def test_weights_tell_a_folded_rest_position_from_an_unfinished_search(script, tmp_path):
    (tmp_path / "repose-solve").write_text(SOLVER.format(sys.executable))
    (tmp_path / "repose-solve").chmod(0o755)
    done = script("weights.py", "-bin", ".")
    assert done.returncode == 0, done
    ended = [line.split(" | ")[:2] for line in done.stdout.splitlines() if line.startswith(("| 1e", "| 1 "))]
    assert ended[:4] == [["| 1e-6", "folded"], ["| 1e-4", "converged"], ["| 1e-2", "converged"], ["| 1", "converged"]]
    assert ended[6:9] == [["| 1e-9", "NOT CONVERGED"], ["| 1e-6", "folded"], ["| 1e-3", "converged"]]


@pytest.mark.quick
def test_an_interrupt_ends_a_script_in_silence(tmp_path):
    slow = tmp_path / "repose-solve"
    slow.write_text("#!/bin/sh\ntouch started\nexec sleep 60\n")
    slow.chmod(0o755)
    process = subprocess.Popen([sys.executable, "-B", SCRIPTS["weights.py"], "-bin", "."], cwd=tmp_path, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    for _ in range(600):
        if (tmp_path / "started").exists():
            break
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60) == ("", "") and process.returncode == 130


# ----- ParaView, played by modules of its names


SIMPLE = """import sys
from unittest.mock import MagicMock
simple = sys.modules[__name__] = MagicMock(GetParaViewVersion=lambda: {version})
for source in (simple.XDMFReader, simple.WarpByVector):
    source.return_value.GetDataInformation.return_value.GetBounds.return_value = (0, 1) * 3
def write(file, *_, **__):
    with open(file, "w") as out:
        out.write({content!r})
simple.SaveScreenshot = simple.SaveState = write
simple.GetActiveSource.return_value.FileNames = {selected}
"""


@pytest.fixture
def paraview(script, solved, tmp_path, environment):
    """paraview(version, windows, DISPLAY, arguments, content=…, selected=…, macro=…) → what the script, or a
    copy of it elsewhere as a macro, does under a ParaView that writes this content and where this is selected."""

    def run(version, windows, display, arguments=("look.png",), content="drawn", selected=(), macro=False):
        stubs = tmp_path / "stubs"
        for module, text in (("paraview/simple", SIMPLE.format(version=version, content=content, selected=selected)),
                             ("vtkmodules/vtkRenderingOpenGL2", f"{windows} = None\n")):
            (stubs / module).parent.mkdir(parents=True, exist_ok=True)
            (stubs / (module.split("/", maxsplit=1)[0] + "/__init__.py")).write_text("")
            (stubs / f"{module}.py").write_text(text)
        if macro:
            shutil.copy(SCRIPTS["paraview_repose.py"], tmp_path / "macro.py")
            return finish([sys.executable, "-B", tmp_path / "macro.py"], tmp_path,
                          environment | {"PYTHONPATH": str(stubs)}, TIME_LIMIT)
        name = solved("paper_jaw_opening.yaml").with_suffix("")
        return script("paraview_repose.py", *(name if word == "NAME" else word for word in ("NAME", *arguments)),
                      settings={"DISPLAY": display})

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


DRAWS = (6.0, "vtkEGLRenderWindow", "")


def test_paraview_writes_a_picture_and_a_state_as_a_whole(paraview, tmp_path):
    result = paraview(*DRAWS, ["look.png", "state.pvsm"])
    assert (result.returncode, result.stderr) == (0, ""), result
    assert sorted(path.name for path in tmp_path.iterdir()) == ["look.png", "state.pvsm", "stubs"]


@pytest.mark.parametrize("arguments, part", [
    (["-nonsense"], "-nonsense: unknown; usage: pvpython drivers/paraview_repose.py NAME"),
    (["a.png", "b.pvsm", "c.png"], "usage: pvpython"), (["no/look.png"], "there is no folder no; make it first"),
    (["look.gif"], "does not end in .png"), (["look.h5"], "does not end in .png")])
def test_wrong_arguments_of_paraview_are_one_line(paraview, tmp_path, arguments, part):
    says(paraview(*DRAWS, arguments), "paraview_repose.py", part)
    assert [path.name for path in tmp_path.iterdir()] == ["stubs"]


def test_what_paraview_cannot_write_is_one_line(paraview, tmp_path):
    (tmp_path / "look.png").write_text("old")
    says(paraview(*DRAWS, content=""), "paraview_repose.py", "look.png: cannot be written by ParaView")
    assert (tmp_path / "look.png").read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["look.png", "stubs"]


def test_a_macro_shows_what_is_selected_and_never_ends_paraview(paraview, solved):
    skin = str(solved("paper_jaw_opening.yaml").with_suffix("")) + "_skin.xdmf"
    shown = paraview(*DRAWS, selected=[skin], macro=True)
    assert (shown.returncode, shown.stderr) == (0, ""), shown
    for selected in ([], ["other.vtk"], ["none_skin.xdmf"]):
        refused = paraview(*DRAWS, selected=selected, macro=True)
        assert refused.stderr.splitlines()[-1].startswith("RuntimeError: paraview_repose.py: "), refused


def test_real_paraview_without_a_display(solved, tmp_path, environment):
    if not shutil.which("pvpython"):
        pytest.skip("ParaView is not installed (python3-paraview)")
    surroundings = {name: value for name, value in environment.items() if name != "DISPLAY"}
    name = solved("paper_jaw_opening.yaml").with_suffix("")
    result = finish(["pvpython", str(SCRIPTS["paraview_repose.py"]), str(name), "look.png"],
                    tmp_path, surroundings, TIME_LIMIT)
    drawn = result.returncode == 0 and os.path.isfile(tmp_path / "look.png")
    assert drawn or "xvfb-run" in result.stderr, result
