"""Every command of the README runs as printed, in order, in a folder laid out like the project."""

import re
import shutil

import pytest

from conftest import PROJECT, can_draw, finish, programs

README = (PROJECT / "README.md").read_text(encoding="utf-8")
COMMANDS = [line for block in re.findall(r"^```sh\n(.*?)^```", README, re.M | re.S)
            for line in block.splitlines() if line]
SCENE = re.search(r"here `(.*?)`:\n\n```yaml\n(.*?)^```", README, re.M | re.S)
THIS_RUN = "tests/run.sh"  # what runs this test
NEEDS_VTK = "drivers/render.py "


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Built programs, meshes and scripts where the README has them, and the scene it prints."""
    top = tmp_path_factory.mktemp("readme")
    (top / "build").mkdir()
    (top / "build" / "bin").symlink_to(programs())
    for name in ("meshes", "drivers"):
        (top / name).symlink_to(PROJECT / name)
    for name, mesh in (("face", "skin"), ("skull", "skull"), ("mandible", "mandible")):
        shutil.copy(PROJECT / "meshes" / f"head_{mesh}.ply", top / f"{name}.ply")
    (top / SCENE[1]).write_text(SCENE[2])
    return top


@pytest.mark.quick
def test_the_two_scripts_come_first():
    assert COMMANDS[:2] == ["drivers/demo.sh", THIS_RUN]


@pytest.mark.quick
@pytest.mark.parametrize("command", [c for c in COMMANDS if c != THIS_RUN])
def test_command_runs(folder, environment, command):
    if command.startswith(NEEDS_VTK) and not can_draw():
        pytest.skip("no VTK from 9.4 on, nor an older one or ParaView with xvfb-run")
    result = finish(["bash", "-c", command], folder, environment | {"REPOSE_BUILD": "build"}, 600)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.quick
def test_the_demo_leaves_what_it_names(folder):
    left = {path.name for path in (folder / "build" / "demo").iterdir()}
    assert {f"head_solid{end}" for end in (
        ".h5", ".html", "_skin.xdmf", "_bones.xdmf", "_tissue.xdmf")} <= left
