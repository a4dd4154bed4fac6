"""repose-isosurface from outside: every format gives the same surface in the same place; mesh files
that others can read; bad volumes are refused in one line."""

import gzip
import json
import re
import shutil
import zlib

import meshio
import numpy as np
import pytest

import volumes as v
from conftest import expect_refusal
from heads import DATA

WRITERS = {
    "MetaImage": lambda folder, s: v.write_meta(folder / "ct.mha", s),
    "MetaImage in two files, compressed": lambda folder, s: v.write_meta(
        folder / "ct.mhd", s, compressed=True, local=False),
    "NRRD in LPS": lambda folder, s: v.write_nrrd(folder / "ct.nrrd", s),
    "NRRD in RAS, raw": lambda folder, s: v.write_nrrd(
        folder / "ct.nrrd", s, space="right-anterior-superior", compressed=False),
    "NIfTI": lambda folder, s: v.write_nifti(folder / "ct.nii", s),
    "NIfTI, compressed": lambda folder, s: v.write_nifti(folder / "CT.nii.gz", s),
    "DICOM": lambda folder, s: v.write_dicom(folder / "slices", s),
}


@pytest.mark.quick
@pytest.mark.parametrize("kind", WRITERS)
def test_every_format_puts_the_surface_in_its_place(run, tmp_path, kind):
    file = WRITERS[kind](tmp_path, v.samples())
    result = run("repose-isosurface", file, "-level", 1000)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "48 × 50 × 40 voxels of 1.3 × 1.1 × 1.7 mm" in result.stdout
    assert "manifold; closed, 1 component, no defect" in result.stdout
    points = meshio.read(tmp_path / "mesh.ply").points
    assert np.abs(v.level_of(points) - 1).max() < 0.005  # of a radius: 0.1 mm
    assert np.abs(points.mean(axis=0) - v.CENTER).max() < 0.5


def test_a_tilted_gantry_shears_the_volume(run, tmp_path):
    step = v.TURN[:, 2] * v.SPACING[2] + v.TURN[:, 1] * 0.4
    k, j, i = np.meshgrid(*(np.arange(n) for n in v.SIZE[::-1]), indexing="ij")
    points = v.ORIGIN + i[..., None] * v.TURN[:, 0] * v.SPACING[0]
    points = points + j[..., None] * v.TURN[:, 1] * v.SPACING[1] + k[..., None] * step
    values = np.rint(1000 * v.level_of(points)).astype("<i2")
    result = run("repose-isosurface", v.write_dicom(tmp_path / "tilted", values, step=step),
                 "-level", 1000)
    assert (result.returncode, result.stderr) == (0, ""), result
    found = meshio.read(tmp_path / "mesh.ply").points
    assert np.abs(v.level_of(found) - 1).max() < 0.005


@pytest.mark.parametrize("ending", ["ply", "stl", "obj", "vtp"])
def test_others_read_what_is_written(run, tmp_path, ending):
    result = run("repose-isosurface", v.write_meta(tmp_path / "ct.mha", v.samples()),
                 "-level", 1000, "-output", f"mesh.{ending}")
    assert result.returncode == 0, result
    if ending == "vtp":
        reader = pytest.importorskip("vtkmodules.vtkIOXML").vtkXMLPolyDataReader()
        reader.SetFileName(str(tmp_path / "mesh.vtp"))
        reader.Update()
        mesh = reader.GetOutput()
        assert mesh.CheckAttributes() == 0
        count, triangles = mesh.GetNumberOfPoints(), mesh.GetNumberOfPolys()
    else:
        mesh = meshio.read(tmp_path / f"mesh.{ending}")
        count, triangles = len(mesh.points), len(mesh.cells_dict["triangle"])
    assert f"{triangles} triangles" in result.stdout
    assert ending == "stl" or f"{count} vertices" in result.stdout


def test_labels_give_one_mesh_each(run, tmp_path):
    labels = np.where(v.samples() > 1000, 1, 0).astype("<i2")
    labels[:20] *= 3
    result = run("repose-isosurface", v.write_nifti(tmp_path / "labels.nii.gz", labels), "-labels",
                 "-output", "bone.stl")
    assert result.returncode == 0, result
    assert sorted(path.name for path in tmp_path.glob("bone*")) == ["bone_1.stl", "bone_3.stl"]
    assert result.stdout.count("manifold; closed, 1 component, no defect") == 2


def write_points(file, points, system):
    """As 3D Slicer writes a list of points; given in LPS."""
    flip = np.array([-1, -1, 1]) if system == "RAS" else np.ones(3)
    controls = [{"label": f"F-{n}", "position": (flip * p).tolist()} for n, p in enumerate(points)]
    markup = {"type": "Fiducial", "coordinateSystem": system, "controlPoints": controls}
    file.write_text(json.dumps({"markups": [markup]}))
    return file


def test_bones_that_touch_are_parted_at_the_bridge_between_them(run, tmp_path):
    """Two balls on one axis and a bar from the one to the other."""
    axis, half, radius, bar = v.TURN[:, 2], 17.0, 13.0, 4.0
    k, j, i = np.meshgrid(*(np.arange(n) for n in v.SIZE[::-1]), indexing="ij")
    place = v.ORIGIN + np.stack([i, j, k], axis=-1) * v.SPACING @ v.TURN.T - v.CENTER
    along = place @ axis
    across = np.linalg.norm(place - along[..., None] * axis, axis=-1)
    bone = np.hypot(np.abs(along) - half, across) < radius
    bone |= (np.abs(along) < half) & (across < bar)
    ct = v.write_meta(tmp_path / "ct.mha", np.where(bone, 1000, -1000).astype("<i2"))
    points = [write_points(tmp_path / f"{system}.mrk.json", [v.CENTER + side * half * axis], system)
              for side, system in ((1, "LPS"), (-1, "RAS"))]
    result = run("repose-isosurface", ct, "-level", 0, "-apart", *points, "-output", "bone.ply")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert result.stdout.count("manifold; closed, 1 component, no defect") == 2
    shared = float(re.search(r"parted where voxels share (\d+) mm²", result.stdout)[1])
    assert shared == pytest.approx(np.pi * bar**2, rel=0.2)
    for number, side in ((1, 1), (2, -1)):
        reach = side * (meshio.read(tmp_path / f"bone_{number}.ply").points - v.CENTER) @ axis
        assert reach.max() == pytest.approx(half + radius, abs=2), "the whole ball"
        assert reach.min() > radius - half - 2, "nothing of the other"


def test_points_of_both_bones_are_refused(run, tmp_path):
    points = write_points(tmp_path / "jaw.mrk.json", [v.CENTER], "LPS")
    result = run("repose-isosurface", v.write_meta(tmp_path / "ct.mha", v.samples()), "-level", 1000, "-apart", points,
                 points, "-output", "bone.ply")
    assert result.returncode == 1 and "of the first bone is 0 mm from a point of the second" in result.stderr, result
    assert not list(tmp_path.glob("bone*"))


def test_a_box_cuts_a_tilted_volume_along_x_y_and_z(run, tmp_path):
    """Also the corners of the voxels' block, which reaches far beyond the box."""
    ct, center = v.write_meta(tmp_path / "ct.mha", v.samples()), np.array(v.CENTER)
    low, high = center - 8, center + 8
    result = run("repose-isosurface", ct, "-level", 1000, "-box", *low, *high)
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "lie outside the box and are left out" in result.stdout
    points = meshio.read(tmp_path / "mesh.ply").points
    assert (points > low - 0.01).all() and (points < high + 0.01).all()


def cut(file, share=0.5):
    content = file.read_bytes()
    file.write_bytes(content[:int(share * len(content))])
    return file


def cut_packed(file):
    """The compressed content cut off, itself compressed well."""
    file.write_bytes(gzip.compress(gzip.decompress(file.read_bytes())[:100000]))
    return file


def remove_slice(folder):
    sorted(folder.iterdir())[3].unlink()
    return folder


def double_slice(folder):
    shutil.copy(sorted(folder.iterdir())[3], folder / "again.dcm")
    return folder


def mix_series(folder):
    return v.write_dicom(folder, v.samples()[:7], series="1.2.4", title="soft tissue")


def other_size(folder):
    v.write_slice(folder / "scout.dcm", v.samples()[0][:30], v.ORIGIN - 9 * v.TURN[:, 2], number=99)
    return folder


def spoil_slice(folder):
    cut(sorted(folder.iterdir())[5])
    return folder


def spoil_header(folder, place):
    """Two bytes of the meta information: at some places Debian's GDCM aborts, at others it no
    longer takes the file for DICOM."""
    file = sorted(folder.iterdir())[5]
    content = file.read_bytes()
    file.write_bytes(content[:place] + b"??" + content[place + 2:])
    return folder


def text(file, content="no volume\n"):
    file.write_text(content)
    return file


NO_SPACING = np.array([1.3, 0, 1.7])

# The spoiled volume in a folder, further options, and words that the message must hold.
CASES = {
    "nothing there": (lambda f: f / "none.nii", [], ["none.nii", "no such file"]),
    "no volume": (lambda f: text(f / "ct.txt"), [], ["ct.txt", ".nrrd"]),
    "text as NIfTI": (lambda f: text(f / "ct.nii"), [], ["ct.nii"]),
    "text as MetaImage": (lambda f: text(f / "ct.mha"), [], ["ct.mha"]),
    "text as NRRD": (lambda f: text(f / "ct.nrrd"), [], ["ct.nrrd"]),
    "truncated MetaImage": (lambda f: cut(v.write_meta(f / "ct.mha", v.samples())), [], ["ct.mha"]),
    "truncated compressed MetaImage": (
        lambda f: cut(v.write_meta(f / "ct.mha", v.samples(), compressed=True), 0.7), [],
        ["ct.mha"]),
    "MetaImage without its data": (
        lambda f: [v.write_meta(f / "ct.mhd", v.samples(), local=False),
                   (f / "ct.raw").unlink()][0], [], ["ct.mhd"]),
    "truncated NRRD": (
        lambda f: cut(v.write_nrrd(f / "ct.nrrd", v.samples(), compressed=False)), [],
        ["ct.nrrd", "truncated"]),
    "truncated compressed NRRD": (
        lambda f: cut(v.write_nrrd(f / "ct.nrrd", v.samples())), [], ["ct.nrrd", "truncated"]),
    "truncated NIfTI": (
        lambda f: cut(v.write_nifti(f / "ct.nii", v.samples())), [], ["ct.nii", "truncated"]),
    "truncated compressed NIfTI": (
        lambda f: cut(v.write_nifti(f / "ct.nii.gz", v.samples())), [], ["ct.nii.gz"]),
    "compressed truncated NIfTI": (
        lambda f: cut_packed(v.write_nifti(f / "ct.nii.gz", v.samples())), [], ["ct.nii.gz"]),
    "truncated slice": (
        lambda f: spoil_slice(v.write_dicom(f / "ct", v.samples())), [], [".dcm", "truncated"]),
    "damaged header of a slice": (
        lambda f: spoil_header(v.write_dicom(f / "ct", v.samples()), 152), [], [".dcm", "damaged"]),
    "another damaged header of a slice": (
        lambda f: spoil_header(v.write_dicom(f / "ct", v.samples()), 144), [], [".dcm", "damaged"]),
    "damaged header of NIfTI": (
        lambda f: text(f / "ct.nii", "\x5c\x01" + "\0" * 400), [], ["ct.nii"]),
    "MetaImage without spacing": (
        lambda f: v.write_meta(f / "ct.mha", v.samples(), NO_SPACING), [], ["ct.mha", "spacing"]),
    "NRRD without spacing": (
        lambda f: v.write_nrrd(f / "ct.nrrd", v.samples(), NO_SPACING), [], ["ct.nrrd", "spacing"]),
    "NIfTI without spacing": (
        lambda f: v.write_nifti(f / "ct.nii", v.samples(), NO_SPACING), [],
        ["ct.nii", "spacing along axis j is 0 mm"]),
    "NIfTI without axes": (
        lambda f: v.write_nifti(f / "ct.nii", v.samples(), sform=0), [],
        ["ct.nii", "qform_code and sform_code are 0"]),
    "DICOM without spacing": (
        lambda f: v.write_dicom(f / "ct", v.samples(), spacing=NO_SPACING), [], [".dcm", "spacing"]),
    "missing slice": (
        lambda f: remove_slice(v.write_dicom(f / "ct", v.samples())), [],
        ["3.4 mm to the next slice", "1.7 mm apart", "1 missing"]),
    "doubled slice": (
        lambda f: double_slice(v.write_dicom(f / "ct", v.samples())), [], ["again.dcm", "remove"]),
    "mixed series": (
        lambda f: mix_series(v.write_dicom(f / "ct", v.samples())), [],
        ["2 series", "'bone' (40 slices)", "'soft tissue' (7 slices)"]),
    "slice of another size": (
        lambda f: other_size(v.write_dicom(f / "ct", v.samples())), [], ["scout.dcm", "48 × 30"]),
    "one slice": (lambda f: v.write_dicom(f / "ct", v.samples()[:1]), [], ["1 slice"]),
    "empty folder": (lambda f: f, [], ["no DICOM slice"]),
    "two volumes": (
        lambda f: v.write_nifti(f / "ct.nii", v.samples(), volumes=2), [], ["ct.nii", "2 volumes"]),
    "level above the data": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()), ["-level", "5000"],
        ["ct.mha", "5000", "its values go from", "1921"]),
    "level below the data": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()), ["-level", "-9000"], ["ct.mha", "-9000"]),
    "a CT of 8 bits": (
        lambda f: v.write_nrrd(f / "ct.nrrd", np.clip(v.samples(), -128, 127).astype("<i2")), [],
        ["no surface at level 1000; choose one in between: its values go from -128 to 127, as 8 bits hold them", "needs 16"]),
    "the bone of a CT of 8 bits": (
        lambda f: v.write_nrrd(f / "ct.nrrd", np.clip(v.samples(), -128, 127).astype("<i2"), spacing=3 * v.SPACING), ["-jaw"],
        ["values of 1000 or more; choose the level of bone: its values go from -128 to 127", "needs 16"]),
    "the core of a CT of 8 bits": (
        lambda f: v.write_nrrd(f / "ct.nrrd", np.clip(v.samples(), -128, 127).astype("<i2")), ["-level", "0", "-core", "400"],
        ["the core, 400: its values go from -128 to 127", "needs 16"]),
    "two levels": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()), ["-otsu"], ["-level", "-otsu"]),
    "a CT as label map": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()), ["-labels"], ["one of"]),
    "box beside the volume": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()),
        ["-box", *"900 900 900 950 950 950".split()], ["ct.mha", "box"]),
    "box of the wrong order": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()), ["-box", *"9 0 0 1 1 1".split()],
        ["-box", "lowest"]),
    "no component that large": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()), ["-components_above", "1e9"],
        ["ct.mha", "largest"]),
    "unknown kind of mesh": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()), ["-output", "mesh.vtk"],
        ["mesh.vtk", ".vtp"]),
    "no folder for the mesh": (
        lambda f: v.write_meta(f / "ct.mha", v.samples()), ["-output", "no/such/mesh.ply"],
        ["no/such"]),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_refused(run, tmp_path, case):
    spoil, options, words = CASES[case]
    folder = tmp_path / "in"
    folder.mkdir()
    volume = spoil(folder)
    level = [] if "-level" in options else ["-level", "1000"]
    expect_refusal(run, tmp_path, words, "repose-isosurface", volume, *level, *options)


def test_no_level_is_refused(run, tmp_path):
    result = run("repose-isosurface", v.write_meta(tmp_path / "ct.mha", v.samples()))
    assert (result.returncode, result.stdout) == (1, "")
    assert "-level HU, -otsu, -label N and -labels" in result.stderr


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")
def test_large_voxels_get_a_note_where_bones_are_parted(run, tmp_path):
    voxels = np.frombuffer(zlib.decompress((DATA / "head_hu.zraw").read_bytes()), "<i2").reshape(121, 275, 272)
    voxels[::2, ::2, ::2].tofile(tmp_path / "half.raw")
    text = re.sub("CompressedDataSize.*\n", "", (DATA / "head_hu.mhd").read_text())
    for given, half in (("272 275 121", "136 138 61"), ("0.9765625 0.9765625 2", "1.953125 1.953125 4"),
                        ("CompressedData = True", "CompressedData = False"), ("head_hu.zraw", "half.raw")):
        assert given in text
        text = text.replace(given, half)
    (tmp_path / "half.mhd").write_text(text)
    result = run("repose-isosurface", "half.mhd", "-level", 226, "-jaw", "-largest", "-output", "bone.ply")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "note: voxels are 4 mm apart along k: bone thinner than that may be lost" in result.stdout
