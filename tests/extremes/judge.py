"""A row of the table: one run of repose-solve at an extreme, and what an independent minimizer
says of
its result."""

import dataclasses
import pathlib
import subprocess
import typing

import numpy as np
from scipy.sparse import diags
from scipy.sparse.linalg import ArpackError, eigsh

from conftest import finish, programs
from continuum import Solid, factorized, newton_step, rest_position
from networks import Network, factorized_dense
from tissue import model_of, steps, write_model

TIME_LIMIT = 600  # seconds


@dataclasses.dataclass
class Row:
    """An extreme and what is expected of it. `make(folder)` → model or scene's text; `truth(model,
    found
    positions)` → where it comes to rest, by default the nearest rest position by Newton's method.
    """

    name: str
    make: typing.Callable
    options: tuple = ()
    truth: typing.Callable | None = None
    within: float | None = None  # mm, of the truth; the accuracy asked for when not given
    may_end: str = ""  # a pattern: the run may end without success, with these words
    refused: str = ""  # a pattern: the input is refused with these words
    slow: bool = False
    judged: bool = True  # by an independent minimizer


@dataclasses.dataclass
class Verdict:
    row: Row
    got: str
    evaluations: int | None = None
    estimate: float | None = None
    error: float | None = None
    faults: list = dataclasses.field(default_factory=list)


def volume_weight(step):
    """Weight of a prism's squared change of volume, by its volume; the paper's objective λ f_e +
    (1-λ) f_v is divided by λ."""
    if step["volume"] == b"penalty":
        return lambda volume: step["bulk_modulus"] / volume
    if step["volume"] == b"paper" and step["lambda"] < 1:
        return lambda volume: np.full(len(volume), 2 * (1 - step["lambda"]) / step["lambda"])
    return None


class SupportedSolid(Solid):
    """A solid with elastic supports, the one term with elements of heads without anatomy, at load 1."""

    def __init__(self, model):
        super().__init__(model)
        numbers = model.get("element/0/numbers", np.empty(0)).reshape(-1, 5)
        self.place, self.support = np.zeros_like(self.rest), np.zeros((len(self.rest), 1))
        for point, (*start, stiffness, bone) in zip(model.get("element/0/points", ()), numbers):
            self.place[point] = (model["bone_transform"][int(bone)] @ (*start, 1))[:3]
            self.support[point] = stiffness

    def value_and_gradient(self, x):
        value, gradient = super().value_and_gradient(x)
        force = self.support * (x - self.place)
        return value + (force * (x - self.place)).sum() / 2, gradient + force

    def hessian(self, x, curved=True):
        return super().hessian(x, curved) + diags(np.repeat(self.support, 3))


def tissue_of(model, step, exact=False):
    """The independent energy of a model as a step minimized it."""
    if "edge/points" in model:
        return SupportedSolid(model)
    return Network(model, volume_weight(step), np.longdouble if exact else float)


def load_of(tissue):
    """Dead forces on the soft points, which a Network has in its energy already."""
    model = tissue.model
    if isinstance(tissue, Network):
        return np.zeros_like(tissue.rest)
    return model["point/mass"][:, None] * model["gravity"] + model["point/external_force"]


def nearest_rest(tissue, found):
    """The rest position that Newton's method comes to from there."""
    x = found.astype(getattr(tissue, "dtype", float))
    unknown = (3 * tissue.soft[:, None] + np.arange(3)).ravel()
    factorize = factorized if x.dtype == float else factorized_dense
    push, last = load_of(tissue), np.inf
    for _ in range(60):
        x, length = newton_step(tissue, x, unknown, push, factorize)
        if length < 1e-13 * np.abs(x).max() or (length < 1e-9 and length > last / 2):
            break
        last = length
    return x.astype(float)


def follow(loads=8, exact=False):
    """A truth: the rest position that is reached as the bones go there in so many loads."""

    def truth(model, _, step):
        tissue = tissue_of(model, step, exact)
        near = rest_position(
            tissue,
            loads=loads,
            tolerance=1e-6 * np.ptp(tissue.rest),
            force=load_of(tissue),
            factorize=factorized_dense if exact else factorized,
        )
        return nearest_rest(tissue, near)

    return truth


def polished(model, found, step):
    return nearest_rest(tissue_of(model, step, len(found) < 200), found)


def least_eigenvalue(model, found, step):
    """Least eigenvalue of the Hessian scaled to a diagonal of one: below 0 it is no minimum."""
    tissue = tissue_of(model, step)
    unknown = (3 * tissue.soft[:, None] + np.arange(3)).ravel()
    matrix = tissue.hessian(found)[unknown][:, unknown]
    scale = 1 / np.sqrt(np.maximum(np.abs(matrix.diagonal()), 1e-300))
    matrix = matrix.multiply(scale[:, None]).multiply(scale).tocsc()
    if len(unknown) <= 600:
        return np.linalg.eigvalsh(matrix.toarray())[0]
    try:
        return eigsh(matrix, 1, sigma=-1e-3, which="LM", return_eigenvectors=False, tol=1e-3)[0]
    except (ArpackError, RuntimeError):
        return np.nan


def run_row(row, folder, environment):
    """Makes the input, runs it and judges what came of it."""
    made = row.make(folder)
    given = folder / "in.yaml" if isinstance(made, str) else folder / "in.h5"
    if isinstance(made, str):
        given.write_text(made)
    else:
        write_model(given, made)
    command = [programs() / "repose-solve", given, "-output", folder / "out", *row.options]
    result = finish(list(map(str, command)), folder, environment, TIME_LIMIT)
    if result.returncode in (0, 2):
        return judged(row, result, folder / "out.h5", environment)
    verdict = Verdict(row, "refused: " + shortened(result.stderr, folder))
    if not row.refused:
        verdict.faults.append("refused")
    elif not matches(row.refused, result.stderr):
        verdict.faults.append("refused in other words")
    if result.returncode != 1 or len(result.stderr.splitlines()) != 1:
        verdict.faults.append(
            f"exit status {result.returncode}, {len(result.stderr.splitlines())} " "lines on stderr"
        )
    if (folder / "out.h5").exists():
        verdict.faults.append("a file is left")
    return verdict


def matches(pattern, text):
    return subprocess.run(["grep", "-qiE", pattern], input=text, text=True).returncode == 0


def shortened(text, folder):
    line = text.strip().splitlines()[0] if text.strip() else "nothing"
    return line.replace(str(folder) + "/", "").removeprefix("repose-solve: ")


def with_contact(model, step):
    """The minimizers know no contact: its forces, which repose-check recomputes, are dead loads."""
    if "point/contact_force" not in step:
        return model
    name = "point/external_force"
    return model | {name: model[name] + step["point/contact_force"]}


def judged(row, result, file, environment):
    """Judges a run that left a result."""
    path = steps(file)
    step = path[-1]
    model = with_contact(model_of(file), step)
    verdict = Verdict(
        row, ended(result, step), sum(s["evaluations"] for s in path), step["displacement_error"]
    )
    converged, position = step["converged"] == 1, step["point/position"]
    if not all(
        np.isfinite(values).all() for s in path for name, values in s.items() if "/" in name
    ):
        verdict.faults.append("not finite")
    if converged != (result.returncode == 0) and "FOLDED" not in result.stdout:
        verdict.faults.append("the exit status is not the file's")
    if result.stderr:
        verdict.faults.append("stderr: " + result.stderr.splitlines()[0])
    check = finish(
        [str(programs() / "repose-check"), str(file)], file.parent, environment, TIME_LIMIT
    )
    if check.returncode != 0:
        verdict.faults.append("repose-check: " + check.stderr.strip()[-200:])
    if row.refused:
        verdict.faults.append("not refused")
    if result.returncode == 2 and not (row.may_end and matches(row.may_end, result.stdout)):
        verdict.faults.append("ended without success")
    if row.judged and step["load"] == 1 and np.isfinite(position).all():
        compare(row, verdict, model, step, converged)
    return verdict


def ended(result, step):
    """One cell: how the run ended."""
    if result.returncode == 0:
        return "a rest position"
    folded = [line for line in result.stdout.splitlines() if line.startswith("FOLDED")]
    if folded:
        return folded[0].split(";")[0].split("(")[0].strip().lower()
    return f"not converged at load {step['load']:.3g}: {step['reason'].decode()}"


def compare(row, verdict, model, step, converged):
    """Estimate and accuracy against the truth; a state called converged is a minimum."""
    position = step["point/position"]
    scale = np.abs(position).max()
    truth = (row.truth or polished)(model, position, step)
    verdict.error = np.linalg.norm(position - truth, axis=1).max()
    rounding = 1e-14 * scale
    if not verdict.error <= verdict.estimate + rounding:
        verdict.faults.append("the estimate is too small")
    if not converged:
        return
    within = row.within or accuracy_of(row)
    if not verdict.error <= within + rounding:
        verdict.faults.append(f"not within {within:g} mm")
    if least_eigenvalue(model, position, step) < -1e-9:
        verdict.faults.append("converged at a place that is no minimum")


def accuracy_of(row):
    options = list(row.options)
    return float(options[options.index("-accuracy") + 1]) if "-accuracy" in options else 0.1


def folder_of(row, top):
    folder = pathlib.Path(top) / "".join(c if c.isalnum() else "_" for c in row.name)
    folder.mkdir(parents=True)
    return folder


def expectation(row):
    """One cell: what is expected of a row."""
    if row.refused:
        return "a refusal"
    within = f"a rest position within {row.within or accuracy_of(row):g} mm"
    return within + (", or a word on why not" if row.may_end else "")
