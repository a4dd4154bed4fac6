"""A predicted skin that follows transforms of bones as they are moved, in a program that shows both."""

import queue
import threading
import time

from .motion import motion_of

POLL = 0.03   # s between looks for an answer
PAUSE = 0.25  # s without a change after which the derivatives are renewed


class Follower:
    """Keeps the skin of a view up to date with its transforms. The view shows, this class decides what:

        view.matrices()              {piece: 4×4 matrix, LPS, mm}
        view.show(face, text)        face: skin positions [N, 3], LPS; text: how good they are
        view.tell(text)              what went wrong, in a line
        view.later(seconds, work)    calls work() once on the view's own thread

    Call `changed` when a transform has been modified, on the view's thread; `close` at the end. A preview
    by the derivatives is shown at once, the exact skin when the solver has answered."""

    def __init__(self, session, view):
        self.session, self.view = session, view
        self.centroids = {piece.name: piece.centroid for piece in session.pieces}
        self.reference = None   # the latest answer with derivatives
        self.plan = None
        self._answers, self._number, self._polling, self._closed = queue.SimpleQueue(), 0, False, False
        self._threads = []
        self.changed()

    def close(self):
        """Ends the solver; later calls do nothing."""
        self._closed = True
        self.session.close()
        for thread in self._threads:
            thread.join(timeout=5)

    def changed(self):
        """Takes the present transforms: shows the preview and asks for the exact skin."""
        if self._closed:
            return
        try:
            plan = {piece: motion_of(matrix, self.centroids[piece])
                    for piece, matrix in self.view.matrices().items()}
        except ValueError as reason:
            return self._refuse(str(reason))
        if outside := self._outside(plan):
            return self._refuse(outside)
        if plan == self.plan:
            return
        self.plan = plan
        if self.reference:
            self.view.show(self.preview(plan), "preview")
        self._ask(plan, False)

    def _refuse(self, reason):
        """Says why there is no skin of the present transforms; answers under way are none of theirs."""
        self.plan = None
        self._number += 1
        self.view.tell(reason)

    def preview(self, plan):
        """The skin by the derivatives of the latest answer that has them."""
        change = {}
        for piece, motion in plan.items():
            known = self.reference.plan[piece]
            change[piece] = {key: [new - old for new, old in zip(motion[key], known[key])]
                             for key in ("translate", "rotate")}
        return self.reference.position + self.reference.tangent.displacement(change)

    def _outside(self, plan):
        for piece, motion in plan.items():
            for key, unit in (("translate", "mm"), ("rotate", "degrees")):
                for value, most in zip(motion[key], self.session.box[key]):
                    if abs(value) > most + 1e-6:
                        return (f"{piece}: {key} {value:.1f} {unit} is outside the plan's box "
                                f"(±{most:g}); move it back, or widen the box in the scene")
        return None

    def _ask(self, plan, tangents):
        self._number += 1
        number = self._number

        def work():
            try:
                self._answers.put((number, self.session.solve(plan, tangents=tangents)))
            except Exception as reason:  # of any kind, else the view stays at the preview
                self._answers.put((number, reason))
        thread = threading.Thread(target=work, daemon=True)
        self._threads = [one for one in self._threads if one.is_alive()] + [thread]
        thread.start()
        self._poll_later()

    def _poll_later(self):
        if not self._polling:
            self._polling = True
            self.view.later(POLL, self._poll)

    def _poll(self):
        self._polling = False
        if self._closed:
            return
        time.sleep(0.002)  # an event loop in C++ may keep the interpreter: the threads go on meanwhile
        while not self._answers.empty():
            self._take(*self._answers.get())
        if any(thread.is_alive() for thread in self._threads) or not self._answers.empty():
            self._poll_later()

    def _take(self, number, answer):
        latest = number == self._number
        if isinstance(answer, Exception):
            if latest:
                self.view.tell(str(answer))
            return
        if answer.tangent and answer.converged:
            self.reference = answer
        if not latest:
            return
        if not answer.converged:
            return self.view.tell(f"not converged: {answer.info['reason']}")
        self.view.show(answer.position, f"exact to {max(answer.error, 0.001):.3f} mm")
        if not answer.tangent:
            self.view.later(PAUSE, lambda: self._renew(number))

    def _renew(self, number):
        """Asks for derivatives where nothing has changed for a while."""
        if number == self._number and not self._closed:
            self._ask(self.plan, True)
