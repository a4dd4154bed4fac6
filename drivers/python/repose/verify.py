"""Some of a session's answers solved again from a cold start, in the background."""

import dataclasses
import threading

import numpy as np

ROUNDING = 0.005  # mm


@dataclasses.dataclass
class Verification:
    """An answer beside that of a solver of its own, which was started for it, began at the initial state
    and looked for another rest position. `agrees`: their distance is within the accuracy of both."""
    plan: dict
    distance: float  # mm, largest over the skin
    agrees: bool
    message: str
    lower: bool = False  # the other one has less energy


class Verifier:
    """Verifies every `every`-th answer by a solver that `start()` opens at low priority, one at a time:
    an answer that is due meanwhile is verified next, the latest first. `tell` is called with each
    Verification, on a thread of its own."""

    def __init__(self, start, every, tell=None):
        self.start, self.every, self.tell = start, every, tell
        self.outcomes = []
        self._count, self._due, self._closed = 0, None, False
        self._lock, self._thread, self._cold = threading.Lock(), None, None

    def add(self, plan, position, energy, accuracy, changes=None):
        """Counts a converged answer, its energy in N mm, of a scene with changes (Session.change)."""
        with self._lock:
            self._count += 1
            if self._closed or self._count % self.every:
                return
            self._due = plan, position, energy, accuracy, changes
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, daemon=True)
                self._thread.start()

    def wait(self):
        """Waits for the verification under way."""
        if thread := self._thread:
            thread.join()

    def close(self):
        """Abandons the verification under way and ends its solver."""
        with self._lock:
            self._closed, self._due = True, None
            cold, thread = self._cold, self._thread
        if cold:
            cold.close()
        if thread:
            thread.join(timeout=30)

    def _next(self):
        with self._lock:
            due, self._due = self._due, None
            if due is None:
                self._thread = None
            return due

    def _work(self):
        while due := self._next():
            try:
                outcome = self._verify(*due)
            except (ValueError, OSError) as reason:  # Refused is a ValueError
                outcome = Verification(due[0], np.nan, False, f"not verified from a cold start: {reason}")
            if self._closed:
                return
            self.outcomes.append(outcome)
            if self.tell:
                self.tell(outcome)

    def _verify(self, plan, position, energy, accuracy, changes):
        cold = self.start()
        with self._lock:
            self._cold = cold
        try:
            if self._closed:  # meanwhile
                raise ValueError("its session has ended")
            if changes:
                cold.change(**changes)
            face = cold.solve(plan, accuracy, other_rest=True)
        finally:
            with self._lock:
                self._cold = None
            cold.close()
        if len(face.position) != len(position):
            raise ValueError("the scene is another one now")
        apart = np.linalg.norm(face.position - position, axis=1)
        agrees = bool(face.converged and apart.max() <= 2 * accuracy + ROUNDING)
        lower = face.converged and not agrees and face.info["energy"] < energy
        if not face.converged:
            message = f"not verified: the search from a cold start ended with {face.info['reason']}"
        elif agrees:
            message = f"verified from a cold start: the same face within {apart.max():.3f} mm"
            if face.other_rest:
                message += (f"; at {np.round(face.other_rest['place']).astype(int).tolist()} mm tissue has "
                            f"another rest position, {face.other_rest['distance']:.2f} mm away")
        else:
            message = (f"NOT verified: a search from a cold start ends {apart.max():.2f} mm away, at "
                       f"{np.round(position[apart.argmax()]).astype(int).tolist()} mm, with an energy of "
                       f"{face.info['energy']:.4g} in place of {energy:.4g} N mm: there are two rest positions")
        return Verification(plan, float(apart.max()), agrees, message, lower)
