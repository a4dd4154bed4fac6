"""The page of drivers/live.py and its server: who is answered, and what a browser does with it."""

import importlib.util
import json
import os
import re
import sys
import threading
import types
import urllib.error
import urllib.request

import meshio
import numpy as np
import pytest
from browser import FOUND, browse
from conftest import PROJECT, programs, shipped
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(PROJECT / "drivers/python"))
import repose  # noqa: E402

SCENE = PROJECT / "meshes/head_live.yaml"
HELPERS = """
const sleep = time => new Promise(end => setTimeout(end, time));
const mark = () => document.getElementById("mark");
const exact = async () => { while (mark().className !== "exact") await sleep(30); };
"""
TOLD = """
.catch(reason => ({error: String(reason.stack)})).then(found => {
  const told = document.createElement("pre");
  told.id = "found";
  told.textContent = JSON.stringify(found);
  document.body.append(told);
});
"""
SCRIPT = """
(async () => {
  const found = {};
  while (!window.planner || !planner.reference) await sleep(30);
  await exact();
  found.pieces = [...planner.pieces.keys()];
  found.first = Math.max(...planner.movement(planner.position));
  const canvas = planner.viewer.three.renderer.domElement;
  canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
  document.getElementById("look").value = "right";
  document.getElementById("look").onchange();
  const box = canvas.getBoundingClientRect();
  const at = planner.handle.position.clone().project(planner.viewer.three.camera);
  const fire = (kind, y) => canvas.dispatchEvent(new PointerEvent(kind, {
    pointerType: "mouse", bubbles: true, button: kind === "pointermove" ? -1 : 0, buttons: 1,
    clientX: box.left + (at.x + 1) / 2 * box.width, clientY: box.top + (1 - at.y) / 2 * box.height - y}));
  const before = JSON.stringify(planner.plan);
  for (const start of [40, 50, 60, 70]) {
    fire("pointermove", start);
    if (planner.gizmo.axis !== "Z") continue;
    fire("pointerdown", start);
    for (let y = start; y < start + 4; ++y) fire("pointermove", y);
    found.during = mark().textContent;
    const shown = planner.position.slice();
    fire("pointerup", start + 3);
    await exact();
    found.off = Math.max(...shown.map((x, i) => Math.abs(x - planner.position[i])));
    break;
  }
  found.dragged = planner.plan.chin.translate[2];
  document.getElementById("undo").click();
  found.undone = JSON.stringify(planner.plan) === before;
  await exact();
  const pixel = new Uint8Array(4 * canvas.width * canvas.height), gl = canvas.getContext("webgl2");
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  found.angles = document.getElementById("angles").textContent;
  found.colors = new Set(new Uint32Array(pixel.buffer)).size;
  planner.head.axes = [[1, 0, 0], [0, 0.8, 0.6], [0, -0.6, 0.8]];
  document.getElementById("reset").click();
  planner.inputs[0].value = 2;
  planner.inputs[0].dispatchEvent(new Event("change"));
  found.typed = planner.plan.chin.translate;
  found.numbers = planner.inputs.map(input => Number(input.value));
  found.wide = document.documentElement.scrollWidth - innerWidth;
  found.loaded = performance.getEntriesByType("resource").map(one => new URL(one.name).host)
    .filter(host => host !== location.host);
  return found;
})()"""
# The solver answers without derivatives while `without` is true.
FORMER = """
let without = true;
const answered = unpack;
unpack = buffer => {
  const answer = answered(buffer);
  if (without) answer.arrays = Object.fromEntries(
    Object.entries(answer.arrays).filter(([name]) => !name.startsWith("tangent_")));
  return answer;
};
(async () => {
  const text = id => document.getElementById(id)?.textContent, found = {};
  const seen = () => ({mark: mark().textContent, kind: mark().className, measured: text("measured"),
    which: text("which"), unit: text("unit"),
    angles: getComputedStyle(document.getElementById("angles")).visibility,
    off: ["keep", "save_stl"].map(id => document.getElementById(id).disabled),
    under: planner.describe({state: 1, at: () => [0, 0, 0]})});
  const type = value => {
    planner.inputs[0].value = value;
    planner.inputs[0].dispatchEvent(new Event("change"));
  };
  while (!window.planner) await sleep(1);
  await exact();
  found.first = seen();
  const face = planner.position;
  type(-6);
  found.typed = seen();
  found.stays = planner.position === face;
  document.getElementById("undo").click();
  found.undone = seen();
  type(-6);
  await exact();
  found.then = seen();
  without = false;
  await planner.solve(true);
  type(-5);
  found.preview = seen();
  planner.keep();
  const kept = () => planner.describe({state: 2, at: () => [0, 0, 0]}).startsWith("plan A, preview: ");
  found.kept = [kept()];
  await exact();
  found.kept.push(kept(), planner.kept.every((x, i) => x === planner.position[i]));
  await planner.solve(true);
  planner.reference.columns.delete("chin ty");
  type(-4);
  found.missing = seen();
  return found;
})()"""
# Another window overtakes the first four requests for a face.
OVERTAKEN = """
const pauses = [], wait = setTimeout, request = ask;
setTimeout = (work, time) => {
  if (time >= 1000) pauses.push(time);
  return wait(work, Math.min(time, 60));
};
ask = (path, given) => path === "/solve" && pauses.length < 4 ? new ArrayBuffer(0) : request(path, given);
(async () => {
  while (!window.planner) await sleep(1);
  await exact();
  return {pauses};
})()"""
# Verifications find less energy at the plan on which the page rests.
LOWER = """
const starts = [], request = ask;
ask = (path, given) => {
  if (path === "/notice")
    return new TextEncoder().encode(JSON.stringify({text: "", good: false, plan: planner.plan, lower: true}));
  if (path === "/solve") starts.push([given.base ?? "", given.other_rest ?? false]);
  return request(path, given);
};
(async () => {
  while (!window.planner || !planner.reference) await sleep(1);
  const before = starts.length;
  for (let times = 0; times < 3; ++times) await showNotice();
  while (!mark().textContent.includes(" mm, of less energy")) await sleep(30);
  return {starts: starts.slice(before)};
})()"""
WARNED = """
(async () => {
  const found = {}, told = () => document.getElementById("cautions").textContent;
  while (!window.planner || !planner.reference) await sleep(30);
  const type = async value => {
    planner.inputs[1].value = value;
    planner.inputs[1].dispatchEvent(new Event("change"));
    found.soon = told();
    await exact();
    while (planner.reference.plan.chin.translate[2] !== value) await sleep(30);
  };
  await type(6);
  await exact();
  found.mark = mark().textContent;
  found.told = told().split("\\n");
  return found;
})()"""
VIEWS = """
(async () => {
  const found = {}, show = mode => {
    document.getElementById("mode").value = mode;
    document.getElementById("mode").onchange();
    return [document.getElementById("mode").value, ...planner.viewer.shown.states];
  };
  while (!window.planner) await sleep(1);
  found.early = [planner.position === undefined, show("plans")];
  await exact();
  document.getElementById("keep").click();
  document.getElementById("reset").click();
  await exact();
  found.scale = [Number(document.getElementById("high").textContent), Math.max(...planner.movement(planner.kept))];
  const {viewer} = planner, canvas = viewer.three.renderer.domElement, box = canvas.getBoundingClientRect();
  const drawn = [], {renderer} = viewer.three, render = renderer.render;
  renderer.render = (...given) => {
    drawn.push(planner.gizmo.getHelper().visible);
    render.apply(renderer, given);
  };
  for (const mode of ["side", "split", "after"]) {
    drawn.length = 0;
    show(mode);
    found[mode] = drawn.slice(-(mode === "after" ? 1 : 2));
  }
  show("side");
  const at = planner.handle.position.clone().project(viewer.three.camera), grabbed = share => {
    for (let y = 30; y < 90; y += 4) {
      canvas.dispatchEvent(new PointerEvent("pointermove", {pointerType: "mouse", bubbles: true, button: -1,
        clientX: box.left + (share + (at.x + 1) / 4) * box.width,
        clientY: box.top + (1 - at.y) / 2 * box.height - y}));
      if (planner.gizmo.axis === "Z") return true;
    }
    return false;
  };
  found.grabbed = [grabbed(0), grabbed(0.5)];
  return found;
})()"""


@pytest.fixture(scope="module")
def live():
    specification = importlib.util.spec_from_file_location("live", PROJECT / "drivers/live.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """The shipped scene of the plan with longer edges."""
    file = tmp_path_factory.mktemp("coarse") / SCENE.name
    file.write_text(shipped(SCENE.name, layers=3, edge=6))
    return file


@pytest.fixture(scope="module")
def served(live, environment, scene):
    """A running server and its address."""
    os.environ.update(environment)
    with repose.Session(scene, program=programs() / "repose-live") as session:
        server, address = live.make_server(session, scene)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server, address
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.mark.quick
def test_angles_are_those_of_the_head_in_any_pose(live, tmp_path):
    skin = meshio.read(PROJECT / "meshes/head_skin.ply")
    marks = json.loads((PROJECT / "meshes/head_landmarks.json").read_text())
    moved, found = skin.points - np.outer(skin.points[:, 2] < -45, [0, 4, 0]), []
    for turn in (np.eye(3), Rotation.from_euler("xyz", [-10, 12, 20], degrees=True).as_matrix()):
        (tmp_path / "marks.json").write_text(json.dumps(
            {name: list(turn @ place) if isinstance(place, list) else place for name, place in marks.items()}))
        (tmp_path / "scene.yaml").write_text("landmarks: marks.json\n")
        session = types.SimpleNamespace(initial=skin.points @ turn.T, triangles=skin.cells_dict["triangle"], axes=turn.T)
        angles = live.ProfileAngles(tmp_path / "scene.yaml", session).of(moved @ turn.T)
        found.append({angle["name"]: (angle["before"], angle["after"]) for angle in angles})
    assert found[0].keys() == found[1].keys() and len(found[0]) >= 3
    for name, values in found[0].items():
        assert np.allclose(values, found[1][name], atol=0.01), name
    assert abs(np.subtract(*found[0]["facial convexity"])) > 1


def test_a_scene_has_any_name(live, tmp_path):
    assert b"<title>a &lt;plan&gt; &amp; more</title>" in live.page(tmp_path / "a <plan> & more.yaml")


def status(address, path, headers=None, content=None):
    request = urllib.request.Request(address.split("/?")[0] + path, content, headers or {})
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as refusal:
        return refusal.code, refusal.read()


def test_nothing_is_answered_without_the_token(served):
    server, address = served
    token = {"X-Token": server.token}
    assert status(address, "/scene")[0] == 403
    assert status(address, "/?token=guess")[0] == 403
    assert status(address, "/solve", {"X-Token": "x"}, b"{}")[0] == 403
    assert status(address, "/scene", {**token, "Host": "elsewhere.example"})[0] == 403
    assert status(address, "/scene", token)[0] == 200
    assert status(address, "/elsewhere", token)[0] == 404
    assert server.server_address[0] == "127.0.0.1"


@pytest.mark.quick
def test_requests_are_answered_or_refused_in_words(served):
    server, address = served
    token = {"X-Token": server.token}
    for content in (b"", b"[]", b"{", b"\xff", b"[" * 100000 + b"]" * 100000):
        code, message = status(address, "/solve", token, content)
        assert code == 400 and message.count(b"\n") == 1
    for length in ("-5", "many", str(1 << 30)):
        code, message = status(address, "/solve", {**token, "Content-Length": length}, b"{}")
        assert code == 400 and message.count(b"\n") == 1
    far = json.dumps({"plan": {"chin": {"translate": [0, 99, 0]}}}).encode()
    code, message = status(address, "/solve", token, far)
    assert code == 409 and b"'chin': translation 99 mm" in message


def test_a_solver_or_scene_that_is_gone_is_said_in_words(live, environment, scene, tmp_path):
    os.environ.update(environment)
    own = tmp_path / "own.yaml"
    own.write_text(scene.read_text())
    with repose.Session(own, program=programs() / "repose-live") as session:
        server, address = live.make_server(session, own)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            own.write_bytes(b"\0")
            code, notice = status(address, "/notice", {"X-Token": server.token})
            assert code == 200 and "has changed on disk" in json.loads(notice)["text"]
            session._process.kill()
            code, message = status(address, "/scene", {"X-Token": server.token})
            assert code == 409 and message.startswith(b"repose-live has ended")
        finally:
            server.shutdown()
            thread.join()
            server.server_close()


def test_a_saved_scene_is_the_plan(live, served, run, tmp_path):
    server, address = served
    matrix = [[1, 0, 0, 0], [0, 1, 0, -1.5], [0, 0, 1, 0], [0, 0, 0, 1]]
    code, text = status(address, "/scene_file", {"X-Token": server.token},
                        json.dumps({"moves": {"chin": matrix}}).encode())
    scene = tmp_path / "plan.yaml"
    scene.write_bytes(text)
    assert code == 200 and scene.read_text().count("moves:") == 1
    assert run("repose-solve", scene, "-dry_run").returncode == 0


def test_a_report_of_the_plan_is_written_where_it_is_wanted(served, tmp_path):
    server, address = served
    own, server.output = server.output, tmp_path / "plan"
    assert own == server.scene.with_name("head_live_plan"), "beside the scene"
    try:
        code, path = status(address, "/report", {"X-Token": server.token},
                            json.dumps({"plan": {"chin": {"translate": [0, -2, 0]}}}).encode())
    finally:
        server.output = own
    assert code == 200 and path.decode().splitlines()[0] == str(tmp_path / "plan.html"), path
    text = (tmp_path / "plan.html").read_text()
    assert "chin" in text and "<svg" in text and (tmp_path / "plan.h5").is_file()


def browsed(live, served, script, size):
    """Returns what a script finds in the page."""
    server, address = served
    script = f"<script>{HELPERS}{script}{TOLD}</script></body>"
    server.page = live.page(server.scene).replace(b"</body>", script.encode())
    message = browse(address, "--virtual-time-budget=60000", "--dump-dom", size=size, seconds=110)
    found = json.loads(FOUND.search(message)[1].replace("&amp;", "&"))
    assert "error" not in found, found
    return found


def test_a_report_is_of_its_own_plan(live, served, tmp_path, monkeypatch):
    server, address = served
    file = tmp_path / "plan.h5"
    monkeypatch.setattr(server, "output", tmp_path / "plan")
    monkeypatch.setattr(server.session, "write", lambda *_: file.write_bytes(b""))

    def write_meanwhile(*_, **__):
        os.utime(file, ns=(1, 1))
        return types.SimpleNamespace(returncode=0)
    monkeypatch.setattr(live, "start", write_meanwhile)
    code, message = status(address, "/report", {"X-Token": server.token}, b'{"plan": {}}')
    assert code == 409 and f"{file} has been written by another program since" in message.decode()


def test_a_result_is_called_without_its_ending_or_with_it(live, served):
    server, _ = served
    for name in "plan", "plan.h5":
        own, _ = live.make_server(server.session, server.scene, output=server.scene.with_name(name))
        with own:
            assert own.output == server.scene.with_name("plan")


def test_windows_that_overtake_each_other_wait_longer_and_longer(live, served):
    pauses = browsed(live, served, OVERTAKEN, "1200,900")["pauses"]
    assert len(pauses) >= 4 and all(1000 * 2**k <= pause <= 2000 * 2**k for k, pause in enumerate(pauses[:4])), pauses


def test_the_page_takes_the_rest_position_of_less_energy_once(live, served):
    assert browsed(live, served, LOWER, "1200,900")["starts"] == [["rest", True]]


def test_an_exact_face_has_the_warnings_of_its_summary(live, served):
    found = browsed(live, served, WARNED, "1200,900")
    assert found["mark"].endswith(f", warnings: {len(found['told'])}")
    assert any("'mandible' and 'chin' end" in line and line.endswith(".") for line in found["told"]), found
    assert found["soon"] == ""


def test_a_face_of_the_former_plan_is_marked_as_such(live, served):
    found = browsed(live, served, FORMER, (1200, 900))
    first, typed, undone, preview = (found[name] for name in ("first", "typed", "undone", "preview"))
    assert first["kind"] == "exact" and "foremost" in first["measured"] and first["unit"] == "movement, mm"
    for former in (typed, found["missing"]):
        assert former["kind"] == "former" and "former plan" in former["mark"] and former["measured"] == ""
        assert former["which"] == "former plan" and former["unit"] == "former plan, mm"
        assert former["under"].startswith("former plan: ") and former["off"] == [True, True]
        assert former["angles"] == "hidden"
    assert found["stays"]
    for own in (undone, preview):
        assert own["kind"] == "preview" and own["which"] == "now" and own["off"] == [False, False]
    assert found["kept"] == [True, False, True], "a preview that is kept becomes exact"
    assert undone["measured"] == first["measured"] and found["then"]["kind"] == "exact"


@pytest.mark.long
def test_plan_a_and_the_handle_are_shown_where_they_belong(live, served):
    found = browsed(live, served, VIEWS, (1200, 900))
    assert found["early"] == [True, ["after", 1, 1]], "no plan A before the first answer"
    high, farthest = found["scale"]
    assert farthest > 3 and high >= farthest, "the scale reaches to plan A"
    assert found["side"] == [False, True] and found["split"] == [True, True] and found["after"] == [True]
    assert found["grabbed"] == [False, True]


def test_a_bone_is_dragged_and_the_face_follows(live, served):
    found = browsed(live, served, SCRIPT, (390, 844))
    assert found["pieces"] == ["mandible", "maxilla", "chin"] and 3 < found["first"] < 8
    assert found["during"] == "preview" and found["undone"]
    assert 0.5 < abs(found["dragged"]) < 2 and 0 < found["off"] < 0.5
    assert found["typed"] == pytest.approx([0, -1.6, -1.2]) and found["numbers"] == [2, 0, 0, 0, 0, 0]
    angles = [float(one) for one in re.findall(r"(?:angle by the tip|angle) ([\d.]+)° \(before", found["angles"])]
    assert len(angles) == 2 and all(80 < one < 180 for one in angles), found["angles"]
    assert found["colors"] > 1000 and found["wide"] <= 0 and found["loaded"] == []
