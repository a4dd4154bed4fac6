"""Failures of a resident solver: nothing is lost, and one line says what happened."""

import json
import os
import pathlib
import random
import re
import resource
import shutil
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import PROJECT, programs
from test_outputs import write_transform

sys.path.insert(0, str(PROJECT / "drivers/python"))
import repose  # noqa: E402
from repose.verify import Verifier  # noqa: E402

PLAN = {"mandible": {"translate": [0, -3, 0]}}


@pytest.fixture(scope="module")
def small(tmp_path_factory, environment):
    """A scene that is built in a moment: the shipped head on two layers, with its files."""
    folder, temporary = tmp_path_factory.mktemp("small"), str(tmp_path_factory.mktemp("temporary"))
    os.environ.update(environment, REPOSE_STARTED_BY=str(os.getpid()), TMPDIR=temporary,
                      OMPI_MCA_btl_vader_backing_directory=temporary, OMPI_MCA_btl_sm_backing_directory=temporary)
    for mesh in ("skin", "skull", "mandible"):
        shutil.copy(PROJECT / f"meshes/head_{mesh}.ply", folder)
    scene = folder / "small.yaml"
    text = re.sub("osteotomies:.*", "", (PROJECT / "meshes/head_live.yaml").read_text(), flags=re.S)
    scene.write_text(text.replace("layers: 4", "layers: 2") +
                     "plan:\n  pieces: [mandible]\n  box: {translate: [5, 5, 5], rotate: [5, 5, 5]}\n")
    return scene


def opened(scene, **settings):
    return repose.Session(scene, program=programs() / "repose-live", **settings)


def children():
    """Ids of the solvers that this test has started, also of those that outlived the process that started them."""
    mark, found = f"REPOSE_STARTED_BY={os.getpid()}\0".encode(), set()
    for entry in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if (entry / "comm").read_text().startswith("repose-live") and mark in (entry / "environ").read_bytes():
                found.add(int(entry.name))
        except OSError:
            pass  # it has ended
    return found


# ----- verification from a cold start


def test_every_nth_answer_is_solved_again_from_a_cold_start(small):
    report = []
    with opened(small, verify_every=2, on_verified=report.append) as session:
        session.solve({})
        assert not report
        session.solve(PLAN, accuracy=0.01)
        session.wait_for_verification()
        (one,) = session.verifications
    assert report == [one] and one.plan == PLAN
    assert one.agrees and one.distance < 0.03
    assert re.match(r"verified from a cold start: the same face within 0\.0\d\d mm$", one.message)
    assert not children()


class Cold:
    """A solver whose face is given."""

    def __init__(self, position, converged=True, other=None):
        self.face = repose.Face({}, position, position, None, 0.001, converged, {}, None,
                                {"reason": "the limit of iterations", "other_rest": other, "energy": 2.5})
        self.closed = False

    def solve(self, plan, accuracy, other_rest):
        assert other_rest
        return self.face

    def close(self):
        self.closed = True


OTHER = {"distance": 0.61, "place": [7.2, 8, 9]}


@pytest.mark.quick
@pytest.mark.parametrize("shift, converged, words", [
    (0.0, True, "the same face within 0.000 mm; at [7, 8, 9] mm tissue has another rest position, 0.61 mm "
                "away"),
    (0.9, True, "NOT verified: a search from a cold start ends 0.90 mm away, at [7, 8, 9] mm, with an energy of "
                "2.5 in place of 3 N mm"),
    (0.0, False, "not verified: the search from a cold start ended with the limit of iterations")])
def test_a_face_that_differs_is_reported(shift, converged, words):
    position, cold = np.array([[1.0, 2, 3], [7, 8, 9]]), []
    other = position + [[0, 0, 0], [0, shift, 0]]

    def start():
        cold.append(Cold(other, converged, OTHER))
        return cold[-1]
    verifier = Verifier(start, 1)
    verifier.add(PLAN, position, 3.0, 0.1)
    verifier.wait()
    (one,) = verifier.outcomes
    assert words in one.message and one.agrees == (not shift and converged) and cold[0].closed
    assert one.lower == bool(shift)


def test_a_verification_under_way_is_abandoned_at_the_end(small):
    session = opened(small, verify_every=1)
    session.solve(PLAN, accuracy=1e-5)
    session.close()
    assert not children() and len(session.verifications) <= 1


# ----- the scene on disk


def test_a_scene_that_changes_on_disk_is_noticed(small, tmp_path):
    for file in small.parent.glob("*.*"):
        shutil.copy(file, tmp_path)
    scene = tmp_path / small.name
    with opened(scene) as session:
        assert not session.scene_changed
        os.utime(scene)
        assert not session.scene_changed, "the content is the same"
        before = session.solve(PLAN)
        mesh = tmp_path / "head_skin.ply"
        content = mesh.read_bytes()
        mesh.write_bytes(content[:-7])
        assert session.scene_changed
        assert np.array_equal(session.solve(PLAN).position, before.position), "it solves what it was given"
        mesh.write_bytes(content)
        assert not session.scene_changed
        mesh.unlink()
        assert session.scene_changed


# ----- processes


def test_a_solver_that_is_killed_is_one_line_and_the_next_works(small):
    session = opened(small)
    said = []

    def solve():
        try:
            session.solve(PLAN, accuracy=1e-6, base="rest")
        except repose.Refused as refusal:
            said.append(str(refusal))
    thread = threading.Thread(target=solve)
    thread.start()
    time.sleep(0.05)
    session._process.kill()
    thread.join(timeout=30)
    assert len(said) == 1 and "repose-live has ended" in said[0] and "\n" not in said[0]
    with pytest.raises(repose.Refused, match="repose-live has ended"):
        session.solve(PLAN)
    session.close()
    with opened(small) as again:
        assert again.solve(PLAN).converged


@pytest.mark.parametrize("answer", [', "arrays": [{"name": "position", "type": "f4", "shape": [2, 3]}]', ""])
def test_a_solver_that_ends_within_an_answer_is_one_line(small, tmp_path, answer):
    program, said = tmp_path / "killed", []
    program.write_text("#!/bin/sh\nread request\nprintf '%s\\n' '{\"id\": 1, \"ok\": true" + answer +
                       "}'\nprintf 12345678\n")
    program.chmod(0o755)

    def start():
        with pytest.raises(repose.Refused) as refusal:
            repose.Session(small, program=program)
        said.append(str(refusal.value))
    thread = threading.Thread(target=start, daemon=True)
    thread.start()
    thread.join(timeout=20)
    assert len(said) == 1 and said[0].startswith("repose-live has ended (status 0)"), "it waits without end"


@pytest.mark.quick
def test_the_last_error_of_a_solver_is_reported(small, tmp_path):
    program = tmp_path / "late"
    program.write_text("#!/bin/sh\nread request\nexec 1>&-\n(sleep 0.3; echo 'error: too late' >&2) &\nexit 1\n")
    program.chmod(0o755)
    with pytest.raises(repose.Refused, match="^too late$"):
        repose.Session(small, program=program)


def starts_and_stops(scene, count):
    """Starts and stops solvers; resident memory of this process (MB) and open files after each."""
    memory, files = [], []
    for _ in range(count):
        with opened(scene) as session:
            session.solve({})
        memory.append(int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path("/proc/self/status").read_text())[1]) / 1e3)
        files.append(len(os.listdir("/proc/self/fd")))
    return memory, files


def leftovers():
    """Names in this test's temporary folder, where Open MPI and PETSc leave files."""
    return set(os.listdir(os.environ["TMPDIR"]))


@pytest.mark.parametrize("count", [6, pytest.param(100, marks=pytest.mark.long)])
def test_starts_and_stops_leave_nothing(small, count):
    with opened(small):
        assert children()
        before = leftovers()  # what the first start of a machine makes, stays
    memory, files = starts_and_stops(small, count)
    assert not children()
    assert files[-1] <= files[1] and memory[-1] < memory[1] + 3, (files, memory)
    threads = [one for one in threading.enumerate() if one is not threading.main_thread()]
    assert len(threads) < 6
    assert leftovers() <= before


# ----- clients


@pytest.fixture
def listening(small, environment):
    """(port, token) of a solver that answers on a socket."""
    process = subprocess.Popen([programs() / "repose-live", small, "-port", "0"], stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, env={**os.environ, **environment})
    address = json.loads(process.stdout.readline())
    yield address["port"], address["token"]
    if process.poll() is None:
        process.terminate()
    process.wait(timeout=30)
    process.stdout.close()


def greeted(port, token):
    connection = socket.create_connection(("127.0.0.1", port), timeout=60)
    connection.sendall(json.dumps({"token": token}).encode() + b"\n")
    return connection, connection.makefile("rb")


def ask(connection, stream, request):
    connection.sendall(json.dumps(request).encode() + b"\n")
    head = json.loads(stream.readline())
    for one in head["arrays"]:
        stream.read(4 * int(np.prod(one["shape"])))
    return head


def test_two_clients_are_served_one_after_the_other(listening):
    port, token = listening
    first, first_stream = greeted(port, token)
    assert ask(first, first_stream, {"do": "solve", "plan": PLAN, "id": 1})["converged"]
    second, second_stream = greeted(port, token)  # waits
    second.settimeout(0.5)
    second.sendall(b'{"do": "solve", "id": 2}\n')
    with pytest.raises(TimeoutError):
        second.recv(1)
    assert ask(first, first_stream, {"do": "solve", "id": 3})["id"] == 3, "the first one is still served"
    first_stream.close()
    first.close()
    second.settimeout(60)
    assert json.loads(second.makefile("rb").readline())["id"] == 2
    second_stream.close()
    second.close()


def test_a_client_that_vanishes_leaves_the_solver_to_others(listening):
    port, token = listening
    gone, stream = greeted(port, token)
    gone.sendall(b'{"do": "solve", "accuracy": 1e-6, "base": "rest"}\n{"do": "so')
    stream.close()
    gone.close()
    stranger = socket.create_connection(("127.0.0.1", port), timeout=60)
    stranger.sendall(b"GET / HTTP/1.1\n")
    assert "the first line must be" in json.loads(stranger.makefile("rb").readline())["error"]
    stranger.close()
    third, stream = greeted(port, token)
    assert ask(third, stream, {"do": "solve", "plan": PLAN})["converged"]
    stream.close()
    third.close()


def test_a_client_that_sends_its_first_line_slowly_is_refused(listening):
    port, token = listening
    slow = socket.create_connection(("127.0.0.1", port), timeout=60)
    client, stream = greeted(port, token)
    client.sendall(b'{"do": "solve"}\n')
    client.settimeout(1)  # between two blanks of the slow one
    began = time.monotonic()
    while True:
        try:
            slow.sendall(b" ")
        except OSError:
            pass  # it has been closed
        try:
            assert client.recv(1)
            break
        except TimeoutError:
            assert time.monotonic() - began < 15, "a client without the token holds back the one behind it"
    stream.close()
    client.close()
    slow.close()


def test_the_search_of_a_client_that_vanishes_ends(listening, tmp_path):
    port, token = listening
    gone, stream = greeted(port, token)
    gone.sendall(json.dumps({"do": "solve", "plan": PLAN, "accuracy": 1e-6, "base": "rest"}).encode() + b"\n")
    stream.close()
    gone.close()
    after, stream = greeted(port, token)
    after_it = {"do": "write", "output": str(tmp_path / "face")}
    assert "there is no solved plan to write" in ask(after, stream, after_it).get("error", ""), "its search was finished"
    stream.close()
    after.close()


def test_a_client_that_sends_no_more_gets_its_answer(listening):
    port, token = listening
    client, stream = greeted(port, token)
    client.sendall(json.dumps({"do": "solve", "plan": PLAN, "base": "rest", "id": 7}).encode() + b"\n")
    client.shutdown(socket.SHUT_WR)
    head = json.loads(stream.readline())
    assert head["ok"] and head["converged"] and head["id"] == 7
    stream.close()
    client.close()


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_solver_that_can_accept_nobody_ends_in_one_line(small, environment, ranks):
    launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    process = subprocess.Popen([*launcher, programs() / "repose-live", small, "-port", "0"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True, env={**os.environ, **environment})
    try:
        port = json.loads(process.stdout.readline())["port"]
        for solver in children():
            resource.prlimit(solver, resource.RLIMIT_NOFILE, (3, 3))
        try:  # it may wait for a first client already, whose descriptor it has
            socket.create_connection(("127.0.0.1", port), timeout=60).close()
        except OSError:
            pass  # it has ended
        message = process.communicate(timeout=60)[1]
        assert process.returncode == 1
        assert f"-port {port}: no client can connect: Too many open files" in message
    finally:
        process.kill()
        process.communicate()


def damaged(random_numbers):
    """A request, damaged at random."""
    line = bytearray(json.dumps(random_numbers.choice([
        {"do": "solve", "plan": PLAN, "accuracy": 0.1, "tangents": False, "base": "rest"},
        {"do": "solve", "plan": {"mandible": {"rotate": [1, 2, 1e400]}}}, {"do": "describe"},
        {"do": "change", "material": {"preset": "fat"}}, {"do": "write", "output": "/nowhere/at/all"}, {"do": "solve", "points": 3, "base": PLAN}])).encode())
    for _ in range(random_numbers.randrange(4)):
        place = random_numbers.randrange(len(line))
        kind = random_numbers.randrange(3)
        if kind == 0:
            line[place] = random_numbers.randrange(256)
        elif kind == 1:
            del line[place:place + random_numbers.randrange(1, 6)]
        else:
            line[place:place] = random_numbers.choice([b'"', b"{", b"]", b"1e308", b"\x00", b"-", b"null"])
        if not line:
            break
    return bytes(line).replace(b"\n", b" ")


def answers(scene, lines, environment, folder):
    """Heads of the answers to these lines, from a program of their own."""
    done = subprocess.run([programs() / "repose-live", scene], input=b"\n".join(lines), stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, timeout=100, env={**os.environ, **environment}, cwd=folder)
    assert done.returncode == 0, done.stderr[-500:]
    heads, rest = [], done.stdout
    while rest:
        line, _, rest = rest.partition(b"\n")
        heads.append(json.loads(line))
        rest = rest[sum(4 * int(np.prod(one["shape"])) for one in heads[-1]["arrays"]):]
    return heads


def test_deep_long_and_odd_requests_are_refused_and_the_session_goes_on(small, environment, tmp_path):
    deep, solve = 300000, b'{"do": "solve", '
    expected = {
        b"[" * deep + b"]" * deep: "a request nests at most 8 arrays and objects; this one nests 300000",
        b'{"id": ' + b"[" * deep + b"]" * deep + b', "do": "quit"}': "this one nests 300001",
        b'{"do": "describe", "id": "' + b"a" * (1 << 21) + b'"}': "a line of at most 1048576 bytes",
        b'{"do": "dance"}': "do must be one of describe, solve, change, write, quit",
        b'{"do": "quit", "id": {}}': "id must be a text or a number, not '{}'",
        b'{"do": "quit", "now": 1}': "quit has no member 'now'; it has id, do",
        solve + b'"accuracy": true}': "accuracy must be a number, 1e-6",
        solve + b'"accuracy": 11}': "accuracy must be a number, 1e-6",
        solve + b'"tangents": 1}': "tangents must be true or false, not '1'",
        solve + b'"points": "bone"}': "points must be \"skin\" or \"all\"",
        solve + b'"base": "best"}': "base must be \"rest\", \"scene\" or a plan",
        solve + b'"base": {"jaw": {}}}': "'jaw' is no piece of the plan",
        solve + b'"plan": {"mandible": [1]}}': "a piece's motion must be an object, not '[1]'",
        solve + b'"plan": {"mandible": {"rotate": [1, 2, "3"]}}}': "rotate must be three numbers",
        b'{"do": "write"}': "write needs the member output",
        b'{"do": "write", "output": ""}': "is no name of files",
        b'{"do": "write", "output": "folder/"}': "is no name of files",
        b'{"do": "write", "output": "a\\u0000b"}': "is no name of files"}
    heads = answers(small, [*expected, solve + b'"id": "after"}'], environment, tmp_path)
    assert len(heads) == len(expected) + 1, "also the last line, which has no end"
    for head, (line, words) in zip(heads, expected.items()):
        assert not head["ok"] and words in head["error"] and "\n" not in head["error"], (line[:80], head)
    assert heads[-1]["ok"] and heads[-1]["id"] == "after" and heads[-1]["converged"]
    assert not list(tmp_path.iterdir())


def test_a_result_does_not_replace_a_file_of_its_scene(small, environment, tmp_path):
    for file in small.parent.glob("*.*"):
        shutil.copy(file, tmp_path)
    (tmp_path / small.name).write_text(small.read_text() + "moves: [{bone: mandible, transform: move.h5}]\n")
    write_transform(tmp_path / "move.h5")
    before = (tmp_path / "move.h5").read_bytes()
    heads = answers(small.name, [b'{"do": "solve"}', b'{"do": "write", "output": "move"}',
                                 b'{"do": "write", "output": "plan"}'], environment, tmp_path)
    assert [head["ok"] for head in heads] == [True, False, True]
    assert "move.h5: is an input of this run and would be replaced" in heads[1]["error"]
    assert (tmp_path / "move.h5").read_bytes() == before and (tmp_path / "plan.h5").is_file()


def test_fuzzed_messages_are_answered_or_refused_in_a_line(small, environment, tmp_path):
    random_numbers = random.Random(11)
    lines = [damaged(random_numbers) for _ in range(300)]
    expected = [line for line in lines if line.strip(b" \t\r")]
    heads = answers(small, [*lines, b'{"do": "quit", "id": "last"}'], environment, tmp_path)
    assert len(heads) == len(expected) + 1 and heads[-1]["id"] == "last"
    refusals = [head["error"] for head in heads if not head["ok"]]
    assert len(refusals) > 100 and all("\n" not in one and one for one in refusals)
