"""repose-live and the package repose, as a client sees them."""

import json
import os
import re
import socket
import subprocess
import sys
import threading
import time

import h5py
import numpy as np
import pytest
from conftest import PROJECT, programs, shipped

sys.path.insert(0, str(PROJECT / "drivers/python"))
import repose  # noqa: E402
from repose.programs import find_program, mpi_environment  # noqa: E402

SCENE = PROJECT / "meshes/head_live.yaml"
A = {"mandible": {"translate": [0, -5, 1], "rotate": [2, 0, 0]}, "maxilla": {"translate": [0, -2, 0]}}
ROUNDING = 1e-6  # mm, between processes and between sessions
B = {"mandible": {"translate": [1, -3, 0]}, "chin": {"translate": [0, -6, 0]}}


@pytest.fixture(scope="module")
def session(environment):
    os.environ.update(environment)
    with repose.Session(SCENE, program=programs() / "repose-live") as opened:
        yield opened


@pytest.fixture(scope="module")
def coarse_scene(tmp_path_factory):
    """The scene with longer edges and fewer layers."""
    file = tmp_path_factory.mktemp("coarse") / "coarse.yaml"
    file.write_text(shipped(SCENE.name, layers=3, edge=8))
    return file


@pytest.fixture(scope="module")
def coarse(coarse_scene, session):
    with repose.Session(coarse_scene, program=programs() / "repose-live") as opened:
        yield opened


def distance(one, other):
    return np.linalg.norm(one.position - other.position, axis=1).max()


def test_the_program_of_the_named_build_is_taken(monkeypatch, tmp_path):
    monkeypatch.delenv("REPOSE_LIVE", raising=False)
    monkeypatch.setenv("REPOSE_BUILD", str(tmp_path))
    with pytest.raises(FileNotFoundError, match="REPOSE_BUILD"):
        find_program()
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/repose-live").symlink_to(programs() / "repose-live")
    assert find_program() == str(tmp_path / "bin/repose-live")


def test_mpirun_starts_more_ranks_than_cores():
    own = {"PATH": os.environ["PATH"], "HOME": os.path.expanduser("~"), "OMP_NUM_THREADS": "3"}
    found = mpi_environment(own)
    assert found["OMP_NUM_THREADS"] == "3" and "PRTE_MCA_rmaps_default_mapping_policy" in found
    subprocess.run(["mpirun", "-n", str(os.cpu_count() + 1), "true"], env=found, check=True, timeout=60)


@pytest.mark.long
def test_answers_do_not_depend_on_their_order(session):
    first = session.solve(A)
    other = session.solve(B)
    assert first.converged and other.converged and first.error < 0.1
    assert distance(first, other) > 1
    assert distance(first, session.solve(A)) == 0
    session.solve(A, base=B, tangents=True)
    assert distance(first, session.solve(A, base="rest")) < 0.2, "from another start, both to 0.1"
    assert distance(first, session.solve(A)) == 0, "from a base that is not the latest"
    with repose.Session(SCENE, program=programs() / "repose-live") as fresh:
        assert distance(other, fresh.solve(B, base=A, accuracy=0.01)) < 0.2
        assert distance(first, fresh.solve(A)) < ROUNDING


def test_another_rest_position_is_looked_for_on_request(session):
    """Tissue of the chin rests on either side of the edge of its cut, by 0.13 mm of the skin."""
    plan = {"maxilla": {"translate": [0, -3, 0]}, "mandible": {"translate": [0, -4, 0]},
            "chin": {"translate": [0, -6, 0]}}
    plain = session.solve(plan, accuracy=np.float32(0.01), base="rest")
    face = session.solve(plan, accuracy=0.01, other_rest=True)
    assert plain.other_rest is None and "other_rest" not in plain.info
    assert face.converged and face.info["evaluations"] > plain.info["evaluations"]
    assert 0.05 < face.other_rest["distance"] < 0.5 and len(face.other_rest["place"]) == 3
    with pytest.raises(repose.Refused, match="not from a plan; leave base out"):
        session.ask({"do": "solve", "plan": plan, "base": plan, "other_rest": True})
    with pytest.raises(repose.Refused, match="other_rest must be true or false, not '1'"):
        session.ask({"do": "solve", "plan": plan, "other_rest": 1})


@pytest.mark.quick
def test_tangents_predict_a_face_nearby(coarse):
    face = coarse.solve(A, accuracy=0.01, tangents=True)
    assert not face.tangent.missing and len(face.tangent.columns) == 18
    change = {"mandible": {"translate": [0, -0.5, 0], "rotate": [0, 0, 0.5]}}
    near = {**A, "mandible": {"translate": [0, -5.5, 1], "rotate": [2, 0, 0.5]}}
    exact = coarse.solve(near, accuracy=0.01)
    error = np.linalg.norm(face.position + face.tangent.displacement(change) - exact.position, axis=1)
    assert distance(face, exact) > 0.4 and np.percentile(error, 95) < 0.05


def test_the_gradient_of_a_point_is_the_transpose_of_the_tangents(coarse):
    coarse.change(material={"preset": "face", "skin": {"thickness": 1.5, "young": 0.08}})
    weights = {552: [0.3, -1, 0.2], 386: [0, 0.5, 0]}  # chin, lip
    face = coarse.solve(A, accuracy=0.001, tangents=True, gradient_of=weights)
    alone = coarse.solve(A, accuracy=0.001, gradient_of=weights)
    along = lambda column: sum(np.dot(column[row], weight) for row, weight in weights.items())
    assert alone.tangent is None and alone.gradient.complete and alone.gradient.pieces.keys() == {
        "maxilla", "mandible", "chin"}
    for name, motion in alone.gradient.pieces.items():
        forward = [along(face.tangent.columns[name, c]) for c in repose.session.COMPONENTS]
        assert np.allclose(motion["translate"] + motion["rotate"], forward, atol=2e-3), name
    assert np.abs(alone.gradient.pieces["mandible"]["translate"]).max() > 0.1
    assert len(face.tangent.young) == 2
    assert np.allclose(alone.gradient.young, [along(column) for column in face.tangent.young], atol=1e-3)
    factor = 1.05
    coarse.change(material={"preset": "face", "skin": {"thickness": 1.5, "young": 0.08 * factor}})
    stiffer = coarse.solve(A, accuracy=0.001)
    difference = (stiffer.position - face.position) / np.log(factor)
    largest = np.linalg.norm(difference, axis=1).max()
    assert largest > 0.1
    off = np.linalg.norm(difference - face.tangent.young[0], axis=1)
    assert np.percentile(off, 95) < 0.1 * largest, "a step of 5 %, faces to 0.001 mm"
    count = len(face.position)
    with pytest.raises(repose.Refused, match=f"point 2000 is none of the answer's {count} points"):
        coarse.solve(A, gradient_of={2000: [0, 0, 1]})
    coarse.change()


@pytest.mark.quick
def test_refusals_name_the_place_and_the_session_goes_on(coarse):
    for plan, words in ((({"mandible": {"translate": [0, -9, 0]}}), "'mandible': translation -9 mm"),
                        (({"jaw": {}}), "'jaw' is no piece"),
                        (({"chin": {"turn": [0, 0, 1]}}), "'chin': turn: a motion has translate and rotate"),
                        (None, "a plan is {PIECE: {'translate': [x, y, z], 'rotate': [x, y, z]}}, not None"),
                        ([], "a plan is "), ("chin", "a plan is "), ({"chin": None}, "'chin': a motion is "),
                        ({"chin": [0, 0, 1]}, "'chin': a motion is "),
                        ({"chin": {"translate": [True, 0, 0]}}, "three finite numbers, not [True, 0, 0]"),
                        ({"chin": {"translate": "123"}}, "translate must be three finite numbers, not 123")):
        with pytest.raises(repose.Refused, match=re.escape(words)):
            coarse.solve(plan)
    for accuracy in (float("nan"), True, "fine", 100, 1e-9):
        with pytest.raises(repose.Refused, match="accuracy must be a number"):
            coarse.solve(A, accuracy)
    for request in ({"do": "dance"}, {"do": "solve", "plan": 3}, {"do": "solve", "accuracy": -1},
                    {"do": "solve", "plan": {"chin": {"translate": [0, 1]}}}, {"do": "write"},
                    {"do": "solve", "tangents": "yes"}, {"do": "solve", "gradient_of": []},
                    {"do": "solve", "gradient_of": [{"point": -1, "weight": [0, 0, 1]}]},
                    {"do": "solve", "gradient_of": [{"point": 2**64 - 1, "weight": [0, 0, 1]}]},
                    {"do": "solve", "gradient_of": [{"point": 1, "weight": [0, 1e160, 0]}]},
                    {"do": "solve", "gradient_of": [{"point": 1, "weight": [0, 0, -1e-300]}]},
                    {"do": "solve", "gradient_of": [{"point": 1}]}):
        with pytest.raises(repose.Refused) as refusal:
            coarse.ask(request)
        assert "\n" not in str(refusal.value)
    assert coarse.ask({"do": "describe", "id": 99})[0]["id"] != 99, "numbers are the session's own"
    assert coarse.solve(B).converged


def test_a_request_that_is_no_line_of_json_is_refused(session):
    """None of them waits for an answer without end."""
    for value in (float("nan"), float("inf")):
        with pytest.raises(repose.Refused, match="finite numbers, not"):
            session.solve({"mandible": {"translate": [0, value, 0]}})
        with pytest.raises(repose.Refused, match="finite numbers only"):
            session.solve(A, gradient_of={0: [value, 0, 0]})
    with pytest.raises(repose.Refused, match="a line of at most 1048576 bytes"):
        session.solve(A, gradient_of={row: [0.125, -1, 0] for row in range(30_000)})
    with pytest.raises(repose.Refused, match="nests at most 8 arrays and objects"):
        session.change(material=[[[[[[[[[1]]]]]]]]])
    assert session.solve(A).converged


def test_a_session_has_a_whole_number_of_ranks():
    for ranks in (0, -1, "two", 1.5):
        with pytest.raises(ValueError, match="ranks must be a whole number from 1, not "):
            repose.Session(SCENE, ranks=ranks)
    with pytest.raises(ValueError, match="verify_every must be a whole number from 0, not -1"):
        repose.Session(SCENE, verify_every=-1)


def test_derivatives_refuse_what_the_plan_does_not_have(coarse):
    face = coarse.solve(A, accuracy=1, tangents=True)
    tangent = face.tangent
    with pytest.raises(ValueError, match="'jaw' is no piece of the plan; its pieces are chin, mandible, maxilla"):
        tangent.displacement({"jaw": {"translate": [0, 1, 0]}})
    with pytest.raises(ValueError, match="'chin': turn: a motion has translate and rotate"):
        tangent.displacement({"chin": {"turn": [0, 1, 0]}})
    for wrong in ([0, 1], [0, 1, 0, 5], 3, ["a", 0, 0], [0, float("nan"), 0], [[0], 1, 2]):
        with pytest.raises(ValueError, match="'chin': translate must be three finite numbers, not "):
            tangent.displacement({"chin": {"translate": wrong, "rotate": [5, 0, 0]}})
    assert np.array_equal(tangent.displacement({}), np.zeros_like(face.position))


def test_a_change_of_material_or_border_is_the_scene_with_these_values(coarse, coarse_scene, tmp_path):
    before = coarse.solve(A)
    text = coarse_scene.read_text().replace("material: {preset: face}", "material: {preset: face, young: 0.03}")
    text = text.replace("release: 5", "release: 7")
    (tmp_path / "changed.yaml").write_text(text + "boundary: {rim: fixed}\n")
    coarse.change(material={"preset": "face", "young": 0.03}, release=7, boundary={"rim": "fixed"})
    changed = coarse.solve(A)
    with repose.Session(tmp_path / "changed.yaml", program=programs() / "repose-live") as other:
        assert distance(changed, other.solve(A)) < ROUNDING
    assert distance(changed, before) > 0.1
    for values, words in (({"material": {"young": -1}}, "coarse.yaml: tissue.material.young"),
                          ({"material": {"yuong": 1}}, "the nearest known one is 'young'"),
                          ({"moves": []}, "no member 'moves'"), ({"material": 3}, "tissue.material"),
                          ({"boundary": {"rim": None}}, "boundary has no value for 'rim'")):
        with pytest.raises(repose.Refused, match=re.escape(words)) as refusal:
            coarse.change(**values)
        assert "\n" not in str(refusal.value)
    assert distance(coarse.solve(A), changed) == 0, "a refused change leaves the scene as it was"
    coarse.change()
    assert distance(coarse.solve(A), before) < ROUNDING, "another session with the same values"


def test_a_later_solve_ends_the_one_under_way(session):
    outcome = []

    def slow():
        try:
            outcome.append(session.solve(A, accuracy=1e-6, base="rest"))
        except repose.Refused as refusal:
            outcome.append(str(refusal))
    thread = threading.Thread(target=slow)
    thread.start()
    time.sleep(0.2)
    assert session.solve(B).converged
    thread.join()
    assert "a later request overtook it" in str(outcome[0])


def test_a_full_result_passes_the_check(session, run, tmp_path):
    face = session.solve(B)
    session.write(tmp_path / "plan")
    result = run("repose-check", tmp_path / "plan.h5")
    assert result.returncode == 0, result
    mesh = face.mesh()
    assert mesh.points.shape == session.initial.shape


def test_a_full_result_holds_a_summary_of_its_own_plan(session, tmp_path):
    face = session.solve({"chin": {"translate": [0, 0, 6]}}, summary=True)
    written = session.write(tmp_path / "deep")
    assert written.startswith(face.summary), "answered as written"
    rows = written.splitlines()
    told = [row.split(maxsplit=1) for row in rows]
    assert any(row[0] == "warning" and "'mandible' and 'chin' end" in row[1] for row in told), rows
    assert any(row[0] == "contact" for row in told), rows
    with h5py.File(tmp_path / "deep.h5") as h5:
        assert [row.decode() for row in h5["summary"][()]] == rows
    session.solve(B)
    assert "inside one another" not in session.write(tmp_path / "plan")


def test_the_result_of_a_plan_has_its_own_bones_after_one_that_was_abandoned(session, tmp_path):
    session.solve(B)
    session.write(tmp_path / "before")

    def slow():
        with pytest.raises(repose.Refused, match="overtook"):
            session.solve(A, accuracy=1e-6, base="rest")
    thread = threading.Thread(target=slow)
    thread.start()
    time.sleep(0.2)
    with pytest.raises(repose.Refused, match="-50"):
        session.solve({"chin": {"translate": [0, -50, 0]}})
    thread.join()
    session.write(tmp_path / "after")
    with h5py.File(tmp_path / "before.h5") as before, h5py.File(tmp_path / "after.h5") as after:
        for name in ("bone_transform", "point/target"):
            assert np.array_equal(before["model"][name], after["model"][name]), name


def test_a_plan_is_written_whatever_was_solved_last(session, tmp_path):
    session.solve(B)
    session.write(tmp_path / "before")
    session.solve(A)
    session.write(tmp_path / "after", B)
    with h5py.File(tmp_path / "before.h5") as before, h5py.File(tmp_path / "after.h5") as after:
        assert np.array_equal(before["model/bone_transform"], after["model/bone_transform"])
        one, other = (list(h5["step"].values())[-1]["point/position"][:] for h5 in (before, after))
    assert np.abs(one - other).max() == 0


def test_a_full_result_holds_the_given_skin(tmp_path):
    (tmp_path / "plan.yaml").write_text(shipped(SCENE.name, layers=2, edge=8))
    with repose.Session(tmp_path / "plan.yaml", program=programs() / "repose-live") as coarse:
        coarse.solve(B, accuracy=1)
        coarse.write(tmp_path / "plan")
    with h5py.File(tmp_path / "plan.h5") as h5:
        assert np.linalg.norm(h5["given_skin/displacement"][:], axis=1).max() > 3
    assert (tmp_path / "plan_given_skin.vtp").is_file()


def test_faces_are_meshes_of_pyvista(session):
    pytest.importorskip("pyvista")
    face = session.solve(B)
    mesh = face.polydata()
    assert mesh.n_points == len(face.position) and mesh.n_cells == len(face.triangles)
    assert np.allclose(mesh.point_data["displacement"], face.displacement)


def talk(environment, lines, scene=SCENE):
    """Returns the answers of repose-live to these lines, and its status."""
    command = [str(programs() / "repose-live"), str(scene)]
    done = subprocess.run(command, input=lines, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          timeout=60, env={**os.environ, **environment})
    return done.returncode, done.stdout


def test_malformed_lines_and_the_end_of_the_input(environment):
    status, message = talk(environment, b'{"do": \n\n[1]\n\xff\xfe\n{"id": "x", "do": "quit"}\n')
    answers = [json.loads(line) for line in message.splitlines()]
    assert status == 0 and [answer["ok"] for answer in answers] == [False, False, False, True]
    assert answers[-1]["id"] == "x"
    assert talk(environment, b"") == (0, b"")


def test_a_solve_is_answered_after_the_end_of_the_input(environment, coarse_scene):
    solve = b'{"id": 1, "do": "solve", "plan": {"chin": {"translate": [0, -2, 0]}}}\n'
    status, message = talk(environment, solve, coarse_scene)
    head = json.loads(message.partition(b"\n")[0])
    assert status == 0 and head["ok"] and head["converged"], head.get("error")
    status, message = talk(environment, solve + b'{"id": 2, "do": "quit"}\n', coarse_scene)
    first, second = (json.loads(line) for line in message.splitlines())
    assert not first["ok"] and "a later request overtook it" in first["error"] and second["ok"]


def test_a_closed_pipe_ends_the_program(environment):
    process = subprocess.Popen([programs() / "repose-live", SCENE], stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               env={**os.environ, **environment})
    process.stdout.close()
    process.stdin.write(b'{"do": "describe"}\n')
    process.stdin.flush()
    assert process.wait(timeout=60) == 0
    process.stdin.close()
    process.stderr.close()


def test_a_socket_answers_clients_with_its_token_alone(environment):
    process = subprocess.Popen([programs() / "repose-live", SCENE, "-port", "0"],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               env={**os.environ, **environment})
    address = json.loads(process.stdout.readline())

    def client(token, request):
        with socket.create_connection(("127.0.0.1", address["port"]), timeout=60) as connection:
            connection.sendall(json.dumps({"token": token}).encode() + b"\n" + request + b"\n")
            return json.loads(connection.makefile("rb").readline())
    assert "the first line must be" in client("guess", b'{"do": "quit"}')["error"]
    assert client(address["token"], b'{"do": "describe"}')["pieces"]
    assert client(address["token"], b'{"do": "quit"}')["ok"]
    assert process.wait(timeout=60) == 0
    process.stdout.close()
    process.stderr.close()


def test_what_libraries_print_is_no_answer(session, tmp_path):
    noisy = tmp_path / "noisy"
    noisy.write_text(f'#!/bin/sh\necho "UCX ERROR failed"\nexec {programs() / "repose-live"} "$@"\n')
    noisy.chmod(0o755)
    with repose.Session(SCENE, program=noisy) as other:
        assert [piece.name for piece in other.pieces] == [piece.name for piece in session.pieces]


def test_two_ranks_give_the_same_face(coarse, coarse_scene):
    with repose.Session(coarse_scene, ranks=2, program=programs() / "repose-live") as shared:
        assert distance(shared.solve(A), coarse.solve(A)) < 0.1
        mine, other = (one.solve(A, accuracy=0.001, tangents=True, gradient_of={552: [0, 1, 0]})
                       for one in (shared, coarse))
        assert len(mine.tangent.columns) == 18
        assert np.allclose(mine.gradient.pieces["mandible"]["translate"],
                           other.gradient.pieces["mandible"]["translate"], atol=1e-3)
        assert np.abs(mine.tangent.young[0] - other.tangent.young[0]).max() < 1e-3


def test_the_skin_that_a_scene_names_follows_the_one_that_is_solved(environment, tmp_path):
    scene = tmp_path / "remeshed.yaml"
    scene.write_text(shipped(SCENE.name, layers=3, edge=8))
    with repose.Session(scene, program=programs() / "repose-live") as remeshed:
        face = remeshed.solve(remeshed.scene_plan)
        given = np.linalg.norm(face.given_position - remeshed.given.position, axis=1)
    assert len(given) == 2000 and len(face.position) < 1500
    assert abs(given.max() - np.linalg.norm(face.displacement, axis=1).max()) < 0.3
    assert given.min() == 0, "far from what is solved, or over bone that stays"


def test_a_scene_without_a_plan_is_refused(environment):
    with pytest.raises(repose.Refused, match="the scene has no plan"):
        repose.Session(PROJECT / "meshes/head_genioplasty.yaml", program=programs() / "repose-live")


def test_the_client_of_the_guide_works(environment, coarse_scene):
    page = (PROJECT / "docs/guide/live.md").read_text()
    client = re.findall(r"```python\n(import json.*?)```", page, re.S)[0]
    message = subprocess.run([sys.executable, "-c", client, coarse_scene], text=True, check=True, timeout=60,
                          stdout=subprocess.PIPE,
                          env={**os.environ, **environment,
                               "PATH": f"{programs()}:{os.environ['PATH']}"}).stdout
    assert re.search(r"mandible 2 mm forward: the skin moves by up to [12]\.\d+ mm", message)
