"""A run that cannot write says so in one line and leaves what was there."""

import ctypes
import hashlib
import os
import subprocess

import pytest

from conftest import PROJECT, programs

SCENE = PROJECT / "meshes/paper_jaw_advance.yaml"


@pytest.fixture
def older(run, tmp_path):
    """A folder with an earlier result, and what its bytes are."""
    folder = tmp_path / "results"
    folder.mkdir()
    assert run("repose-solve", SCENE, "-output", folder / "face").returncode == 0
    return folder, contents(folder)


def contents(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def refused_and_intact(result, older):
    """One line with a remedy, and the earlier result as it was."""
    folder, before = older
    assert result.returncode == 1, result
    lines = result.stderr.splitlines()
    assert (
        len(lines) == 1 and lines[0].startswith("error: ") and "choose another -output" in lines[0]
    )
    assert contents(folder) == before
    return lines[0]


@pytest.fixture
def small_disk(tmp_path):
    """small_disk(kilobytes) → the folder of a disk of that size."""
    disk = tmp_path / "disk"

    def mount(kilobytes):
        disk.mkdir()
        options = ["-t", "tmpfs", "-o", f"size={kilobytes}k", "none", disk]
        if os.geteuid() != 0 or subprocess.run(["mount", *options], capture_output=True).returncode:
            pytest.skip("tmpfs cannot be mounted here")
        return disk

    yield mount
    if os.path.ismount(disk):
        subprocess.run(["umount", disk], check=True)


@pytest.mark.parametrize("kilobytes, ranks", [(64, 1), (700, 1), (700, 2)])
def test_a_full_disk(run, small_disk, kilobytes, ranks):
    disk = small_disk(kilobytes)
    (disk / "face.h5").write_text("what was there")
    before = contents(disk)
    result = run("repose-solve", SCENE, "-output", disk / "face", ranks=ranks)
    assert "face" in refused_and_intact(result, (disk, before))


@pytest.mark.parametrize("room", [1.4, 2.01])
def test_a_disk_without_room_for_the_summary_has_the_result(run, older, small_disk, room):
    """The summary is written into a copy of the result."""
    folder, _ = older
    disk = small_disk(int(room * (folder / "face.h5").stat().st_size / 1024))
    result = run("repose-solve", SCENE, "-output", disk / "face")
    assert result.returncode == 0 and result.stderr.startswith("warning: "), result
    assert "the result is whole, but without its summary" in result.stderr
    assert [path.name for path in disk.glob("*.h5*")] == ["face.h5"]
    assert run("repose-check", disk / "face.h5").returncode == 0


def without_rights():
    """Root writes everywhere: it gives that right up, for the program that it starts."""
    drop_capability, write_anywhere = 24, 1  # PR_CAPBSET_DROP, CAP_DAC_OVERRIDE
    if os.geteuid() == 0:
        assert ctypes.CDLL(None).prctl(drop_capability, write_anywhere, 0, 0, 0) == 0


@pytest.mark.quick
def test_a_folder_that_may_not_be_written(older, environment, tmp_path):
    folder, _ = older
    folder.chmod(0o555)
    result = subprocess.run(
        [str(programs() / "repose-solve"), str(SCENE), "-output", str(folder / "face")],
        cwd=tmp_path,
        env=environment,
        text=True,
        capture_output=True,
        preexec_fn=without_rights,
        timeout=60,
    )
    assert "Permission denied" in refused_and_intact(result, older)


def test_a_folder_that_is_not_there(run, older, tmp_path):
    result = run("repose-solve", SCENE, "-output", older[0] / "none" / "face")
    assert "there is no folder" in refused_and_intact(result, older)
