"""Scenes by landmarks from outside: proposed landmarks place cuts, part lips and move jaws of heads."""

import json
import re
import shutil
import sys

import h5py
import meshio
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import volumes
from conftest import PROJECT, RUNS_ALL, runner
from tissue import apart, last, model_of

MESHES = PROJECT / "meshes"
DATA = PROJECT.parent / "shared/data/head"
REAL = pytest.mark.skipif(not DATA.is_dir(), reason=f"no real head: {DATA} is missing")
HEADS = [pytest.param("head"), pytest.param("real_head", marks=REAL)]
MARKS = ("pronasale", "subnasale", "upper_lip", "lower_lip", "b_soft", "pogonion_soft")
TEMPLATES = {"le_fort_1": "skull", "genioplasty": "mandible", "sagittal_split": "mandible"}


@pytest.fixture(scope="module")
def proposed(tmp_path_factory, environment):
    """proposed(name) → a folder with skin and bones of a head and its proposed landmarks, made once."""
    folders = {}

    def make(name):
        if name in folders:
            return folders[name]
        folder = folders[name] = tmp_path_factory.mktemp(name)
        for part in ("skin", "skull", "mandible"):
            source = DATA / f"{part}.ply" if name == "real_head" else MESHES / f"head_{part}.ply"
            (folder / f"{part}.ply").symlink_to(source)
        result = runner(folder, environment)("repose-landmarks", "skin.ply", "-skull", "skull.ply", "-mandible",
                                             "mandible.ply", "-output", "head")
        assert (result.returncode, result.stderr) == (0, ""), result
        return folder

    return make


@pytest.fixture
def head(request, proposed, tmp_path):
    """Skin and bones of a head in a folder, with its proposed landmarks."""
    shutil.copytree(proposed(request.param), tmp_path, symlinks=True, dirs_exist_ok=True)
    markup, = json.loads((tmp_path / "head.mrk.json").read_text())["markups"]
    return {point["label"]: np.array(point["position"]) for point in markup["controlPoints"]}


def write_scene(folder, more, tissue="layers: 4, edge: 6", anatomy="landmarks: head.mrk.json"):
    (folder / "scene.yaml").write_text(
        "skin: skin.ply\nbones:\n  - {name: skull, file: skull.ply}\n"
        "  - {name: mandible, file: mandible.ply}\n"
        f"tissue: {{{tissue}}}\nanatomy: {{{anatomy}}}\n{more}")


def test_crowns_above_the_lingual_cut_do_not_hold_a_split_together(run, tmp_path):
    z, y, x = np.meshgrid(*(1.5 * np.arange(n) + low for n, low in ((52, -3), (64, -70), (76, -57))), indexing="ij")
    box = lambda wide, deep, high: ((np.abs(x) > wide[0]) & (np.abs(x) < wide[1]) & (y > deep[0])
                                    & (y < deep[1]) & (z > high[0]) & (z < high[1]))
    jaw = (box((-1, 50), (-62, -50), (0, 44)) | box((32, 50), (-62, 20), (0, 15))
           | box((38, 50), (-5, 20), (0, 72)) | box((34, 44), (-50, -6), (0, 60)))
    volumes.write_segmentation(tmp_path / "jaw.seg.nrrd", jaw, ["Mandible"], (-57, -70, -3), 1.5)
    assert run("repose-isosurface", "jaw.seg.nrrd", "-label", "1", "-output",
               "mandible.ply").returncode == 0
    for part in ("skin", "skull"):
        (tmp_path / f"{part}.ply").symlink_to(MESHES / f"head_{part}.ply")
    marks = {"condyle_right_center": (-44, 8, 70), "condyle_left_center": (44, 8, 70), "menton_bone": (0, -56, 0),
             "lower_incisor_edge": (0, -60, 44), "upper_incisor_edge": (0, -62, 42)}
    (tmp_path / "head.mrk.json").write_text(json.dumps({"markups": [{
        "type": "Fiducial", "coordinateSystem": "LPS",
        "controlPoints": [{"label": name, "position": at} for name, at in marks.items()]}]}))
    write_scene(tmp_path, "osteotomies: [{bone: mandible, piece: jaw, template: sagittal_split, kerf: 0.5}]\n")
    result = run("repose-osteotomy", "scene.yaml", "-output", "plan")
    assert (result.returncode, result.stderr) == (0, ""), result
    piece, rest = (meshio.read(tmp_path / f"plan_{part}.ply").points for part in ("jaw", "mandible"))
    assert piece[:, 1].min() < -55 < rest[:, 1].min() and rest[:, 2].max() > 65 > piece[:, 2].max()


@pytest.mark.parametrize("template", TEMPLATES)
@pytest.mark.parametrize("head", HEADS, indirect=True)
def test_templates_cut_any_head(run, tmp_path, head, template):
    write_scene(tmp_path, f"osteotomies: [{{bone: {TEMPLATES[template]}, piece: part, "
                          f"template: {template}, kerf: 0.5}}]\n")
    result = run("repose-osteotomy", "scene.yaml", "-output", "plan")
    assert (result.returncode, result.stderr) == (0, ""), result
    piece = meshio.read(tmp_path / "plan_part.ply").points
    edge = head["upper_incisor_edge" if template == "le_fort_1" else "lower_incisor_edge"]
    near = np.linalg.norm(piece - edge, axis=1).min()
    assert (near > 15) if template == "genioplasty" else (near < 4)
    if template == "le_fort_1":
        assert piece[:, 2].max() > head["nasal_spine"][2]
    if template == "sagittal_split":
        condyles = np.array([head["condyle_left_center"], head["condyle_right_center"]])
        assert np.linalg.norm(piece[:, None] - condyles, axis=2).min() > 5


def turn_head(folder, turn):
    """Puts skin, bones and landmarks of the head in a folder, turned, into its folder turned."""
    (folder / "turned").mkdir()
    for part in ("skin", "skull", "mandible"):
        mesh = meshio.read(folder / f"{part}.ply")
        mesh.points = mesh.points @ turn.T
        mesh.write(folder / "turned" / f"{part}.ply")
    text = json.loads((folder / "head.mrk.json").read_text())
    for point in text["markups"][0]["controlPoints"]:
        point["position"] = list(turn @ point["position"])
    (folder / "turned/head.mrk.json").write_text(json.dumps(text))


@pytest.mark.parametrize("right, left, words", [
    ((-40, -30, 0), (40, 30, 0), r"forward.*to the right|to the right.*forward"),
    ((-50, 0, 0), (50, 0, 0), "forward"), ((0, 50, 0), (0, -50, 0), "forward")])
def test_the_answer_is_along_the_head_without_anatomy(run, tmp_path, right, left, words):
    """Of landmarks that are given for moves, too; condyles one behind the other give no axes."""
    scene = (MESHES / "paper_jaw_advance.yaml").read_text().replace(": paper_", f": {MESHES}/paper_")
    (tmp_path / "marks.json").write_text(json.dumps({"condyle_right_center": right, "condyle_left_center": left}))
    (tmp_path / "scene.yaml").write_text(scene + "landmarks: marks.json\n")
    answer, = re.findall(r"^(?:Chin|Largest).*", run("repose-solve", "scene.yaml").stdout, re.M)
    chin = answer.split(";")[0]
    assert re.search(words, chin) and ("right" in words or "right" not in chin), answer


@pytest.mark.parametrize("template, move", [
    *(pytest.param(*more, marks=pytest.mark.long)
      for more in (("le_fort_1", "advance: 4, impaction: 2, yaw: 2"), ("genioplasty", "advance: 6"))),
    ("sagittal_split", "set_back: 5")])
@pytest.mark.parametrize("head", ["head"], indirect=True)
def test_plan_and_face_turn_with_the_head(run, tmp_path, head, template, move):
    """On the given mesh, which turns with the head: a remeshed skin is another one in another pose."""
    turn = Rotation.from_euler("xyz", [-10, 5, -6], degrees=True).as_matrix()
    turn_head(tmp_path, turn)
    ways, pieces, motions = [], [], []
    for folder, axes in ((".", np.eye(3)), ("turned", turn)):
        write_scene(tmp_path / folder, f"osteotomies: [{{bone: {TEMPLATES[template]}, piece: part, "
                                       f"template: {template}, kerf: 2.5}}]\n"
                                       f"moves: [{{bone: part, clinical: {{{move}}}}}]\n",
                    tissue="layers: 4, edge: given")
        for program, *more in (("repose-osteotomy",), ("repose-solve", "-skip_other_rest")):
            result = run(program, f"{folder}/scene.yaml", "-output", f"{folder}/face", *more)
            assert (result.returncode, result.stderr) == (0, ""), result
        pieces.append(meshio.read(tmp_path / folder / "face_part.ply").points @ axes)
        model, rest = (of(tmp_path / folder / "face.h5") for of in (model_of, last))
        motions.append(axes.T @ model["bone_transform"][-1, :3] @ np.block(
            [[axes, np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]]))
        skin = np.flatnonzero(model["point/layer"] == 0)
        at, now = (points[skin] @ axes for points in (model["point/position"], rest["point/position"]))
        nearest = cKDTree(at).query([head[name] for name in MARKS], 3)[1]
        ways.append((now - at)[nearest].mean(axis=1))
    assert cKDTree(pieces[0]).query(pieces[1])[0].max() < 0.01
    assert cKDTree(pieces[1]).query(pieces[0])[0].max() < 0.01
    assert np.abs(motions[0] - motions[1]).max() < 1e-3
    assert np.linalg.norm(ways[0], axis=1).max() > 1.5
    assert np.linalg.norm(ways[0] - ways[1], axis=1).max() < 0.1, "mm, the accuracy"


@pytest.mark.parametrize("head", ["head"], indirect=True)
def test_the_planning_sheet_has_the_axes_of_clinical_moves(run, tmp_path, head):
    turn_head(tmp_path, Rotation.from_euler("xyz", [-15, 7, -9], degrees=True).as_matrix())
    sys.path.insert(0, str(PROJECT / "drivers"))
    from sheet.landmarks import head_axes, read_landmarks
    axes, _ = head_axes(read_landmarks(tmp_path / "turned/head.mrk.json"))
    for row, move, sign in ((0, "left", 1), (1, "set_back", 1), (2, "lower", -1)):
        write_scene(tmp_path / "turned", f"moves: [{{bone: mandible, clinical: {{{move}: 10}}}}]\n")
        result = run("repose-osteotomy", "turned/scene.yaml", "-moved", "-output", "cut")
        assert (result.returncode, result.stderr) == (0, ""), result
        before, after = (meshio.read(tmp_path / f"cut_mandible{end}.ply").points for end in ("", "_moved"))
        assert np.abs(after - before - sign * 10 * axes[row]).max() < 1e-4


def lip_gap(initial, rest, head):
    """mm along z between the two skin points that were one vertex nearest to stomion."""
    places, vertex, count = np.unique(initial, axis=0, return_inverse=True, return_counts=True)
    twice = np.flatnonzero(count == 2)
    nearest = twice[np.linalg.norm(places[twice] - head["stomion"], axis=1).argmin()]
    one, other = rest[vertex.ravel() == nearest]
    return abs(one[2] - other[2])


@REAL
@pytest.mark.parametrize("head", ["real_head"], indirect=True)
def test_lips_part_and_do_not_hold_to_teeth(run, tmp_path, head):
    write_scene(tmp_path, "osteotomies: [{bone: mandible, piece: jaw, template: sagittal_split, "
                          "kerf: 0.5}]\nmoves: [{bone: jaw, clinical: {set_back: 5}}]\n",
                anatomy="landmarks: head.mrk.json, adhesion: 0")
    result = run("repose-solve", "scene.yaml", "-output", "face", "-skip_other_rest")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "lips are parted along their crease by landmarks" in result.stdout
    assert "vestibule by landmarks" in result.stdout
    model, rest = model_of(tmp_path / "face.h5"), last(tmp_path / "face.h5")["point/position"]
    skin = np.flatnonzero(model["point/layer"] == 0)
    way = (rest[skin] - model["point/position"][skin])[:, 1] / 5

    def ratio(name):
        off = np.linalg.norm(model["point/position"][skin] - head[name], axis=1)
        return way[np.argsort(off)[:3]].mean()

    assert ratio("pogonion_soft") > 0.9
    stated, = re.findall(r"Lips (\d\.\d) mm apart at stomion, closed at first\.", result.stdout)
    assert abs(float(stated) - lip_gap(model["point/position"][skin], rest[skin], head)) < 0.06
    assert ratio("lower_lip") < 0.93 and ratio("upper_lip") < 0.3
    assert run("repose-check", "face.h5").returncode == 0


@REAL
@pytest.mark.long
@pytest.mark.parametrize("head", ["real_head"], indirect=True)
def test_the_lower_lip_adheres_to_its_teeth_in_a_set_back(run, tmp_path, head):
    """It follows them farther, by as much on three ranks, and the upper lip stays."""
    lips = {}
    for name, adhesion, ranks in (("off", 0, 1), ("on", 5e-4, 1), ("shared", 5e-4, 3)):
        write_scene(tmp_path, "osteotomies: [{bone: mandible, piece: jaw, template: sagittal_split, "
                              "kerf: 0.5}]\nmoves: [{bone: jaw, clinical: {set_back: 5}}]\n",
                    anatomy=f"landmarks: head.mrk.json, adhesion: {adhesion}")
        result = run("repose-solve", "scene.yaml", "-output", name, "-skip_other_rest", ranks=ranks)
        assert (result.returncode, result.stderr) == (0, ""), result
        assert ("points of the lips adhere to teeth" in result.stdout) == (adhesion > 0)
        assert run("repose-check", f"{name}.h5").returncode == 0
        model, step = model_of(tmp_path / f"{name}.h5"), last(tmp_path / f"{name}.h5")
        skin = np.flatnonzero(model["point/layer"] == 0)
        for mark in ("lower_lip", "upper_lip"):
            off = np.linalg.norm(model["point/position"][skin] - head[mark], axis=1)
            way = step["point/displacement"][skin[np.argsort(off)[:3]], 1].mean()
            lips[name, mark] = way / 5
    assert lips["on", "lower_lip"] > lips["off", "lower_lip"] + 0.05
    assert abs(lips["on", "upper_lip"] - lips["off", "upper_lip"]) < 0.05
    assert abs(lips["on", "lower_lip"] - lips["shared", "lower_lip"]) < 0.005


@pytest.mark.quick
@pytest.mark.parametrize("head", ["head"], indirect=True)
def test_tissue_whose_lips_adhere_is_balanced_under_tension(run, tmp_path, head):
    write_scene(tmp_path, "gravity: [0, 0, -9.81]\nmoves: [{bone: mandible, clinical: {advance: 0.01}}]\n",
                tissue="layers: 3, edge: 8, material: {preset: skin_on_fat}, turgor: 0.04, density: 1e-6")
    result = run("repose-solve", "scene.yaml", "-output", "face", "-skip_other_rest")
    assert (result.returncode, result.stderr) == (0, ""), result
    assert "points of the lips adhere to teeth" in result.stdout
    assert np.linalg.norm(last(tmp_path / "face.h5")["point/displacement"], axis=1).max() < 0.05


@pytest.mark.parametrize("head", ["head"], indirect=True)
def test_lips_adhere_to_a_maxilla_that_holds_no_tissue(run, tmp_path, head):
    write_scene(tmp_path, "osteotomies: [{bone: skull, piece: maxilla, template: le_fort_1, kerf: 3}]\n"
                          "moves: [{bone: maxilla, clinical: {set_back: 3}}]\n", tissue="layers: 4, edge: 6, release: 50")
    result = run("repose-solve", "scene.yaml", "-output", "face", "-skip_other_rest")
    assert (result.returncode, result.stderr) == (0, ""), result
    model = model_of(tmp_path / "face.h5")
    maxilla = list(model["bone"]).index(b"maxilla")
    assert maxilla not in model["point/bone"]
    assert maxilla in model["element/0/numbers"].reshape(-1, 7)[:, 6]
    assert run("repose-check", "face.h5").returncode == 0


@pytest.mark.parametrize("head", ["head"], indirect=True)
def test_ranks_make_the_parts_of_lips_that_adhere(run, tmp_path, head):
    """The mouth of this head is open: no cut parts its lips."""
    write_scene(tmp_path, "moves: [{bone: mandible, clinical: {set_back: 3}}]\n", tissue="layers: 4, edge: 8")
    models, rests = [], []
    for ranks in (1, 2, 3, 5) if RUNS_ALL else (1, 3, 5):
        result = run("repose-solve", "scene.yaml", "-output", f"on{ranks}", ranks=ranks)
        assert (result.returncode, result.stderr) == (0, ""), result
        assert (f"by {ranks} ranks, each its part" in result.stdout) == (ranks > 1)
        models.append(model_of(tmp_path / f"on{ranks}.h5"))
        rests.append(last(tmp_path / f"on{ranks}.h5"))
    assert len(models[0]["element/0/points"]) > 0
    for model, rest in zip(models, rests):
        assert model.keys() == models[0].keys()
        assert [name for name in model if model[name].tobytes() != models[0][name].tobytes()] == []
        assert apart(rest, rests[0]) < 0.1  # the accuracy


@pytest.mark.parametrize("head", ["head"], indirect=True)
def test_a_share_of_the_tissue_of_a_chin_stays_attached_on_any_ranks(run, tmp_path, head):
    chin = ("osteotomies: [{bone: mandible, piece: chin, template: genioplasty, kerf: 0.5}]\n"
            "moves: [{bone: chin, clinical: {advance: 8}}]\n")
    models = {}
    for pedicle, ranks in ((0.7, 1), (0.7, 3), (0, 1)):
        write_scene(tmp_path, chin, anatomy=f"landmarks: head.mrk.json, pedicle: {pedicle}")
        result = run("repose-solve", "scene.yaml", "-output", "chin", "-accuracy", 1, "-skip_other_rest",
                     ranks=ranks)
        assert (result.returncode, result.stderr) == (0, ""), result
        assert ("so that 70 % of it stays attached" in result.stdout) == (pedicle > 0)
        models[pedicle, ranks] = model_of(tmp_path / "chin.h5")
    of_one, of_three = models[0.7, 1], models[0.7, 3]
    assert [name for name in of_one if of_one[name].tobytes() != of_three[name].tobytes()] == []
    chin = list(of_one["bone"]).index(b"chin")
    attached = [(model["point/bone"] == chin).sum() for model in (of_one, models[0, 1])]
    assert attached[0] > attached[1] > 0


@pytest.mark.quick
@pytest.mark.parametrize("head", ["head"], indirect=True)
def test_landmarks_of_another_head_are_refused_in_one_line(run, tmp_path, head):
    for name, place in head.items():
        head[name] = (place + [0, 60, 0]).tolist()
    (tmp_path / "far.json").write_text(json.dumps(head))
    write_scene(tmp_path, "moves: [{bone: mandible, clinical: {advance: 3}}]\n",
                anatomy="landmarks: far.json")
    for program in ["repose-solve"], ["repose-osteotomy", "-moved"], ["repose-collide"]:
        result = run(program[0], "scene.yaml", *program[1:])
        assert result.returncode == 1 and result.stderr.count("\n") == 1, program
        assert "the landmarks are those of another head or in another frame" in result.stderr
    assert not list(tmp_path.glob("*_mandible*.ply"))


@pytest.mark.parametrize("head", ["head"], indirect=True)
def test_a_plane_through_the_palate_is_reported(run, tmp_path, head):
    below = head["nasal_spine"][2] - 4
    write_scene(tmp_path, f"osteotomies: [{{bone: skull, piece: part, planes: [{{point: [0, -60, "
                          f"{below}], normal: [0, 0, -1]}}, {{point: [0, -20, 0], normal: [0, -1, "
                          "0]}]}]\nmoves: [{bone: part, translate: [0, -2, 0]}]\n")
    plan = run("repose-osteotomy", "scene.yaml")
    result = run("repose-solve", "scene.yaml", "-output", "face", "-skip_other_rest")
    assert (plan.returncode, result.returncode) == (0, 0), result
    for text in (plan.stdout, result.stdout):
        assert "osteotomies[0]: its plane passes 4.0 mm below the nasal spine" in text
    assert "the mouth is open in the scan" in result.stdout
    with h5py.File(tmp_path / "face.h5") as file:
        assert len(file["model"]) > 0


def test_coarser_models_have_the_tone_of_the_mouth(run, tmp_path):
    head, coarse = PROJECT / "meshes/head", []
    done = run("repose-landmarks", f"{head}_skin.ply", "-skull", f"{head}_skull.ply", "-mandible",
               f"{head}_mandible.ply", "-output", "head")
    assert done.returncode == 0, done
    for tone in (0, 1):
        (tmp_path / "face.yaml").write_text(
            f"skin: {head}_skin.ply\nbones:\n  - {{name: skull, file: {head}_skull.ply}}\n"
            f"  - {{name: mandible, file: {head}_mandible.ply}}\ntissue: {{layers: 3}}\n"
            f"anatomy: {{landmarks: head.mrk.json, adhesion: 0, tone: {tone}}}\n"
            "moves: [{bone: mandible, clinical: {set_back: 3}}]\n")
        done = run("repose-solve", "face.yaml", "-discretisation")
        assert done.returncode == 0, done
        coarse.append(re.findall(r"coarse model +(.* of the Hessian).* s(.*)", done.stdout))
    assert len(coarse[0]) > 1 and coarse[0] != coarse[1]  # the searches, and the faces
