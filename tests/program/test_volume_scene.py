"""Scenes whose surfaces come from volumes: a made one, and the CT of Debian's package
invesalius-examples where that is installed."""

import shutil
import subprocess
import tarfile

import numpy as np
import pytest

import volumes as v
from conftest import PROJECT, programs
from tissue import last, model_of

EXAMPLE = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3"

SCENE = """skin: {volume: ct.mha, level: -300, voxel: 3}
bones:
  - {name: fixed, volume: labels.nii.gz, label: 1}
  - {name: moved, volume: labels.nii.gz, label: 2}
tissue: {layers: 3}
moves: [{bone: moved, translate: [2, 0, 0]}]
"""


def write_volumes(folder):
    """Air, tissue and bone as balls within each other; the bone in two halves as labels."""
    k, j, i = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in v.SIZE[::-1]), indexing="ij")
    place = np.stack([i, j, k], axis=-1) * v.SPACING
    radius = np.linalg.norm(place, axis=-1)
    values = np.clip(-300 + 400 * (24 - radius), -1000, 100)
    v.write_meta(folder / "ct.mha", values.astype("<i2"))
    halves = np.where(np.abs(place[..., 0]) < 2, 0, np.where(place[..., 0] < 0, 1, 2))
    v.write_nifti(folder / "labels.nii.gz", np.where(radius < 15, halves, 0).astype("<i2"))


@pytest.mark.quick
def test_a_scene_of_volumes_is_solved(run, tmp_path):
    write_volumes(tmp_path)
    (tmp_path / "scene.yaml").write_text(SCENE)
    result = run("repose-solve", "scene.yaml", "-output", "out", ranks=2)
    assert (result.returncode, result.stderr) == (0, ""), result
    model, step = model_of(tmp_path / "out.h5"), last(tmp_path / "out.h5")
    skin = model["point/position"][np.unique(model["skin/points"])]
    middle = v.ORIGIN + v.TURN @ (v.SPACING * (v.SIZE - 1) / 2)
    assert np.abs(np.linalg.norm(skin - middle, axis=1) - 24).max() < 0.6
    assert step["converged"] and step["inverted_prisms"] == 0


@pytest.mark.parametrize("old, new, words", [
    ("level: -300", "level: 4000", ["ct.mha", "4000", "values go from"]),
    ("label: 2", "label: 7", ["labels.nii.gz", "label 7", "1, 2"]),
])
def test_a_volume_without_the_surface_is_refused(run, tmp_path, old, new, words):
    write_volumes(tmp_path)
    (tmp_path / "scene.yaml").write_text(SCENE.replace(old, new))
    result = run("repose-solve", "scene.yaml", ranks=2)
    assert result.returncode == 1 and len(result.stderr.splitlines()) == 1, result
    assert [word for word in words if word not in result.stderr] == [], result.stderr


def test_the_demo_takes_a_ct_to_a_solved_face(tmp_path, environment):
    try:
        tarfile.open(EXAMPLE).close()
    except FileNotFoundError:
        pytest.skip("no CT: the package invesalius-examples is not installed")
    (tmp_path / "bin").symlink_to(programs())
    subprocess.run([PROJECT / "drivers/demo.sh", "--ct"], check=True, timeout=600,
                   env=environment | {"REPOSE_BUILD": str(tmp_path)})
    step = last(tmp_path / "demo/ct_maxilla.h5")
    assert step["load"] == 1 and step["converged"] and step["inverted_prisms"] == 0
    assert {"skin.vtp", "bone.vtp"} <= {path.name for path in (tmp_path / "demo/ct").iterdir()}
    shutil.rmtree(tmp_path / "demo")


def test_the_demo_refuses_what_it_does_not_know():
    result = subprocess.run([PROJECT / "drivers/demo.sh", "--xct"], text=True, capture_output=True)
    assert result.returncode == 1 and "--ct" in result.stderr
