"""Pictures of a result: what they are of, and what is refused. Needs VTK ≥ 9.4 (pip install vtk)."""

import importlib
import importlib.util
import re
import shutil
import struct
import sys

import pytest

from conftest import PROJECT, TIME_LIMIT, can_draw, finish, shipped

pytestmark = pytest.mark.quick

SCRIPT = PROJECT / "drivers/render.py"


@pytest.fixture
def render(tmp_path, environment):
    def draw(*arguments):
        return finish([sys.executable, "-B", str(SCRIPT), *map(str, arguments)], tmp_path,
                      environment, TIME_LIMIT)

    return draw


def needs_vtk():
    if not can_draw():
        pytest.skip("no VTK from 9.4 on (pip install vtk), nor an older one with xvfb-run")


WRONG = {"no result": (["none"], "none.h5: no such file"),
         "unknown view": (["{}", "-views", "back"], "-views back: unknown, take some of front"),
         "unknown column": (["{}", "-columns", "x"], "-columns x: unknown, take some of before"),
         "no scene": (["{}", "-scene", "none.yaml"], "-scene none.yaml: no such file"),
         "not a film": (["{}", "-film", "way.mp4"], "way.mp4: cannot be written: its name does not end in .gif"),
         "no folder": (["{}", "-output", "none/p.png"], "none; make it first")}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_in_one_line(render, solved, case):
    arguments, part = WRONG[case]
    result = render(*(a.format(solved("paper_jaw_opening.yaml")) for a in arguments))
    assert result.returncode == 1 and len(result.stderr.splitlines()) == 1
    assert part in result.stderr


def size_of(png):
    """Width and height."""
    data = png.read_bytes()
    assert data.startswith(b"\x89PNG")
    return struct.unpack(">II", data[16:24])


def test_a_picture_has_a_column_a_way_and_a_row_a_view(render, solved, tmp_path):
    needs_vtk()
    result = solved("paper_jaw_opening.yaml")
    one = render(result, "-output", "one.png", "-views", "profile", "-columns", "before")
    assert (one.returncode, one.stdout) == (0, f"{tmp_path / 'one.png'}\n"), one.stderr
    many = render(result, "-output", "many.png", "-views", "profile,front",
                  "-columns", "movement,advance,stress,bones")
    assert (many.returncode, many.stderr) == (0, "")
    wide, high = size_of(tmp_path / "one.png")
    four_wide, two_high = size_of(tmp_path / "many.png")
    assert four_wide == 4 * wide and two_high > 1.2 * high


def test_sides_of_a_cut_are_drawn_and_those_of_the_rim_are_not(solved, monkeypatch):
    pytest.importorskip("vtkmodules")
    monkeypatch.syspath_prepend(SCRIPT.parent)
    drawing = importlib.import_module("render")
    drawing.load_modules()
    cut = drawing.Result(solved("head_incision.yaml"))
    places = cut.points(0)[cut.walls].reshape(-1, 3)
    assert len(cut.walls) > 10
    assert (abs(places - [45, -70, -8]) < [20, 25, 30]).all(), "beside the path"
    assert len(drawing.Result(solved("paper_jaw_opening.yaml")).walls) == 0


def test_instruments_of_the_scene_are_drawn(render, solved, tmp_path):
    needs_vtk()
    pytest.importorskip("yaml")
    result = solved("paper_jaw_opening.yaml")
    shapes = ["sphere: {center: [0, -90, 0], radius: 20}", "box: {center: [0, 0, 0], size: [40, 300, 40]}",
              "capsule: {from: [0, 0, 0], to: [0, -150, 0], radius: 5}",
              "half_space: {point: [0, -150, 0], normal: [0, 1, 0]}",
              f"mesh: {PROJECT / 'meshes/head_mandible.ply'}"]
    plain = render(result, "-output", "plain.png", "-views", "front", "-columns", "after")
    assert plain.returncode == 0, plain.stderr
    for shape in shapes:
        (tmp_path / "s.yaml").write_text(f"instruments: [{{{shape}, push: [0, 5, 0]}}]\n")
        drawn = render(result, "-output", "s.png", "-views", "front", "-columns", "after",
                       "-scene", "s.yaml")
        assert (drawn.returncode, drawn.stderr) == (0, ""), shape
        assert (tmp_path / "s.png").read_bytes() != (tmp_path / "plain.png").read_bytes(), shape
    (tmp_path / "s.yaml").write_text("instruments: [{sphere: {radius: 1}, push: [0, 5, 0]}]\n")
    refused = render(result, "-scene", "s.yaml")
    assert refused.returncode == 1 and refused.stderr.count("\n") == 1 and "s.yaml" in refused.stderr


def test_paraview_draws_the_same_result(solved, tmp_path, environment):
    if not shutil.which("pvpython") or not shutil.which("xvfb-run"):
        pytest.skip("ParaView is not installed (python3-paraview xvfb xauth)")
    name = solved("paper_jaw_opening.yaml").with_suffix("")
    result = finish(["xvfb-run", "-a", "-w", "10", "pvpython",
                     str(PROJECT / "drivers/paraview_repose.py"), str(name), "look.png",
                     "look.pvsm"], tmp_path, environment, TIME_LIMIT)
    assert result.returncode == 0, result.stderr
    wide, high = size_of(tmp_path / "look.png")
    state = (tmp_path / "look.pvsm").read_text()
    assert wide == 2.5 * high and "XdmfReader" in state
    assert 'name="skull"' in state and 'name="mandible"' in state, "each bone by its name"


def test_one_color_scale_and_one_direction_everywhere(monkeypatch):
    """ParaView's macro and the viewer cannot import those of drivers/sheet."""
    monkeypatch.syspath_prepend(SCRIPT.parent)
    ramp = importlib.import_module("sheet").RAMP
    macro = (SCRIPT.parent / "paraview_repose.py").read_text()
    viewer = (SCRIPT.parent / "web/viewer.js").read_text()
    for text, start in ((macro, "RAMP = ("), (viewer, "REPOSE_RAMP = [")):
        written = text.split(start)[1].split(")")[0].split("]")[0]
        assert tuple(re.findall('"([0-9a-f]{6})"', written)) == ramp
    assert "PROFILE = (-0.65, -0.75, 0.1), (-1, 0, 0)" in macro
    assert 'right: [-1, 0, 0]' in viewer and '"three-quarter": [-0.65, -0.75, 0.1]' in viewer


def test_a_film_shows_the_load_steps(render, solved, tmp_path):
    needs_vtk()
    if importlib.util.find_spec("PIL") is None:
        pytest.skip("Pillow is not installed")
    from PIL import Image
    film = render(solved("paper_jaw_opening.yaml"), "-film", "way.gif", "-frames", 3, "-views",
                  "profile", "-columns", "after")
    assert (film.returncode, film.stderr) == (0, "")
    with Image.open(tmp_path / "way.gif") as frames:
        assert frames.n_frames == 3
        first = frames.convert("RGB").tobytes()
        frames.seek(2)
        assert frames.convert("RGB").tobytes() != first


def drawing_module(monkeypatch):
    pytest.importorskip("vtkmodules")
    monkeypatch.syspath_prepend(SCRIPT.parent)
    drawing = importlib.import_module("render")
    drawing.load_modules()
    return drawing


def test_two_results_stand_beside_each_other_with_their_difference(render, solved, tmp_path):
    needs_vtk()
    one = other = solved("paper_jaw_opening.yaml")
    result = render(one, other, "-output", "two.png", "-views", "profile", "-columns", "before,after")
    assert (result.returncode, result.stderr) == (0, "")
    single = render(one, "-output", "one.png", "-views", "profile", "-columns", "before")
    assert single.returncode == 0
    assert size_of(tmp_path / "two.png")[0] == 4 * size_of(tmp_path / "one.png")[0]
    assert "shows one result" in render(one, other, "-film", "way.gif").stderr


def test_the_difference_is_that_of_the_faces(solved, monkeypatch):
    drawing = drawing_module(monkeypatch)
    results = [drawing.Result(solved(name)) for name in ("head_solid.yaml", "head_incision.yaml")]
    apart = drawing.difference(results, [result.state(-1) for result in results])
    near = drawing.shown_skin.nearest(results[0].before, results[1].before)
    moves = [result.skin(-1) - result.before for result in results]
    assert apart.max() > 5
    copy = [results[1]] * 2
    assert drawing.difference(copy, [one.state(-1) for one in copy]).max() == 0, "also along the cut"
    assert abs(apart - ((moves[1] - moves[0][near])**2).sum(1)**0.5).max() < 1e-9


def test_profiles_look_to_the_right(solved, monkeypatch):
    """The tip of the nose is right of the ear in the camera's coordinates."""
    drawing = drawing_module(monkeypatch)
    for view in ("profile", "three-quarter"):
        forward = -drawing.np.array(drawing.VIEWS[view])
        right = drawing.np.cross(forward, (0, 0, 1))
        assert right @ (0, -1, 0) > 0.5, view


def test_the_given_skin_is_drawn_and_opens_at_the_lips(run, tmp_path, monkeypatch):
    drawing = drawing_module(monkeypatch)
    (tmp_path / "cut.yaml").write_text(shipped("head_incision.yaml", layers=2, edge=8))
    assert run("repose-solve", "cut.yaml", "-accuracy", 1, "-allow_folded").returncode == 0
    given, solved = (drawing.Result(str(tmp_path / "cut.h5"), only) for only in (False, True))
    assert len(given.before) > 1.5 * len(solved.before)
    places = drawing.shown_skin.sides_of_cuts(drawing.shown_skin.solved_skin(given.h5)[0])
    assert len(places) > 4
    stored = drawing.shown_skin.read_given(given.h5)
    of_stored = {places.tobytes() for places in stored.before[stored.corners]}
    own = given.corners[[places.tobytes() in of_stored for places in given.before[given.corners]]]
    assert len(set(given.corners.ravel())) == len(given.before), "vertices that are hidden are left out"
    assert 0.8 * len(stored.corners) < len(own) < len(stored.corners), "only those at the cut go"
    near = drawing.shown_skin.near(given.before, places, 3.0)
    assert not near[own].any() and near[given.corners].any(), "the solved skin takes their place"
    apart = [given.skin(-1)[(given.before == place).all(1)] for place in places]
    assert max(abs(sides[0] - sides[-1]).max() for sides in apart) > 0.1, "it opens"
