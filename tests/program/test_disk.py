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


@pytest.mark.skipif(os.geteuid() != 0, reason="needs the right to mount")
@pytest.mark.parametrize("kilobytes, ranks", [(64, 1), (700, 1), (700, 2)])
def test_a_full_disk(run, tmp_path, kilobytes, ranks):
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "none", disk], capture_output=True
    )
    if mounted.returncode != 0:
        pytest.skip("tmpfs cannot be mounted here")
    try:
        (disk / "face.h5").write_text("what was there")
        before = contents(disk)
        result = run("repose-solve", SCENE, "-output", disk / "face", ranks=ranks)
        assert "face" in refused_and_intact(result, (disk, before))
    finally:
        subprocess.run(["umount", disk], check=True)


def without_rights():
    """Root writes everywhere: it gives that right up, for the program that it starts."""
    drop_capability, write_anywhere = 24, 1  # PR_CAPBSET_DROP, CAP_DAC_OVERRIDE
    if os.geteuid() == 0:
        assert ctypes.CDLL(None).prctl(drop_capability, write_anywhere, 0, 0, 0) == 0


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
