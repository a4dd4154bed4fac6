#!/usr/bin/env python3
"""Repose's solid against other programs and minimizers on the same points; prints a table a file.

    tests/benchmark/peers.py FILE.h5 … [-bin build/bin] [-methods repose,ccx_spooles,…]
                             [-accuracy 0.01] [-part 1] [-moving 0.1] [-rounds 3] [-seconds 600]
                             [-young 0.015 -poisson 0.45] [-folder .] [-output page.md]

FILE.h5 is a model or a result of repose-solve; one of springs gets the moduli given. -part 0.1
makes a tenth of the move. Who stops how:

- repose: by its own estimate, at -accuracy. CPU s of its search alone, the model in memory
  (benchmark_contest), and of the whole program.
- liblbfgs (benchmark_contest, in C++ on Repose's energy), scipy_* and polysolve_* (on the energy in
  NumPy): from the initial positions with the fixed points in place at once, by an oracle, at the
  first state within -accuracy of the rest position everywhere. Set-up is in nobody's time. "Own"
  leaves out what the energy, its gradient and Hessian take in NumPy; "with Repose's evaluation"
  adds to it as many evaluations as were made, at what one takes in C++; Hessians are free then.
- dolfinx_*: linear tetrahedra, Newton until a step is within -accuracy; all but the start of the
  program and the compilation of its forms, the best of 1 and 4 load steps.
- ccx_*: CalculiX, wedges C3D6, its own neo-Hookean law (isochoric, with the same small strains),
  its own tests and increments, the best of beginning with a quarter of the load and with all of
  it; -seconds is its limit of wall time.

Skin: mean distance from quadratic tetrahedra over the points of the skin that these move by more
than -moving mm, and the same over their mean motion. They are kept in -folder, as
FILE_quadratic.npy, and found there the next time. Everything on one core; times are ratios within
one run, the least of -rounds where they are below 5 s. -output puts each table below the mark
<!-- FILE --> of a page that is there.
Needs Debian 12's packages: apt-get install --no-install-recommends python3-dolfinx calculix-ccx
liblbfgs-dev python3-h5py python3-scipy; for PolySolve an environment of one's own:
    /usr/bin/python3 -m venv --system-site-packages VENV; VENV/bin/pip install polyfem-polysolve
    VENV/bin/python tests/benchmark/peers.py …
A program that is not there is left out with a word.
"""

import contextlib
import dataclasses
import json
import logging
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "CCX_NPROC_EQUATION_SOLVER"):
    os.environ[name] = "1"  # before numpy: everything on one core

import numpy as np
from scipy.optimize import minimize

from measure import run
from page import option_parser, print_table  # which adds the folder of the next ones
import finite_elements
from continuum import Solid, rest_position
from tissue import last, write_model

try:
    import polysolve
except ImportError:
    polysolve = None


LONG = 5  # s: what takes longer is not repeated


@dataclasses.dataclass
class Row:
    name: str
    seconds: float = None    # CPU
    own: float = None        # of it, without an energy in NumPy
    counts: str = ""
    position: np.ndarray = None
    remark: str = ""
    evaluations: int = 0


class Stop(Exception):
    """The oracle's, or time is up."""


class Energy:
    """A solid's energy by the displacements of its soft points, which an oracle watches."""

    def __init__(self, solid, rest, accuracy, limit):
        self.solid, self.rest, self.accuracy, self.limit = solid, rest, accuracy, limit
        self.fixed_at = solid.rest.copy()
        fixed = solid.model["point/set"] != 0
        self.fixed_at[fixed] = solid.model["point/target"][fixed]
        self.unknown = (3 * solid.soft[:, None] + np.arange(3)).ravel()
        self.spent, self.evaluations, self.hessians, self.actions = 0.0, 0, 0, 0
        self.bent = None, None
        self.known, self.found, self.remark = (None, None), None, ""
        self.begin = time.process_time()

    def positions(self, u):
        x = self.fixed_at.copy()
        x[self.solid.soft] += u.reshape(-1, 3)
        return x

    def value_and_gradient(self, u):
        if self.known[0] is not None and np.array_equal(self.known[0], u):
            return self.known[1]
        begin = time.process_time()
        x = self.positions(u)
        distance = np.linalg.norm(x - self.rest, axis=1).max()
        value, gradient = self.solid.value_and_gradient(x)
        self.known = u.copy(), (value, gradient.ravel()[self.unknown])
        self.evaluations += 1
        self.spent += time.process_time() - begin
        if distance <= self.accuracy or time.process_time() - self.begin > self.limit:
            self.found = x
            self.remark = "" if distance <= self.accuracy else f"time is up, {distance:.2g} mm away"
            raise Stop
        return self.known[1]

    def value(self, u):
        return self.value_and_gradient(u)[0]

    def gradient(self, u):
        return self.value_and_gradient(u)[1]

    def hessian(self, u):
        begin = time.process_time()
        matrix = self.solid.hessian(self.positions(u))[self.unknown][:, self.unknown].tocsc()
        self.hessians += 1
        self.spent += time.process_time() - begin
        return matrix

    def hessian_action(self, u, way):
        if self.bent[0] is None or not np.array_equal(self.bent[0], u):
            self.bent = u.copy(), self.hessian(u)
        self.actions += 1
        return self.bent[1] @ way

    def time(self, name, method):
        """method(self, start) until the oracle stops it."""
        self.begin = time.process_time()
        try:
            end = method(self, np.zeros(len(self.unknown)))
            self.found = self.positions(end)
            left = np.linalg.norm(self.found - self.rest, axis=1).max()
            self.remark = f"stopped by itself, {left:.2g} mm away"
        except Stop:
            pass
        seconds = time.process_time() - self.begin
        hessians = f", {self.hessians} Hessians" if self.hessians else ""
        hessians += f", {self.actions} actions" if self.actions else ""
        return Row(name, seconds, seconds - self.spent, f"{self.evaluations} evaluations{hessians}",
                   self.found, self.remark, self.evaluations)


def scipy_method(name):
    settings = {"L-BFGS-B": {"maxiter": 10**9, "maxfun": 10**9, "ftol": 0, "gtol": 0, "maxcor": 10},
                "trust-krylov": {"gtol": 0}, "Newton-CG": {"xtol": 1e-15}}[name]

    def method(energy, start):
        more = {} if name == "L-BFGS-B" else {"hessp": energy.hessian_action}
        return minimize(energy.value_and_gradient, start, jac=True, method=name, options=settings,
                        **more).x
    return method


@contextlib.contextmanager
def quiet():
    """Nothing is printed: CHOLMOD says where a matrix is indefinite."""
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)


def polysolve_method(solver):
    settings = {"solver": solver, "line_search": {"method": "Backtracking"}, "grad_norm_tol": 1e-14,
                "max_iterations": 100000, "first_grad_norm_tol": 1e-16,
                "allow_out_of_iterations": True}

    def method(energy, start):
        stopped = []

        class Problem(polysolve.Problem):  # an exception does not go through PolySolve's loops well
            def guarded(self, what, u):
                try:
                    return what(u)
                except Stop:
                    stopped.append(True)
                    raise

            def value(self, u):
                return self.guarded(energy.value, u)

            def gradient(self, u):
                return self.guarded(energy.gradient, u)

            def hessian(self, u):
                return energy.hessian(u)

        try:
            with quiet():
                return polysolve.minimize(Problem(), start, settings,
                                          {"solver": "Eigen::CholmodSupernodalLLT"},
                                          log_level=polysolve.LogLevel.off)[0]
        except Exception:
            if stopped:
                raise Stop from None
            raise
    return method


MINIMISERS = {
    "scipy_lbfgsb": ("SciPy L-BFGS-B", scipy_method("L-BFGS-B")),
    "scipy_trust_krylov": ("SciPy trust-krylov", scipy_method("trust-krylov")),
    "scipy_newton_cg": ("SciPy Newton-CG", scipy_method("Newton-CG")),
    "polysolve_newton": ("PolySolve Newton, CHOLMOD", polysolve_method("Newton")),
    "polysolve_lbfgs": ("PolySolve L-BFGS", polysolve_method("L-BFGS")),
}
METHODS = ["repose", "liblbfgs", *MINIMISERS, "dolfinx_mumps", "dolfinx_gamg", "ccx_spooles",
           "ccx_cholesky", "wedges"]


class Comparison:
    """All methods on one file's model."""

    def __init__(self, file, options, folder):
        self.options, self.folder = options, folder
        model = finite_elements.model_with_moduli(file, options.young, options.poisson)
        if options.part != 1:
            x = model["point/position"]
            model["point/target"] = x + options.part * (model["point/target"] - x)
            model.pop("bone_transform", None)
        self.name, self.model = pathlib.Path(file).stem, model
        self.file = folder / "model.h5"
        write_model(self.file, model)
        self.solid = Solid(model)
        self.rest = rest_position(self.solid)
        self.mark = self.name + ("" if options.part == 1 else f"_{options.part:g}")
        self.quadratic, _ = finite_elements.reference(model, self.mark, options.folder)
        self.evaluation = None  # CPU s of one in C++

    def rows(self):
        for method in self.options.methods.split(","):
            try:
                yield from self.least(method)
            except ArithmeticError as failure:
                yield Row(method, remark=str(failure))

    def least(self, method):
        """A method's rows, with the least times of the rounds where they are short."""
        rows = self.measure(method)
        for _ in range(self.options.rounds - 1):
            if rows[0].seconds is None or rows[0].seconds > LONG:
                break
            rows = [min(pair, key=lambda row: row.seconds) for pair in zip(rows, self.measure(method))]
        return rows

    def measure(self, method):
        if method == "repose":
            return self.repose()
        if method == "liblbfgs":
            return self.liblbfgs()
        if method == "wedges":
            return [Row("this element's own rest position (NumPy, 1e-9 mm)", position=self.rest)]
        if method.startswith("ccx"):
            return [calculix(self, method.partition("_")[2])]
        if method.startswith("dolfinx"):
            return [self.dolfinx(method.partition("_")[2])]
        if method.startswith("polysolve") and polysolve is None:
            return [Row(method, remark="not installed")]
        title, how = MINIMISERS[method]
        energy = Energy(self.solid, self.rest, self.options.accuracy, self.options.seconds)
        return [energy.time(title, how)]

    def contest(self, method, *options):
        """Figures that benchmark_contest prints of a method, by their names."""
        exact = self.folder / "exact.h5"
        if not exact.exists():
            self.repose_solve(1e-9, "exact")
        done = run([self.options.bin / "benchmark_contest", exact, method, *options], ends=[0])
        return json.loads(done.text.splitlines()[-1])

    def repose_solve(self, accuracy, name):
        return run([self.options.bin / "repose-solve", self.file, "-accuracy", accuracy,
                    "-output", self.folder / name])

    def repose(self):
        search = self.contest("default_end", "-accuracy", self.options.accuracy)
        program = self.repose_solve(self.options.accuracy, "result")
        step = last(self.folder / "result.h5")
        position = step["point/position"]
        away = np.linalg.norm(position - self.rest, axis=1).max()
        message = "" if step["converged"] else "NOT CONVERGED, "
        self.evaluation = self.contest("costs")["evaluation"]
        counts = f"{search['evaluations']} evaluations, {search['assemblies']} Hessians"
        return [Row("**Repose**, its search", search["seconds"], None, counts, position,
                    f"{message}says {step['displacement_error']:.2g} mm, is {away:.2g} mm away"),
                Row("Repose, the whole program", program.seconds, None, "", position)]

    def liblbfgs(self):
        entry = self.contest("liblbfgs", "-accuracy", self.options.accuracy, "-seconds",
                             self.options.seconds)
        remark = f"{entry['end']}, {entry['distance']:.2g} mm away"
        return [Row("liblbfgs, Repose's energy", entry["seconds"], entry["seconds"],
                    f"{entry['evaluations']} evaluations", None,
                    "" if entry["end"] == "reached" else remark)]

    def dolfinx(self, kind):
        best = None
        for loads in (1, 4):
            try:
                solved = finite_elements.solve(self.model, 1, kind, loads, self.options.accuracy)
            except ArithmeticError:
                continue
            if best is None or solved.seconds < best.seconds:
                best = solved
        if best is None:
            raise ArithmeticError("diverged")
        return Row(f"DOLFINx, linear tetrahedra, {kind.upper()}", best.seconds, None,
                   f"{best.solves} linear systems", best.position)


def calculix(comparison, solver):
    """CalculiX with SPOOLES' factor or its conjugate gradients with incomplete Cholesky."""
    title = f"CalculiX, C3D6, {'SPOOLES' if solver == 'spooles' else 'iterative'}"
    if not shutil.which("ccx"):
        return Row(title, remark="not installed")
    rows = []
    for first in (0.25, 1):  # with which conjugate gradients need not end
        (comparison.folder / "peer.inp").write_text(calculix_deck(comparison.model, solver, first))
        limit = 10 * rows[0].seconds + 10 if rows else comparison.options.seconds
        try:
            done = run(["ccx", "-i", "peer"], comparison.folder, ends=None, timeout=limit)
        except subprocess.TimeoutExpired:
            continue
        found = calculix_positions(comparison.folder / "peer.dat", comparison.model)
        if done.status == 0 and found is not None:
            increments = len((comparison.folder / "peer.sta").read_text().splitlines()) - 2
            iterations = done.text.count("iteration ")
            rows.append(Row(title, done.seconds, None,
                            f"{increments} increments, {iterations} iterations", found))
    if not rows:
        return Row(title, remark="no solution")
    return min(rows, key=lambda row: row.seconds)


SOLVERS = {"spooles": "SPOOLES", "cholesky": "ITERATIVE CHOLESKY", "scaling": "ITERATIVE SCALING"}


def calculix_deck(model, solver, first):
    """The input file: C10 = mu/2, D1 = 2/K with K the bulk modulus of small strains."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in
              enumerate(model["point/position"].tolist(), 1)]
    both = np.stack([model["prism/shear_modulus"], model["prism/modulus"]], 1).round(12)
    kinds, kind = np.unique(both, axis=0, return_inverse=True)
    for row, (mu, kappa) in enumerate(kinds.tolist()):
        lines.append(f"*ELEMENT, TYPE=C3D6, ELSET=E{row}")
        chosen = np.flatnonzero(kind.ravel() == row)
        lines += [f"{m + 1}," + ",".join(map(str, points)) for m, points in
                  zip(chosen.tolist(), (model["prism/points"][chosen] + 1).tolist())]
        lines += [f"*MATERIAL, NAME=M{row}", "*HYPERELASTIC, NEO HOOKE",
                  f"{mu / 2:.12g},{2 / (kappa - mu / 3):.12g}",
                  f"*SOLID SECTION, ELSET=E{row}, MATERIAL=M{row}"]
    lines += ["*STEP, NLGEOM, INC=1000", f"*STATIC, SOLVER={SOLVERS[solver]}",
              f"{first},1.", "*BOUNDARY"]
    motion = model["point/target"] - model["point/position"]
    lines += [f"{n + 1},{d + 1},{d + 1},{motion[n, d]:.12g}"
              for n in np.flatnonzero(model["point/set"] != 0) for d in range(3)]
    return "\n".join(lines + ["*NODE PRINT, NSET=ALL, FREQUENCY=1000", "U", "*END STEP", ""])


def calculix_positions(file, model):
    """Positions of the last printed increment, None if there is none."""
    rows = [line.split() for line in file.read_text().splitlines()] if file.exists() else []
    rows = [row for row in rows if len(row) == 4 and row[0].isdigit()]
    count = len(model["point/position"])
    if len(rows) < count:
        return None
    found = np.array(rows[-count:], dtype=float)
    return model["point/position"] + found[np.argsort(found[:, 0]), 1:]


def head(comparison):
    moved = np.linalg.norm(comparison.quadratic - comparison.model["point/position"], axis=1)
    return (f"{comparison.name}: {3 * len(comparison.solid.soft)} unknowns, "
            f"{len(comparison.solid.prisms)} prisms, "
            f"{comparison.options.part:g} of the move, to {comparison.options.accuracy:g} mm; "
            f"largest motion {moved.max():.2f} mm\n\n"
            "| method | CPU s | own | with Repose's evaluation | times Repose's | counts "
            "| skin | |\n"
            "|---|--:|--:|--:|--:|---|--:|---|")


def lines(comparison):
    base = None
    for row in comparison.rows():
        base = base or (row.seconds if "Repose" in row.name else None)
        fair = row.own
        if row.evaluations and comparison.evaluation:
            fair = row.own + row.evaluations * comparison.evaluation
        ratio = fair if fair is not None else row.seconds
        yield "| " + " | ".join([
            row.name, number(row.seconds), number(row.own), number(fair),
            f"{ratio / base:.2g}×" if base and ratio else "–", row.counts, skin(comparison, row),
            row.remark]) + " |"


def number(seconds):
    return "–" if seconds is None else f"{seconds:.3g}"


def skin(comparison, row):
    if row.position is None:
        return "–"
    mean, _, motion = finite_elements.difference(comparison.model, row.position, comparison.model,
                                                 comparison.quadratic, comparison.options.moving)
    return f"{mean:.4f} mm, {100 * mean / motion:.2f} %"


def main():
    logging.disable()
    parser = option_parser(__doc__, methods=",".join(METHODS), accuracy=0.01, part=1.0, moving=0.1,
                           rounds=3, seconds=600.0, young=0.015, poisson=0.45,
                           folder=pathlib.Path("."))
    parser.add_argument("files", nargs="+")
    options = parser.parse_args()
    for file in options.files:
        with tempfile.TemporaryDirectory() as folder:
            comparison = Comparison(file, options, pathlib.Path(folder))
            print_table(head(comparison), lines(comparison), options.output, comparison.mark)
            print()


if __name__ == "__main__":
    main()
