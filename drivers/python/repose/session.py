"""A resident solver: repose-live, started and asked."""

import dataclasses
import json
import numbers
import os
import pathlib
import subprocess
import threading
from collections.abc import Mapping

import numpy as np

from .programs import absolute_program, find_program, mpi_environment
from .scene import Scene, SceneWatch
from .verify import Verifier

COMPONENTS = ("tx", "ty", "tz", "rx", "ry", "rz")  # mm, then degrees


class Refused(ValueError):
    """Raised with the message of repose-live for a request that it does not answer."""


def is_number(value):
    """Returns whether a value is a finite number, and not true or false."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool) and bool(np.isfinite(value))


def vectors_of(piece, motion):
    """A piece's motion in a plan with both its vectors; Refused where it is none."""
    if not isinstance(motion, Mapping):
        raise Refused(f"{piece!r}: a motion is {{'translate': [x, y, z], 'rotate': [x, y, z]}}, not {motion!r}")
    if unknown := motion.keys() - {"translate", "rotate"}:
        raise Refused(f"{piece!r}: {', '.join(sorted(map(str, unknown)))}: a motion has translate and rotate")
    vectors = {key: motion.get(key, (0, 0, 0)) for key in ("translate", "rotate")}
    for key, vector in vectors.items():
        if not (isinstance(vector, (list, tuple, np.ndarray)) and len(vector) == 3 and
                all(map(is_number, vector))):
            raise Refused(f"{piece!r}: {key} must be three finite numbers, not {vector}")
    return vectors


@dataclasses.dataclass
class Piece:
    """A piece of the plan: its row among the bones, its centroid (mm), and the scene's own motion."""
    name: str
    bone: int
    centroid: np.ndarray
    translate: np.ndarray  # mm
    rotate: np.ndarray     # degrees


@dataclasses.dataclass
class Tangent:
    """∂x/∂p of the skin, [N, 3] for each component of each piece: mm per mm, mm per degree."""
    columns: dict          # (piece, "tx" … "rz") -> array
    missing: list          # those whose linear solve did not end or met negative curvature
    young: list            # [N, 3] mm by ln of Young's modulus of each stratum from the skin down, the
                           # last below all; empty where none is given

    def displacement(self, change):
        """First-order displacement of the skin by a change of the plan (as a plan)."""
        pieces = sorted({piece for piece, _ in self.columns})
        total = np.zeros(next(iter(self.columns.values())).shape)
        for piece, motion in change.items():
            if piece not in pieces:
                raise ValueError(f"{piece!r} is no piece of the plan; its pieces are {', '.join(pieces)}")
            for name, value in zip(COMPONENTS, np.ravel(list(vectors_of(piece, motion).values()))):
                if value and (piece, name) in self.columns:
                    total = total + value * self.columns[piece, name]
        return total


@dataclasses.dataclass
class Gradient:
    """Derivatives of a scalar of the skin, by one linear solve."""
    pieces: dict           # {piece: {"translate": [3] per mm, "rotate": [3] per degree}}
    young: np.ndarray      # by ln of Young's modulus of each stratum, as Tangent.young
    complete: bool         # else the linear solve did not end or met negative curvature, and all are 0


@dataclasses.dataclass
class GivenSkin:
    """The skin that a scene names, where another is solved in its place (tissue.edge)."""
    position: np.ndarray   # [G, 3] mm, initial
    triangles: np.ndarray
    rows: np.ndarray       # [G, 16] points of the solved skin that a vertex follows
    weights: np.ndarray    # [G, 16]

    def follow(self, displacement):
        """Returns the positions of its vertices when the solved skin is displaced."""
        return self.position + np.einsum("gk,gka->ga", self.weights, displacement[self.rows])


@dataclasses.dataclass
class Face:
    """An answer: the skin at rest, mm."""
    plan: dict
    position: np.ndarray      # [N, 3] mm
    initial: np.ndarray       # [N, 3] mm
    triangles: np.ndarray     # [T, 3]
    error: float              # mm, estimated distance to the rest position
    converged: bool
    fields: dict              # name -> array
    tangent: object           # Tangent, or None
    info: dict                # the answer's head

    given: object = None      # the scene's own skin where another is solved: GivenSkin
    gradient: object = None   # Gradient, where requested

    @property
    def other_rest(self):
        """{"distance": mm, largest over the skin, "place": on the initial skin, mm} of another rest
        position, of more energy; None where none was found or searched for."""
        return self.info.get("other_rest")

    @property
    def summary(self):
        """Movement of the face, accuracy, warnings and contact, a text; None where it was not requested."""
        return self.info.get("summary")

    @property
    def displacement(self):
        return self.position - self.initial

    @property
    def given_position(self):
        """[G, 3] mm, the skin that the scene names (tissue.edge), carried along; None without."""
        return self.given and self.given.follow(self.displacement)

    def mesh(self):
        """meshio mesh of the skin with displacement and fields."""
        import meshio
        return meshio.Mesh(self.position, [("triangle", self.triangles)],
                           point_data={"displacement": self.displacement, **self.fields})

    def polydata(self):
        """PyVista mesh of the same."""
        import pyvista
        faces = np.column_stack([np.full(len(self.triangles), 3), self.triangles]).ravel()
        mesh = pyvista.PolyData(self.position, faces)
        for name, values in {"displacement": self.displacement, **self.fields}.items():
            mesh.point_data[name] = values
        return mesh


class Session:
    """A scene that is built once and solved for many plans. A plan is a dictionary
    {piece: {"translate": [x, y, z], "rotate": [x, y, z]}}, mm and degrees (rotation vector about the
    piece's centroid); a piece that is not named stays. Answers do not depend on their order.
    Threads may share a session; a newer `solve` abandons the one under way, which raises Refused.

    With `verify_every` n, each n-th answer is solved again from a cold start by a second process at low
    priority; `on_verified(verification)` is called with the outcome, on a thread of its own, and
    `verifications` lists them."""

    def __init__(self, scene, ranks=1, program=None, environment=None, verify_every=0, on_verified=None,
                 niceness=0):
        if not isinstance(ranks, int) or ranks < 1:
            raise ValueError(f"ranks must be a whole number from 1, not {ranks!r}")
        if not isinstance(verify_every, int) or verify_every < 0:
            raise ValueError(f"verify_every must be a whole number from 0, not {verify_every!r}")
        path = pathlib.Path(getattr(scene, "path", scene)).resolve()
        command = [absolute_program(str(program), "name repose-live") if program else find_program(), str(path)]
        surroundings = without_mpi(environment or os.environ)
        if ranks > 1:
            command = [absolute_program("mpirun", "install Open MPI, or take one rank", surroundings.get("PATH")),
                       "-n", str(ranks), *command]
            surroundings = mpi_environment(surroundings)
        if niceness:
            command = ["nice", "-n", str(niceness), *command]
        self._watch = SceneWatch(Scene(path)) if path.is_file() else None
        self._verifier = None
        if verify_every:
            self._verifier = Verifier(lambda: Session(path, 1, program, environment, niceness=19),
                                      verify_every, on_verified)
        self._errors = []
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                         stderr=subprocess.PIPE, cwd=path.parent, env=surroundings)
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._writing, self._waiting, self._last = threading.Lock(), {}, 0
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.changes = {}
        try:
            self._take_description(*self.describe())
        except Refused:
            self.close()
            raise

    def _take_description(self, head, arrays):
        self.pieces = [Piece(one["name"], one["bone"], *(np.array(one[key]) for key in
                                                         ("centroid", "translate", "rotate")))
                       for one in head["pieces"]]
        self.box, self.accuracy = head["box"], head["accuracy"]
        self.axes = np.array(head["axes"])  # rows left, back and up of the head
        self.initial = arrays["position"].astype(float)
        self.triangles = arrays["triangles"]
        self.given = None
        if "given_position" in arrays:
            self.given = GivenSkin(*(arrays[f"given_{name}"] for name in
                                     ("position", "triangles", "rows", "weights")))
        self.bones = {name: (arrays[f"bone_{row}_points"], arrays[f"bone_{row}_triangles"])
                      for row, name in enumerate(head["bones"])}

    def change(self, **values):
        """Builds the scene again with other values of its keys: material, attach_regions, release or
        boundary, as in a scene file. A key that is not named has the scene's own value, also where it was
        changed before. A refused change leaves the scene as it was."""
        self._take_description(*self.ask({"do": "change", **values}))
        self.changes = values

    def solve(self, plan, accuracy=None, tangents=False, base="scene", gradient_of=None,
              other_rest=False, summary=False):
        """The face for a plan, to `accuracy` mm, 1e-6 … 10 (the scene's). `base` is where the search begins:
        "scene", the plan of the scene's moves, "rest", the initial state, or another plan. `gradient_of`
        {row: [x, y, z]}: weights of points of the skin, by the derivatives of whose sum Σ w · x the face
        has a `gradient`. With `other_rest` the search begins at the initial state and looks for another
        rest position, which contact may allow: the face is that of less energy, and its `other_rest`
        says how far and where the skin of the other one is. With `summary` the face has one, as of `write`."""
        request = {"do": "solve", "plan": _plain(plan), "tangents": tangents,
                   "base": base if isinstance(base, str) else _plain(base)}
        if other_rest:
            request |= {"base": "rest", "other_rest": True}
        if summary:
            request["summary"] = True
        if accuracy is not None:
            if not is_number(accuracy):
                raise Refused(f"accuracy must be a number of mm, 1e-6 … 10, not {accuracy!r}")
            request["accuracy"] = float(accuracy)
        if gradient_of:
            request["gradient_of"] = [{"point": int(row), "weight": [float(w) for w in weight]}
                                      for row, weight in gradient_of.items()]
        head, arrays = self.ask(request)
        columns, missing, young, fields = {}, [], [], {}
        names = {piece.bone: piece.name for piece in self.pieces}
        for name, values in arrays.items():
            if not name.startswith("tangent_"):
                fields[name] = values
                continue
            if name.startswith("tangent_young_"):
                young.append(values)
                if not all(head["flags"][name].values()):
                    missing.append(("young", len(young) - 1))
                continue
            bone, component = name.split("_")[1:]
            columns[names[int(bone)], component] = values
            if not all(head["flags"][name].values()):
                missing.append((names[int(bone)], component))
        position = fields.pop("position").astype(float)
        self.count_answer(plan, head, position, accuracy)
        gradient = None
        if told := head.get("gradient"):
            gradient = Gradient(told["pieces"], np.array(told["young"]), told["finished"] and told["convex"])
        return Face(plan, position, self.initial, self.triangles, head["error"], head["converged"],
                    fields, Tangent(columns, missing, young) if tangents else None, head, self.given,
                    gradient)

    def count_answer(self, plan, head, position, accuracy=None):
        """Counts an answer for verification; `solve` does so itself."""
        if self._verifier and head["converged"]:
            self._verifier.add(_plain(plan), np.array(position), head["energy"],
                               accuracy or self.accuracy, self.changes)

    @property
    def verifications(self):
        """The answers that were solved again from a cold start: repose.verify.Verification."""
        return list(self._verifier.outcomes) if self._verifier else []

    def wait_for_verification(self):
        """Waits until no verification is under way."""
        if self._verifier:
            self._verifier.wait()

    @property
    def scene_changed(self):
        """True where the scene or a file that it names has changed on disk since the session was started.
        Its answers are those of the scene as it was."""
        return bool(self._watch and self._watch.changed())

    def tangents(self, plan=None, accuracy=None):
        """The derivatives of the skin at a plan, by default the scene's own."""
        return self.solve(self.scene_plan if plan is None else plan, accuracy, True).tangent

    @property
    def scene_plan(self):
        """The plan of the scene's moves."""
        return {piece.name: {"translate": piece.translate.tolist(), "rotate": piece.rotate.tolist()}
                for piece in self.pieces}

    def describe(self):
        """The scene as repose-live describes it: (head, arrays)."""
        return self.ask({"do": "describe"})

    def write(self, output, plan=None):
        """Writes a plan, solved unless it was solved last, or the last answer, as a full result OUTPUT.h5 with its
        XDMF files. Returns the summary that it holds, a text."""
        request = {"do": "write", "output": str(pathlib.Path(output).resolve())}
        head, _ = self.ask(request if plan is None else {**request, "plan": _plain(plan)})
        return head["summary"]

    def close(self):
        """Ends repose-live, and a verification under way."""
        if self._verifier:
            self._verifier.close()
        process = self._process
        if process.poll() is None:
            try:
                process.stdin.write(b'{"id": 0, "do": "quit"}\n')  # ends a solve under way
                process.stdin.close()
                process.wait(timeout=20)
            except (OSError, subprocess.TimeoutExpired):
                process.terminate()
                try:
                    process.wait(timeout=20)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
        self._reader.join(timeout=5)
        self._listener.join(timeout=5)
        process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _listen(self):
        with self._process.stderr as stream:
            for line in stream:
                self._errors = self._errors[-20:] + [line.decode(errors="replace").rstrip()]

    def _read(self):
        try:
            while line := self._process.stdout.readline():
                if line.startswith(b"{"):  # else of a library: UCX, below MPI, complains on standard output
                    self._take_answer(json.loads(line))
        except (KeyError, TypeError, ValueError):
            pass  # no JSON, no answer, or an array that the end of the solver has cut off
        finally:
            for number in list(self._waiting):
                self._give(number, None, {})

    def _take_answer(self, head):
        arrays = {}
        for one in head["arrays"]:
            kind = np.dtype("<" + one["type"])
            size = int(np.prod(one["shape"])) * kind.itemsize
            arrays[one["name"]] = np.frombuffer(self._process.stdout.read(size), kind).reshape(one["shape"])
        # Without a number it refuses a line that was not understood: nobody may wait for its answer.
        for number in list(self._waiting) if head["id"] is None else [head["id"]]:
            self._give(number, head, arrays)

    def _give(self, number, head, arrays):
        waiting = self._waiting.pop(number, None)
        if waiting:
            waiting["answer"] = head, arrays
            waiting["event"].set()

    def ask(self, request):
        """The answer to a request of the protocol: (head, arrays); Refused where there is none."""
        waiting = {"event": threading.Event()}
        with self._writing:
            self._last += 1
            number = self._last
            try:
                line = json.dumps({**request, "id": number}, allow_nan=False)
            except ValueError as reason:
                raise Refused(f"a request holds texts, lists and finite numbers only: {reason}") from None
            self._waiting[number] = waiting
            try:
                self._process.stdin.write(line.encode() + b"\n")
                self._process.stdin.flush()
            except (OSError, ValueError):
                self._waiting.pop(number, None)
                raise Refused(self._end()) from None
            if not self._reader.is_alive():
                self._give(number, None, {})
        waiting["event"].wait()
        head, arrays = waiting["answer"]
        if head is None:
            raise Refused(self._end())
        if not head["ok"]:
            raise Refused(head["error"])
        return head, arrays

    def _end(self):
        try:
            status = self._process.wait(timeout=10)
            self._listener.join(timeout=2)  # of the last lines on standard error
        except subprocess.TimeoutExpired:
            status = "unknown"
        message = next((line for line in self._errors if line.startswith("error:")), "")
        return message[7:] or f"repose-live has ended (status {status}): {' '.join(self._errors[-3:])}"


# What mpirun gives the processes that it starts; its settings (OMPI_MCA_…) of users are others.
OF_MPIRUN = ("OMPI_COMM", "OMPI_UNIVERSE", "OMPI_FILE", "OMPI_APP", "OMPI_ARGV", "OMPI_COMMAND",
             "OMPI_FIRST", "OMPI_NUM", "OMPI_MCA_ess", "OMPI_MCA_orte", "OMPI_MCA_pmix",
             "OMPI_MCA_initial", "PMIX_", "PMI_", "PRTE_JOB")


def without_mpi(environment):
    """The environment without that by which a program takes itself for a rank of the mpirun that
    started this process."""
    return {name: value for name, value in environment.items() if not name.startswith(OF_MPIRUN)}


def _plain(plan):
    """A plan as JSON holds it; Refused where it is none."""
    if not isinstance(plan, Mapping):
        raise Refused(f"a plan is {{PIECE: {{'translate': [x, y, z], 'rotate': [x, y, z]}}}}, not {plan!r}")
    vectors = {piece: vectors_of(piece, motion) for piece, motion in plan.items()}
    return {piece: {key: [float(value) for value in vectors[piece][key]] for key in motion}
            for piece, motion in plan.items()}
