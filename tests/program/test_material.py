"""Scenes whose tissue is a solid: what is refused, one face on any way to it, and how far its mesh
leaves it from the continuum."""

import re

import numpy as np
import pytest

from conftest import PROJECT, RUNS_ALL
from tissue import apart, last, model_of, steps

MESHES = PROJECT / "meshes"
JAW_FORWARD = "  - {bone: mandible, translate: [0, -6, 0]}"
JAW_OPENS = "  - {bone: mandible, rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: 8}}"
CHIN = """osteotomies:
  - bone: mandible
    piece: chin
    planes: [{point: [0, -88, -52], normal: [0, -0.42, -0.91]}]
    kerf: 0.5
"""


def scene(tissue="", moves=JAW_FORWARD, more="", head="head"):
    return f"""
skin: {MESHES}/{head}_skin.ply
bones:
  - {{name: skull, file: {MESHES}/{head}_skull.ply}}
  - {{name: mandible, file: {MESHES}/{head}_mandible.ply}}
tissue:
  layers: 4
{tissue}
moves:
{moves}
{more}"""


PAINTED = "  material: {{regions: [{{painted: {{mesh: painted.ply, {}}}, young: 0.1}}]}}"

REFUSED = {
    "poisson": ("  material: {poisson: 0.5}", "", "tissue.material.poisson must be a number"),
    "young": ("  material: {young: -1}", "", "tissue.material.young must be a number"),
    "preset": ("  material: {preset: fase}", "", "one of face"),
    "key": ("  material: {yung: 1}", "", "nearest known one is 'young'"),
    "both": ("  material: {young: 1}\n  springs: {default: {modulus: 1}}", "",
             "tissue.springs exclude each other"),
    "thickness": ("  material: {skin: {thickness: 0, young: 0.1}}", "", "thickness must be"),
    "skin and strata": (
        "  material: {skin: {thickness: 1, young: 1}, strata: [{thickness: 1, young: 1}]}", "",
        "exclude each other"),
    "region": ("  material: {regions: [{young: 1}]}", "", 
               "must hold exactly one of sphere, box, mesh, volume, curve, painted"),
    "unpainted": (PAINTED.format("color: [0, 0, 255]"), "", "none of its 4 vertices is painted"),
    "uncolored": (PAINTED.format("property: quality"), "", "no property 'quality'; they have red"),
    "two paints": (PAINTED.format("color: [0, 0, 255], property: quality"), "",
                   "needs one of color and property"),
    "two numbers": (PAINTED.format("color: [0, 0]"), "", "must be red, green and blue"),
    "no PLY": (PAINTED.format("color: [0, 0, 0]").replace("painted.ply", "scene.yaml"), "",
               "is not a PLY file"),
    "dilatation": ("  material: {poisson: 0, dilatation: nodal}", "", "poisson must be above 0"),
    "nowhere": ("  material: {regions: [{sphere: {center: [900, 0, 0], radius: 1}, young: 1}]}", "",
                "regions[0]: holds no prism"),
    "turgor": ("  turgor: 0.1", "", "give tissue.material.skin"),
    "depths": ("  depths: [0, 0.2, 0.5, 1]\n  depths_mm: [0, 1]", "", "exclude each other"),
    "first depth": ("  depths_mm: [1, 2]", "", "must begin with 0"),
    "isotropic": ("  springs: {isotropic: {young: 1, poisson: 0.45}, default: {modulus: 1}}", "",
                  "exclude each other"),
    "volume": ("", "solve: {volume: {form: penalty}}", "the tissue is a solid"),
    "functional": ("", "solve: {functional: force}", "the tissue is a solid"),
    "tearing": ("", "forces: [{at: [47, -80, 8], radius: 6, force: [0, -3, 0]}]\n"
                    "tearing: {limit: 0.5}", "the tissue is a solid"),
}


def write_painted(file, points, triangles, painted):
    """A PLY as MeshLab writes it: red where it is painted, else white."""
    kinds = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "u1"), ("green", "u1"),
                      ("blue", "u1"), ("alpha", "u1")])
    rows = np.zeros(len(points), kinds)
    for axis, name in enumerate("xyz"):
        rows[name] = np.asarray(points)[:, axis]
    rows["red"] = rows["alpha"] = 255
    rows["green"] = rows["blue"] = np.where(painted, 30, 255)
    faces = np.zeros(len(triangles), [("count", "u1"), ("points", "<i4", 3)])
    faces["count"], faces["points"] = 3, triangles
    kind = {"<f4": "float", "|u1": "uchar"}
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    head += [f"property {kind[kinds[name].str]} {name}" for name in kinds.names]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    file.write_bytes("\n".join(head).encode() + b"\n" + rows.tobytes() + faces.tobytes())


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_material_is_refused_in_one_line(run, tmp_path, case):
    tissue, more, report = REFUSED[case]
    write_painted(tmp_path / "painted.ply", np.eye(4, 3), [[0, 1, 2]], [True, False, False, False])
    (tmp_path / "scene.yaml").write_text(scene(tissue, more=more))
    result = run("repose-solve", "scene.yaml", "-output", "out")
    assert result.returncode == 1, result
    assert report in result.stderr and result.stderr.count("\n") == 1, result.stderr
    assert not (tmp_path / "out.h5").exists()


def solve(run, tmp_path, name, text, *options, ranks=1, status=0):
    (tmp_path / f"{name}.yaml").write_text(text)
    result = run("repose-solve", f"{name}.yaml", "-output", name, *options, ranks=ranks)
    assert (result.returncode, result.stderr) == (status, ""), result
    return tmp_path / f"{name}.h5", result.stdout


@pytest.mark.parametrize("moves, more, tissue", [
    *(pytest.param(move, "", "", marks=pytest.mark.long) for move in (JAW_FORWARD, JAW_OPENS)),
    ("  - {bone: chin, translate: [0, -8, 0]}", CHIN, "  release: 5\n  edge: 8")])
def test_one_face_whatever_the_load_steps_and_the_ranks(run, tmp_path, moves, more, tissue):
    text, accuracy = scene(tissue, moves, more), 0.001
    options = "-accuracy", accuracy
    one = last(solve(run, tmp_path, "one", text, *options)[0])
    assert one["inverted_prisms"] == 0
    assert one["point/contact_pressure"].max() > 0
    assert one["evaluations"] <= 120
    for steps_wanted in (2, 5, 10) if RUNS_ALL else (5,):
        other = solve(run, tmp_path, "other", text, *options, "-load_steps", steps_wanted)[0]
        assert apart(one, last(other)) <= 2 * accuracy
    for ranks in (2, 3, 5) if RUNS_ALL else (3,):
        other = solve(run, tmp_path, "other", text, *options, ranks=ranks)[0]
        assert apart(one, last(other)) <= 2 * accuracy


def test_every_method_finds_the_face(run, tmp_path):
    text, accuracy = scene(head="paper"), 0.001
    default = last(solve(run, tmp_path, "default", text, "-accuracy", accuracy)[0])
    for method in ["ntr"], ["nls"], ["ntl"], ["cg"], ["lmvm", "-tao_lmvm_initial", "diagonal"]:
        other = solve(run, tmp_path, "other", text, "-accuracy", accuracy, "-tao_type", *method)[0]
        assert apart(default, last(other)) <= 2 * accuracy, method


@pytest.mark.long
def test_averaged_volumes_make_one_face_on_any_ranks(run, tmp_path):
    text, accuracy = scene("  material: {poisson: 0.49, dilatation: nodal}", JAW_OPENS), 0.001
    options = "-accuracy", accuracy
    one = solve(run, tmp_path, "one", text, *options, "-stability")[0]
    assert run("repose-check", "one.h5").returncode == 0
    for ranks in (2, 3, 5) if RUNS_ALL else (3,):
        other = solve(run, tmp_path, "other", text, *options, ranks=ranks)[0]
        assert apart(last(one), last(other)) <= 2 * accuracy
    plain = solve(run, tmp_path, "plain", text.replace(", dilatation: nodal", ""), *options)[0]
    assert apart(last(one), last(plain)) > 0.01
    assert last(one)["smallest_eigenvalue"] > 0


@pytest.mark.parametrize("dilatation", ["prism", "nodal"])
def test_nearly_incompressible_tissue_begins_with_softer_volumes(run, tmp_path, dilatation):
    tissue = f"  material: {{poisson: 0.499, dilatation: {dilatation}}}"
    text = scene(tissue, JAW_OPENS, "contact: {bones: off, cuts: off}")
    faces = []
    for ranks in 1, 3:
        file = solve(run, tmp_path, "stiff", text, "-accuracy", 0.01, ranks=ranks)[0]
        faces.append(last(file))
        assert faces[-1]["evaluations"] <= 300  # from the linear prediction with λ itself: above 1000
    assert run("repose-check", "stiff.h5").returncode == 0
    assert apart(*faces) <= 2 * 0.01


def test_a_region_painted_on_the_skin(run, tmp_path):
    file = solve(run, tmp_path, "plain", scene(head="paper"), "-accuracy", 0.1)[0]
    model = model_of(file)
    skin = model["point/position"][model["point/layer"] == 0]
    column = model["point/column"][model["skin/points"]]
    painted = np.linalg.norm(skin - skin[skin[:, 1].argmin()], axis=1) <= 15
    write_painted(tmp_path / "painted.ply", skin, column, painted)
    red = PAINTED.format("color: [255, 0, 0], depth: 4")
    file = solve(run, tmp_path, "painted", scene(red, head="paper"), "-accuracy", 0.1)[0]
    changed = model_of(file)["prism/shear_modulus"] > 0.02
    middle = model["point/position"][model["prism/points"]].mean(1)
    above = skin[model["point/column"][model["prism/points"][:, :3]]].mean(1)
    near = np.linalg.norm(middle - above, axis=1) <= 4
    nearest = painted[np.linalg.norm(above[:, None] - skin[None], axis=2).argmin(1)]
    assert np.array_equal(changed, near & nearest) and changed.sum() > 10


def test_paint_beside_the_skin_is_refused(run, tmp_path):
    file = solve(run, tmp_path, "plain", scene(head="paper"), "-accuracy", 0.1)[0]
    model = model_of(file)
    skin = model["point/position"][model["point/layer"] == 0]
    column = model["point/column"][model["skin/points"]]
    write_painted(tmp_path / "painted.ply", skin + [0, 0, 30], column, skin[:, 1] < np.median(skin[:, 1]))
    for tissue in (PAINTED.format("color: [255, 0, 0]"),
                   "  edge: 4\n  face: [{painted: {mesh: painted.ply, color: [255, 0, 0]}}]"):
        (tmp_path / "scene.yaml").write_text(scene(tissue, head="paper"))
        result = run("repose-solve", "scene.yaml", "-dry_run")
        assert result.returncode == 1 and result.stderr.count("\n") == 1, result
        found = re.search(r"painted.ply: (\d+) of its (\d+) vertices lie more than 10 mm from the skin, up to (\S+) mm", result.stderr)
        assert 0.05 * len(skin) < int(found[1]) < int(found[2]) == len(skin) and 25 < float(found[3]) <= 30


@pytest.mark.quick
def test_strata_regions_and_depths(run, tmp_path):
    tissue = """  depths_mm: [0, 1.5]
  material:
    young: 0.015
    strata: [{thickness: 1.5, young: 0.08}, {thickness: 4, young: 0.003}]
    regions: [{sphere: {center: [60, -60, -20], radius: 15}, young: 0.05, poisson: 0.3}]"""
    file = solve(run, tmp_path, "layered", scene(tissue), "-accuracy", 0.1)[0]
    model = model_of(file)
    young = 2 * (1 + 0.45) * model["prism/shear_modulus"]
    x, layer = model["point/position"], model["point/layer"]
    second = np.linalg.norm(x[layer == 1] - x[layer == 0], axis=1)
    assert np.isclose(second, 1.5).mean() > 0.9 and second.max() < 1.5 + 1e-9
    at_skin = young[layer[model["prism/points"][:, 0]] == 0]
    assert np.isclose(at_skin, 0.08).mean() > 0.8
    inside = np.linalg.norm(
        x[model["prism/points"]].mean(axis=1) - [60, -60, -20], axis=1) <= 15
    assert inside.sum() > 10
    assert np.allclose(model["prism/shear_modulus"][inside], 0.05 / 2.6)


def test_a_titanium_implant_on_the_chin_goes_with_it(run, tmp_path):
    """Its modulus, 7 million times that of the tissue, does not decide how stiff contact is elsewhere."""
    implant = "  material: {regions: [{sphere: {center: [0, -95, -38], radius: 9}, young: 110000}]}"
    file = solve(run, tmp_path, "implant", scene(implant), "-accuracy", 0.01, "-skip_other_rest")[0]
    model, step = model_of(file), last(file)
    inside = np.unique(model["prism/points"][model["prism/modulus"] > 1000])
    assert len(inside) > 50
    assert np.abs(step["point/displacement"][inside] - [0, -6, 0]).max() < 0.01
    assert step["evaluations"] < 100


@pytest.mark.long
def test_a_skin_too_stiff_for_its_tissue_is_refused_or_not_at_rest(run, tmp_path):
    skin = "  material: {young: 0.015, poisson: 0.45, skin: {thickness: 1.5, young: 150000}}"
    (tmp_path / "stiff.yaml").write_text(scene(skin))
    result = run("repose-solve", "stiff.yaml", "-accuracy", 0.01, cwd=tmp_path)
    assert result.returncode in (1, 2), result
    assert "internal error" not in result.stderr and len(result.stderr.splitlines()) <= 1
    assert ("lie too far apart" in result.stderr) == (result.returncode == 1)


def test_isotropic_springs_have_the_solid_s_modulus_of_compression(run, tmp_path):
    file, report = solve(run, tmp_path, "springs",
                       scene("  springs: {isotropic: {young: 0.015, poisson: 0.45}}"))
    shear = 0.015 / 2.9
    assert np.isclose(last(file)["bulk_modulus"], 0.015 / 0.3 - 5 * shear / 3)
    assert set(model_of(file)["spring/exponent"]) == {0}


def test_mesh_and_layers_have_an_estimate_of_their_own(run, tmp_path):
    file, report = solve(run, tmp_path, "coarse", scene("  edge: 7"), "-discretisation")
    assert "mesh and layers" in report and "order" in report
    step, model = last(file), model_of(file)
    error, layer = step["point/discretisation_error"], model["point/layer"]
    assert error.max() > 0.01 and (error[layer > 0] == 0).all()
    moves = np.linalg.norm(step["point/displacement"], axis=1) >= 0.1
    assert np.isclose(error[moves].max(), step["discretisation_error"])
    assert all("point/discretisation_error" in s for s in steps(file))
    # The layers doubled, the face moves by about as much as the estimate says.
    finer = scene("  edge: 7").replace("layers: 4", "layers: 7")
    other = solve(run, tmp_path, "finer", finer, "-accuracy", 0.01)[0]
    skin = lambda f: last(f)["point/position"][model_of(f)["point/layer"] == 0]
    apart_at_skin = np.linalg.norm(skin(file) - skin(other), axis=1)
    assert apart_at_skin.mean() <= 2 * error[layer == 0].mean()


@pytest.mark.parametrize("edge, accuracy, report, more", [
    pytest.param("", 0.01, "MORE THAN THE 0.01 mm REQUESTED: the skin as given is the finest", False,
                 marks=pytest.mark.long),
    ("", 20, "mm from the continuum at most", False),
    ("  edge: 9\n  depths: [0, 0.3, 0.6, 1]", 0.01, "the scene fixes its layers", False),
    ("  edge: 9", 3, "mm from the continuum at most", True)])
def test_adapt_goes_towards_the_continuum_or_says_why_not(run, tmp_path, edge, accuracy, report, more):
    text = scene(edge, JAW_OPENS, head="paper")
    own = solve(run, tmp_path, "own", text, "-accuracy", 1)[0]
    file, message = solve(run, tmp_path, "found", text, "-accuracy", accuracy, "-adapt",
                          status=2 if accuracy == 0.01 else 0)
    assert report in message, message
    step = last(file)
    reached = step["discretisation_error"] <= accuracy
    assert reached == ("MORE THAN" not in message)
    assert (len(step["point/position"]) > len(last(own)["point/position"])) == more
