#!/usr/bin/env python3
"""Evaluations and time of several methods to a known rest position; writes a page.

    tests/benchmark/contest.py [-bin build/bin] [-cases forward,large] [-methods default,lmvm]
                               [-accuracy 0.01] [-rounds 3] [-seconds 60] [-output docs/measurements/minimizers.md]

Each case is solved by repose-solve to 1e-9 mm; its result is the model file and the rest position
of all methods. The methods in C++ are run by benchmark_contest, SciPy's here, with an evaluation in
NumPy of the model file. Times are the least CPU time of the rounds.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy python3-scipy liblbfgs-dev
"""

import json
import os
import pathlib
import subprocess
import tempfile
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # before numpy: everything on one core
    os.environ[name] = "1"

import numpy as np

try:
    import scipy
    from scipy.optimize import minimize
    from scipy.sparse import csr_matrix
except ImportError:
    scipy = None

from page import PROJECT, option_parser, write
from tissue import Tissue, last, model_of

REFERENCE = "1e-9"  # mm
FORWARD, OPENING = "meshes/paper_jaw_advance.yaml", "meshes/paper_jaw_opening.yaml"
LARGE = 4300  # skin vertices
# name: title, scene (none: a synthetic head of LARGE), options of repose-solve
CASES = {
    "forward": ("The paper-sized head as shipped: jaw 6 mm forward, penalty volume term", FORWARD, []),
    "opening": ("The same head, jaw opened by 8°, penalty volume term", OPENING, []),
    "volume": ("Jaw forward, the paper's energy with its volume term, (f_e + f_v) / 2", FORWARD,
               ["-volume", "paper", "-lambda", "0.5"]),
    "energy": ("Jaw forward, the paper's energy alone, f_e", FORWARD, ["-volume", "none"]),
    "large": (f"A head of {LARGE} skin vertices, jaw 6 mm forward, penalty volume term", None, []),
}
METHODS = {
    "default": "**Repose**, its default",
    "default_end": "the same until its own estimate says so",
    "stiffness": "Repose, L-BFGS from the stiffness",
    "stiffness_step": "the same, in one predicted load step",
    "ntr": "Repose, Newton, no load steps",
    "lmvm": "Repose `-tao_type lmvm`, no load steps",
    "polak_ribiere": "the paper's: Polak–Ribière, Brent",
    "motion": "equations of motion",
    "liblbfgs": "liblbfgs on Repose's kernel",
    "L-BFGS-B": "SciPy L-BFGS-B, NumPy kernel",
    "Newton-CG": "SciPy Newton-CG, NumPy kernel",
}
SCIPY = {"L-BFGS-B": {"maxiter": 10**9, "maxfun": 10**9, "ftol": 0, "gtol": 0},
         "Newton-CG": {"maxiter": 10**9, "xtol": 1e-15}}
COUNTED = ("default", "default_end", "stiffness", "stiffness_step", "ntr")  # their linear systems
# whom Repose is to beat, by what, by how many times
GOALS = [("polak_ribiere", "evaluations", 30), ("polak_ribiere", "seconds", 15),
         ("liblbfgs", "seconds", 3), ("L-BFGS-B", "seconds", 20)]
# options that change what is measured, in the command that the page names
SETTINGS = {"cases": ",".join(CASES), "methods": ",".join(METHODS), "accuracy": 0.01, "rounds": 3,
            "seconds": 60.0}
PATIENCE = 5  # times of the default that one run of the equations of motion may take
LONG = 20  # s: what takes longer is not repeated


def cross(a, b):
    """Cross products of [3, M] arrays."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                     a[0] * b[1] - a[1] * b[0]])


class Evaluation:
    """Objective and gradient of a model in NumPy, as docs/theory/model.md writes them, as fast as arrays
    go: components in rows, only springs and prisms that move, sums over points by a sparse matrix."""

    def __init__(self, model, step):
        self.weights(step)
        self.soft = model["point/set"] == 0
        self.count = len(self.soft)
        self.start = np.where(self.soft[:, None], model["point/position"], step["point/position"]).T
        spring = self.soft[model["spring/points"]].any(1)
        self.ends = model["spring/points"][spring].T
        self.rest, self.stiffness, self.reference = (
            model[f"spring/{key}"][spring] for key in ("rest_length", "stiffness", "reference"))
        self.power = model["spring/exponent"][spring]
        self.pull = self.sum_at(self.ends[1]) - self.sum_at(self.ends[0])
        prism = self.soft[model["prism/points"]].any(1) & (self.prism_weight > 0)
        self.corners = model["prism/points"][prism].T
        self.volume = model["prism/rest_volume"][prism]
        self.push = self.sum_at(self.corners.ravel())

    def weights(self, step):
        """Φ = spring_weight f_e + prism_weight Σ (v − v_0)² (/ v_0 in the penalty)."""
        self.penalty = step["volume"] == b"penalty"
        self.spring_weight = step["lambda"] if step["volume"] == b"paper" else 1.0
        self.prism_weight = {b"none": 0.0, b"paper": 1 - step["lambda"],
                             b"penalty": step["bulk_modulus"] / 2}[step["volume"]]

    def sum_at(self, points):
        """The matrix that adds a value of each element to its point; soft-tissue points only."""
        kept = np.flatnonzero(self.soft[points])
        return csr_matrix((np.ones(len(kept)), (points[kept], kept)), (self.count, len(points)))

    def springs(self, x):
        d = x[:, self.ends[1]] - x[:, self.ends[0]]
        r = np.sqrt((d * d).sum(0))
        s = r - self.rest
        t = (s / self.reference)**2
        if (self.power == 2).all():
            energy, stiffening = 1 + t + t * t / 3, (1 + t)**2
        else:
            energy = np.choose(self.power, [1 + 0 * t, 1 + t / 2, 1 + t + t * t / 3])
            stiffening = (1 + t)**self.power
        ks = self.spring_weight * self.stiffness * s
        return (ks * s * energy).sum() / 2, d * (ks * stiffening / np.where(r > 0, r, 1))

    def prisms(self, x):
        """The volume term and its derivative by the corners, [3, 6 M]."""
        a0, a1, a2, b0, b1, b2 = (x[:, corner] for corner in self.corners)
        u, v, p, q = a1 - a0, a2 - a0, b1 - b0, b2 - b0
        through, s, t = b0 - a0 + b1 - a1 + b2 - a2, 2 * v + q, v + 2 * q
        area = cross(u, s) + cross(p, t)
        miss = (through * area).sum(0) / 36 - self.volume
        scale = self.prism_weight / (self.volume if self.penalty else 1)
        du, dv = cross(s, through), cross(through, 2 * u + p)
        dp, dq = cross(t, through), cross(through, u + 2 * p)
        slope = np.stack([-du - dv - area, du - area, dv - area,
                          -dp - dq + area, dp + area, dq + area], axis=1)
        slope *= scale * miss / 18
        return (scale * miss**2).sum(), slope.reshape(3, -1)

    def __call__(self, unknowns):
        """Value and gradient by the unknowns, three a soft-tissue point."""
        x = self.start.copy()
        x[:, self.soft] = unknowns.reshape(-1, 3).T
        value, force = self.springs(x)
        gradient = self.pull @ force.T
        if self.prism_weight > 0:
            more, slope = self.prisms(x)
            value += more
            gradient += self.push @ slope.T
        return value, gradient[self.soft].ravel()


class SearchOver(Exception):
    pass


class StoppingTest:
    """Ends a search at the first state within the accuracy of the goal; its looks are not timed."""

    def __init__(self, function, goal, accuracy, seconds):
        self.function, self.goal, self.accuracy, self.limit = function, goal, accuracy, seconds
        self.evaluations, self.closest, self.looking = 0, np.inf, 0.0
        self.begin = time.process_time()

    def seconds(self):
        return time.process_time() - self.begin - self.looking

    def __call__(self, unknowns):
        self.evaluations += 1
        found = self.function(unknowns)
        look = time.process_time()
        away = np.linalg.norm((unknowns - self.goal).reshape(-1, 3), axis=1).max()
        self.closest = min(self.closest, away)
        self.looking += time.process_time() - look
        if self.closest <= self.accuracy or self.seconds() > self.limit:
            raise SearchOver
        return found


def race_scipy(function, start, goal, method, chosen):
    """One entry like those of benchmark_contest, and the state where the method stopped by itself."""
    test = StoppingTest(function, goal, chosen.accuracy, chosen.seconds)
    entry, stopped = {"method": method, "values": 0, "assemblies": 0, "excess": 0}, None
    try:
        stopped = minimize(test, start, jac=True, method=method, options=SCIPY[method]).x
        entry["end"] = "elsewhere"
    except SearchOver:
        entry["end"] = "reached" if test.closest <= chosen.accuracy else "limit"
    return entry | {"evaluations": test.evaluations, "seconds": test.seconds(),
                    "distance": test.closest}, stopped


def scipy_entry(function, step, method, chosen):
    """Where the method stops at another minimum it is raced again to that one."""
    soft = function.soft
    start, goal = function.start.T[soft].ravel(), step["point/position"][soft].ravel()
    entry, stopped = race_scipy(function, start, goal, method, chosen)
    if stopped is None:
        return entry
    value, gradient = function(stopped)
    away = np.linalg.norm((stopped - goal).reshape(-1, 3), axis=1).max()
    if np.abs(gradient).max() < 1e-5 * np.abs(function(start)[1]).max():
        entry, _ = race_scipy(function, start, stopped, method, chosen)
        entry["end"] = "own_minimum"
    return entry | {"distance": away, "excess": value / function(goal)[0] - 1}


def agree_with_tests(function, model, step):
    """The evaluation is that by which the tests check the program."""
    weight = step["lambda"] if step["volume"] == b"paper" else step["bulk_modulus"]
    tissue = Tissue(model, step["volume"].decode(), weight)
    x = step["point/position"] + np.random.default_rng(1).normal(0, 0.3, (function.count, 3)) * (
        function.soft[:, None])
    value, gradient = tissue.value_and_gradient(x)
    mine, slope = function(x[function.soft].ravel())
    assert abs(mine / value - 1) < 1e-12
    assert np.abs(slope - gradient[function.soft].ravel()).max() < 1e-10 * np.abs(gradient).max()


class Contest:
    """One case: its entries by method, the least time of each, and what single operations take."""

    def __init__(self, case, folder, chosen):
        self.chosen, self.folder = chosen, folder
        self.title, scene, options = CASES[case]
        self.scene = PROJECT / scene if scene else self.synthetic_head()
        self.run("repose-solve", self.scene, *options, "-accuracy", REFERENCE, "-allow_folded",
                 "-output", "rest")
        self.entries, self.left_out, self.begin = {}, [], time.time()

    def run(self, program, *arguments):
        done = subprocess.run([self.chosen.bin / program, *map(str, arguments)], cwd=self.folder,
                              text=True, capture_output=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip() or done.stdout)
        return done.stdout

    def synthetic_head(self):
        self.run("repose-phantom", "-skin_vertices", LARGE, "-springs",
                 "-output", "large")
        return self.folder / "large_jaw_advance.yaml"

    def of_program(self, method, *options):
        seconds = self.chosen.seconds
        if method == "motion":  # scanned over many dampings and steps
            seconds = min(seconds, PATIENCE * self.entries["default", 0]["seconds"])
        text = self.run("benchmark_contest", "rest.h5", method, "-scene", self.scene, "-accuracy",
                        self.chosen.accuracy, "-seconds", seconds, *options)
        return [json.loads(line) for line in text.splitlines()]

    def of_scipy(self, method):
        return [scipy_entry(self.function, self.step, method, self.chosen)]

    def add(self, method, entries):
        for place, entry in enumerate(entries):
            known = self.entries.setdefault((method, place), entry)
            known["seconds"] = min(known["seconds"], entry["seconds"])

    def enter(self, method):
        """Counts first where that takes time of its own, then so many rounds."""
        measure = self.of_scipy if method in SCIPY else self.of_program
        if method in COUNTED:
            counted, *_ = measure(method, "-count")
            self.add(method, [counted | {"seconds": np.inf}])
        begin = time.time()
        for _ in range(self.chosen.rounds):
            self.add(method, measure(method))
            if time.time() - begin > LONG:
                break

    def run_all(self):
        self.step, self.model = last(self.folder / "rest.h5"), model_of(self.folder / "rest.h5")
        self.unknowns = 3 * int((self.model["point/set"] == 0).sum())
        self.costs, = self.of_program("costs")
        if scipy:
            self.function = Evaluation(self.model, self.step)
            agree_with_tests(self.function, self.model, self.step)
            self.costs["numpy"] = self.numpy_cost()
        for method in self.chosen.methods.split(","):
            if method in SCIPY and not scipy:
                self.left_out.append(f"{METHODS[method]}: SciPy is not there")
                continue
            try:
                self.enter(method)
            except RuntimeError as refusal:
                self.left_out.append(f"{METHODS[method]}: {refusal}")
            print(f"  {method} after {time.time() - self.begin:.0f} s", flush=True)

    def numpy_cost(self):
        at, times = self.function.start.T[self.function.soft].ravel(), []
        for _ in range(5):
            begin = time.process_time()
            self.function(at)
            times.append(time.process_time() - begin)
        return min(times)


def ending(entry):
    """Describes the outcome in words."""
    away = f"{entry['distance']:.2g} mm"
    if entry["end"] == "reached":
        return away
    if entry["end"] == "own_minimum":
        return f"to another minimum, {away} away, Φ {entry['excess']:+.2g} of the other"
    return ("time was up" if entry["end"] == "limit" else "stopped by itself") + f", {away} away"


def row(contest, method, entry):
    unit = contest.entries["default", 0]["seconds"]
    name = METHODS[method] if method != "motion" else entry["method"]
    count = ("" if entry["end"] in ("reached", "own_minimum") else "> ") + str(entry["evaluations"])
    if entry["values"]:
        count += f" ({entry['evaluations'] - entry['values']} with gradient)"
    hessians = "–"
    if entry["assemblies"]:
        hessians = ", ".join(str(entry[what]) for what in ("assemblies", "renewals", "actions",
                                                           "applications"))
    return (f"| {name} | {count} | {hessians} | {entry['seconds'] / unit:.2g}× | "
            f"{ending(entry)} |\n")


def table(contest):
    cost, unit = contest.costs, contest.costs["evaluation"]
    text = (f"## {contest.title}\n\n{contest.unknowns} unknowns. In evaluations of Repose's kernel, "
            f"one new preconditioner takes {cost['renewal'] / unit:.0f}, one\nproduct with the Hessian and one "
            f"application of it {cost['action'] / unit:.1f}")
    if "numpy" in cost:
        text += f", one evaluation in NumPy {cost['numpy'] / unit:.0f}"
    own = contest.entries["default", 0]
    spent = own["renewals"] * cost["renewal"] + own["actions"] * cost["action"]
    text += (f". The default takes {own['seconds']:.2g} s of CPU,\nof which its linear systems "
             f"are about "
             f"{100 * spent / own['seconds']:.0f} %.\n\n"
             "| method | evaluations | Hessians, preconditioners, products, applications | time | distance |\n"
             "|---|--:|--:|--:|---|\n")
    for (method, _), entry in contest.entries.items():
        text += row(contest, method, entry)
    return text + "".join(f"\nLeft out: {why}\n" for why in contest.left_out)


def verdict(contest, own, rival, what, times):
    """Reduction factor, and whether it reaches the goal."""
    entry, own = contest.entries.get((rival, 0)), contest.entries.get((own, 0))
    if not entry or not own:
        return "not measured"
    ratio = entry[what] / own[what]
    message = f"{ratio:.0f}×" if ratio >= 10 else f"{ratio:.2g}×"
    reached = "**reached**" if ratio >= times else "missed"
    if entry["end"] in ("limit", "elsewhere"):
        return f"≥ {message}: " + (reached if ratio >= times else "not known")
    other = ", to another minimum" if "own_minimum" in (entry["end"], own["end"]) else ""
    return f"{message}: {reached}{other}"


def verdicts(contests, own, name):
    """Speedup of one of Repose's methods over the others."""
    names = {"polak_ribiere": "the paper's algorithm", "liblbfgs": "liblbfgs on the same kernel",
             "L-BFGS-B": "SciPy L-BFGS-B"}
    text = f"| {name} is faster than | " + " | ".join(contests) + " |\n"
    text += "|---|" + "---|" * len(contests) + "\n"
    for rival, what, times in GOALS:
        word = "evaluations" if what == "evaluations" else "time"
        text += f"| {names[rival]}, {word}; goal {times}× | " + " | ".join(
            verdict(contest, own, rival, what, times) for contest in contests.values()) + " |\n"
    return text


def spread(values):
    low, high = min(values), max(values)
    return f"{low:.2g}" if low == high else " to ".join(f"{v:.0f}" if v > 10 else f"{v:.2g}"
                                                        for v in (low, high))


def conclusion(contests):
    """Compares the figures with the goals, in a few sentences."""
    over = {what: [c.entries["polak_ribiere", 0][what] / c.entries["default", 0][what]
                   for c in contests.values() if ("polak_ribiere", 0) in c.entries]
            for what in ("evaluations", "seconds")}
    action = [c.costs["action"] / c.costs["evaluation"] for c in contests.values()]
    others = [entry for c in contests.values() for (method, _), entry in c.entries.items()
              if not method.startswith("default")]
    astray = sum(entry["end"] == "own_minimum" for entry in others)
    if not over["seconds"]:
        return ""
    return f"""
The goals refer to the first row of each table, without evaluations on a coarser model. The paper's
algorithm takes {spread(over['evaluations'])} times the evaluations of the default, and {spread(over['seconds'])} times its time: a product with
the Hessian and an application of the preconditioner take as long as {spread(action)} evaluations, and each
Newton step, prediction and estimate needs many. {astray} of the other {len(others)} runs, which start with the bones in
their final places, reached another minimum than the load path's.
"""


def machine():
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30
    busy = ", with other work running" if os.getloadavg()[1] > 1.3 else ""
    return f"one core of a machine with {os.cpu_count()} cores, {memory:.0f} GiB of memory{busy}"


def page(contests, chosen, where):
    accuracy = f"{chosen.accuracy:g} mm"
    words = [f"-{name} {getattr(chosen, name)}" for name, default in SETTINGS.items()
             if getattr(chosen, name) != default]
    text = f"""# Other minimizers, to {accuracy}

Evaluations and CPU time of Repose, the paper's methods, liblbfgs and SciPy on the paper's springs.
Made by `{" ".join(["tests/benchmark/contest.py", *words])}` in one run, on
{where}.

Every method starts from the initial positions, with the bones at once in their final places, on the same
model file. It is stopped at the first state it evaluates that is within {accuracy} (largest distance
of a point) of the rest position, which repose-solve found to {REFERENCE} mm. Only the default and
L-BFGS from the stiffness take load steps; this cost is included. An evaluation is one of the value, or of value and gradient, which cost
the same in Repose's kernel. Hessians, new preconditioners, products with the Hessian and applications
of preconditioners are counted separately; their time is included. Times are CPU times relative to
the default, the least of {chosen.rounds} rounds, or of fewer where they take over {LONG} s. Set-up
(reading, distribution, index arrays) is excluded.

- L-BFGS from the stiffness: `-tao_type lmvm -tao_lmvm_initial stiffness`, see
  [the linear solver](../theory/linear_solver.md).
- The equations of motion: unit masses, with the best damping c and step h of a scan, which a user would
  have to find first; one evaluation of the forces per step (Euler) or three (Runge–Kutta); a run
  that takes {PATIENCE} times the default's time is stopped.
- liblbfgs: its defaults (m = 6, Moré–Thuente), without its own stopping tests, with Repose's kernel.
- SciPy {scipy.__version__ if scipy else ""}: an evaluation of the model file in NumPy, vectorized over springs and
  prisms, sums by sparse matrices; L-BFGS-B with m = 10; Newton-CG with Hessian products by differences
  of gradients.
- Distance: of the last state. "Another minimum": evaluations and time are to {accuracy} of that minimum.

## Goals

{verdicts(contests, "default", "Repose's default")}{conclusion(contests)}
{verdicts(contests, "stiffness", "Repose's L-BFGS from the stiffness")}
{verdicts(contests, "stiffness_step", "the same in one predicted load step")}
"""
    return text + "\n".join(table(contest) for contest in contests.values())


def arguments():
    parser = option_parser(__doc__, PROJECT / "docs/measurements/minimizers.md", **SETTINGS)
    chosen = parser.parse_args()
    for given, known in ((chosen.cases, CASES), (chosen.methods, METHODS)):
        for word in set(given.split(",")) - set(known):
            parser.error(f"{word}: choose from {', '.join(known)}")
    if not chosen.methods.startswith("default"):
        parser.error("-methods: begin with default, in whose times all are counted")
    return chosen


def main():
    chosen, contests, where = arguments(), {}, machine()
    for case in chosen.cases.split(","):
        print(case, flush=True)
        with tempfile.TemporaryDirectory() as folder:
            contests[case] = Contest(case, pathlib.Path(folder), chosen)
            contests[case].run_all()
    write(chosen.output, page(contests, chosen, where))
    print(f"wrote {chosen.output}")


if __name__ == "__main__":
    main()
