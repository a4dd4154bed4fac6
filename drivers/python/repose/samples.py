"""Plans of a box, solved with their derivatives and kept in a folder."""

import contextlib
import dataclasses
import hashlib
import io
import os
import pathlib
import queue
import threading
import time

import numpy as np

from .session import COMPONENTS, Refused, Session, vectors_of


class PlanBox:
    """The coordinates of a plan, those of width 0 left out, scaled to [-1, 1]."""

    def __init__(self, pieces, box):
        half = {"translate": box["translate"], "rotate": box["rotate"]}
        self.coordinates = [(piece, key, axis) for piece in pieces for key in ("translate", "rotate")
                            for axis in range(3) if half[key][axis] > 0]
        self.half = np.array([half[key][axis] for _, key, axis in self.coordinates], float)

    def plan(self, u):
        """The plan at u [d]."""
        plan = {}
        for (piece, key, axis), value in zip(self.coordinates, np.asarray(u) * self.half):
            motion = plan.setdefault(piece, {"translate": [0.0] * 3, "rotate": [0.0] * 3})
            motion[key][axis] = round(float(value), 9)
        return plan

    def vector(self, plan):
        """u [d] of a plan; a piece that is not named stays."""
        known = {piece for piece, _, _ in self.coordinates}
        if unknown := plan.keys() - known:
            raise Refused(f"plan: '{min(unknown)}' is no piece of the plan; its pieces are "
                          f"{', '.join(sorted(known))}")
        motions = {piece: vectors_of(piece, plan.get(piece, {})) for piece in known}
        return np.array([motions[piece][key][axis] for piece, key, axis in self.coordinates]) / self.half

    def points(self, count):
        """[count, d] the center, 4 d Sobol points, the ends of the axes, then more Sobol points. Those in the
        inside come first: from few samples they tell more of random plans than the ends do."""
        from scipy.stats import qmc
        dimensions = len(self.half)
        sobol = qmc.Sobol(dimensions, scramble=True, seed=1)
        sobol = 2 * sobol.random_base2(int(np.ceil(np.log2(max(count, 2))))) - 1
        ends = np.concatenate([np.eye(dimensions), -np.eye(dimensions)])
        first, more = sobol[:4 * dimensions], sobol[4 * dimensions:]
        return np.concatenate([np.zeros((1, dimensions)), first, ends, more])[:count]

    def held_out(self, count):
        """[count, d] random points that are no samples."""
        return np.random.default_rng(20).uniform(-1, 1, (count, len(self.half)))


@dataclasses.dataclass
class Sample:
    """A solved plan: displacement [N, 3] and its derivatives by u [d, N, 3], NaN where not finished."""
    u: np.ndarray
    displacement: np.ndarray
    slopes: np.ndarray
    converged: bool


def to_slopes(tangent, box, points):
    """Derivatives by u of an answer's tangents; NaN for those that are not finished."""
    slopes = np.full((len(box.half), points, 3), np.nan)
    for row, (piece, key, axis) in enumerate(box.coordinates):
        column = piece, COMPONENTS[3 * (key == "rotate") + axis]
        if column in tangent.columns and column not in tangent.missing:
            slopes[row] = tangent.columns[column] * box.half[row]
    return slopes


class SampleStore:
    """A folder of solved plans of one scene and accuracy: a run that was ended goes on."""

    def __init__(self, folder, key):
        self.folder = pathlib.Path(folder) / key
        self.folder.mkdir(parents=True, exist_ok=True)

    def path(self, u):
        return self.folder / (hashlib.sha256(np.round(u, 9).tobytes()).hexdigest()[:16] + ".npz")

    def load(self, u):
        """The sample at u, or None where it is not solved, or its file is damaged."""
        try:
            with np.load(self.path(u)) as stored:
                return Sample(stored["u"], stored["displacement"].astype(float),
                              stored["slopes"].astype(float), bool(stored["converged"]))
        except Exception:  # damaged archives and headers of arrays raise many kinds
            return None

    def save(self, sample):
        path = self.path(sample.u)
        part = path.with_suffix(f".{os.getpid()}.{threading.get_ident()}.part")
        packed = io.BytesIO()  # an archive on a full disk complains again when it is destroyed
        np.savez(packed, u=sample.u, displacement=sample.displacement.astype("f4"),
                 slopes=sample.slopes.astype("f4"), converged=sample.converged)
        try:
            part.write_bytes(packed.getvalue())
            part.replace(path)
        except OSError as reason:  # that of a write names no file
            raise OSError(reason.errno, reason.strerror, str(path)) from None
        finally:
            part.unlink(missing_ok=True)


def solve_sample(session, box, u, accuracy, tangents=True):
    """The sample at u. Where the search from the scene's plan fails, from the initial state."""
    for base in ("scene", "rest"):
        face = session.solve(box.plan(u), accuracy, tangents, base)
        if face.converged:
            break
    slopes = to_slopes(face.tangent, box, len(face.position)) if tangents and face.converged else \
        np.full((len(box.half), *face.position.shape), np.nan)
    return Sample(np.asarray(u), face.displacement, slopes, face.converged)


def rank_and_size():
    """This process among those that mpirun or srun has started."""
    for rank, size in (("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"), ("PMI_RANK", "PMI_SIZE"),
                       ("SLURM_PROCID", "SLURM_NTASKS")):
        if rank in os.environ and size in os.environ:
            return int(os.environ[rank]), int(os.environ[size])
    return 0, 1


def solve_all(scene, box, points, store, accuracy, session, processes=1, program=None,
              report=lambda done, total, text: None, tangents=True):
    """Samples at points [N, d], those of the store not solved again. Each of `processes` solvers takes
    the next plan; under mpirun a rank solves every size-th plan and the first returns all."""
    rank, size = rank_and_size()
    mine = [u for k, u in enumerate(points) if k % size == rank and store.load(u) is None]
    waiting, failures = queue.SimpleQueue(), []
    for u in mine:
        waiting.put(u)
    began, done = time.monotonic(), [0]

    def work(opening):
        try:
            with opening() as opened:
                while not failures:
                    u = waiting.get_nowait()
                    sample = solve_sample(opened, box, u, accuracy, tangents)
                    store.save(sample)
                    done[0] += 1
                    left = (time.monotonic() - began) / done[0] * (len(mine) - done[0])
                    report(done[0], len(mine), f"{done[0]} of {len(mine)} plans solved, {left:.0f} s left" +
                           ("" if sample.converged else "; the last one did not converge"))
        except queue.Empty:
            pass
        except Exception as failure:  # of any kind: its plan is not solved
            failures.append(failure)

    threads = [threading.Thread(target=work, args=[lambda: Session(scene, program=program)])
               for _ in range(min(processes, len(mine)) - 1)]
    for thread in threads:
        thread.start()
    work(lambda: contextlib.nullcontext(session))
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]
    return None if rank else _await_all(points, store)


def _await_all(points, store):
    """All samples, when the other ranks have solved theirs."""
    samples = []
    for u in points:
        while (sample := store.load(u)) is None:
            time.sleep(0.2)
        samples.append(sample)
    return samples
