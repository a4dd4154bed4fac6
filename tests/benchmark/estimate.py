#!/usr/bin/env python3
"""Can the estimate be trusted? Many small solves against rest positions known to 1e-9 mm; writes a
page and its picture.

    tests/benchmark/estimate.py [-bin build/bin] [-seeds 8] [-few] [-rows rows.csv]
                                [-output docs/measurements/estimate.md] [-picture docs/images/estimate.png]

Problems are the shipped heads of the paper's size and as many synthetic heads as there are seeds,
with random size, layers, springs, moves and loads. Each is solved by several methods to several
accuracies and some runs are interrupted (-tao_max_it, -time_limit); the displacement_error that each
reports is compared with its true distance from the rest position. -few leaves all but a handful out.
Needs: apt-get install --no-install-recommends python3-h5py python3-numpy python3-matplotlib
"""

import csv
import dataclasses
import itertools
import os
import pathlib
import resource
import shutil
import subprocess
import tempfile
import time

import h5py
import numpy as np

try:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError:
    matplotlib = None

import measure
from page import PROJECT, option_parser, write
from sheet.whole_file import Target, write_figure  # page knows where it is
from tissue import apart, last, steps

KNOWN = 1e-9  # mm: how well rest positions are known
SAME = 1e-6  # mm: two rest positions nearer than this are one
SOLVERS = ["ntr", "bnls", "lmvm", "cg"]
ACCURACIES = ["1", "0.1", "0.01", "0.001"]
TIMED = "0.01"
HARD = "1e-8"  # mm: accuracy that an interrupted run does not come to
# method, option, value; a time limit as part of the time that the method takes to 0.01 mm
INTERRUPTED = [("lmvm", "-tao_max_it", 10), ("lmvm", "-tao_max_it", 50), ("ntr", "-time_limit", 0.4),
               ("ntr", "-time_limit", 0.8), ("lmvm", "-time_limit", 0.4), ("lmvm", "-time_limit", 0.8)]
SHIPPED = [("forward", "paper_jaw_advance", "penalty"), ("forward", "paper_jaw_advance", "none"),
           ("forward", "paper_jaw_advance", "paper"), ("opening", "paper_jaw_opening", "penalty")]
VOLUMES = ["penalty", "none", "paper"]
WEAK_SEEDS, WEAK = range(8, 30), ("paper", ["ntr", "bnls"], ["1", "0.1"])  # where it is worst
FORCES = [0, 1, 2]  # seeds that are solved by forces too
MARKS = {"ntr": "#1f4e8c", "bnls": "#4c9ed9", "lmvm": "#c0392b", "cg": "#e59866"}
SCENE = """skin: head{size}_skin.ply
bones:
  - {{name: skull, file: head{size}_skull.ply}}
  - {{name: mandible, file: head{size}_mandible.ply}}
tissue:
  layers: {layers}
{load}  springs:
    default: {springs}
moves:
  - {{bone: mandible, translate: [{shift}]}}
  - {{bone: mandible, rotate: {{axis: [1, 0, 0], center: [0, 0, 0], angle: {angle:.2f}}}}}
solve:
  volume: {{poisson: 0.4967}}
{gravity}"""


@dataclasses.dataclass
class Problem:
    """A scene and what is minimized."""
    name: str
    scene: pathlib.Path
    options: list


@dataclasses.dataclass
class Run:
    """One solve: what it reported and what is true, mm. `elsewhere`: how far its own rest position
    is from the one the load path leads to, 0 where they are one; `error` is to its own then."""
    problem: str
    solver: str
    accuracy: str
    interrupted: str
    load: float
    converged: bool
    estimate: float
    error: float
    elsewhere: float

    @property
    def ratio(self):
        return self.estimate / max(self.error, KNOWN)

    @property
    def below(self):
        return self.estimate + KNOWN < self.error

    @property
    def within(self):
        return not self.below and self.estimate <= 10 * (self.error + KNOWN)


def random_scene(seed, folder, phantom):
    """Writes the scene of a seed and returns its file."""
    random = np.random.default_rng(seed)
    size, layers = int(random.integers(477, 800)), int(random.integers(2, 5))
    law, loaded = random.choice(["linear", "quadratic", "quartic"]), random.random() < 0.3
    stiffness = random.choice(["stiffness: 1.0", "modulus: 0.1"])
    reference = "1.0" if stiffness.startswith("s") else "initial"
    load = f"  turgor: 0.02\n  mass: {[0.05] * layers}\n" if loaded else ""
    shift = random.normal(0, 1, 3) * [0.5, 2, 1] + [0, -2, 0]
    text = SCENE.format(size=size, layers=layers, load=load,
                        springs=f"{{{stiffness}, law: {law}, reference: {reference}}}",
                        shift=", ".join(f"{s:.3f}" for s in shift), angle=random.uniform(-1, 4),
                        gravity="gravity: [0, 0, -9.80665]\n" if loaded else "")
    measure.run([phantom, "-skin_vertices", size, "-output", f"head{size}"], folder, ends=[0])
    file = folder / f"seed{seed}.yaml"
    file.write_text(text)
    return file


def problems(chosen, folder):
    found = [Problem(f"{name}, {volume}", PROJECT / f"meshes/{scene}.yaml", ["-volume", volume])
             for name, scene, volume in SHIPPED[:1 if chosen.few else None]]
    for seed in range(chosen.seeds):
        scene = random_scene(seed, folder, chosen.bin / "repose-phantom")
        volume = VOLUMES[seed % len(VOLUMES)]
        found.append(Problem(f"seed {seed}, {volume}", scene, ["-volume", volume]))
        if seed in FORCES and not chosen.few:
            found.append(Problem(f"seed {seed}, forces", scene, ["-functional", "force"]))
    return found


def tasks(problem, few):
    """(solver, accuracy, what interrupts it) of a problem's runs."""
    if few:
        return [("ntr", "0.01", None), ("lmvm", "0.1", None), ("lmvm", HARD, INTERRUPTED[0][1:])]
    solvers = ["ntr"] if "force" in problem.options else SOLVERS
    kept = [(solver, accuracy, None) for solver, accuracy in itertools.product(solvers, ACCURACIES)]
    return kept + [(solver, HARD, how) for solver, *how in INTERRUPTED if solver in solvers]


def weak_problems(chosen, folder):
    """Random heads with the volume term that is hardly convex."""
    for seed in () if chosen.few else WEAK_SEEDS:
        scene = random_scene(seed, folder, chosen.bin / "repose-phantom")
        yield Problem(f"seed {seed}, {WEAK[0]}", scene, ["-volume", WEAK[0]])


class Study:
    def __init__(self, chosen, folder):
        self.chosen, self.folder, self.left_out, self.times = chosen, folder, [], {}

    def solve(self, problem, name, *options):
        """The result file, or nothing where the program refuses or takes too long."""
        try:
            done = subprocess.run([self.chosen.bin / "repose-solve", problem.scene, *problem.options,
                                   *map(str, options), "-output", name], cwd=self.folder, text=True,
                                  capture_output=True, timeout=120)
        except subprocess.TimeoutExpired:
            return None
        return self.folder / f"{name}.h5" if done.returncode in (0, 2) else None

    def rest(self, problem):
        """The rest position that the load path leads to, or nothing."""
        file = self.solve(problem, "rest", "-accuracy", KNOWN)
        return known(last(file)) if file else None

    def own_rest(self, problem, ended):
        """The rest position that the last state of a result is nearest to, at its load: a restart
        from it settles there first. It must pass for converged for that."""
        shutil.copy(ended, self.folder / "ended.h5")
        with h5py.File(self.folder / "ended.h5", "r+") as h5:
            h5["step"][max(h5["step"])].attrs["converged"] = 1
        file = self.solve(problem, "own", "-accuracy", KNOWN, "-restart", "ended.h5")
        load = float(last(ended)["load"])
        settled = [step for step in steps(file) if float(step["load"]) == load] if file else []
        return known(settled[0]) if settled else None

    def run(self, problem, rest, solver, accuracy, how):
        """One run; nothing where its rest position cannot be found."""
        option, value = how or (None, None)
        limit = value * self.times[solver] if option == "-time_limit" else value
        file = self.solve(problem, "run", "-tao_type", solver, "-accuracy", accuracy,
                          *([option, limit] if how else []))
        if not file:
            return None
        step = last(file)
        if accuracy == TIMED:
            self.times[solver] = sum(float(s["seconds"]) for s in steps(file))
        run = Run(problem.name, solver, accuracy, f"{option} {value:g}" if how else "",
                  float(step["load"]), bool(step["converged"]), float(step["displacement_error"]),
                  apart(step, rest), 0.0)
        if run.load < 1 or run.below:
            own = self.own_rest(problem, file)
            if not own:
                return None
            run.error = apart(step, own)
            run.elsewhere = apart(own, rest) if run.load == 1 else 0.0
            run.elsewhere *= run.elsewhere > SAME
        return run

    def runs(self):
        for problem in problems(self.chosen, self.folder):
            yield from self.runs_of(problem, tasks(problem, self.chosen.few))

    def weak_runs(self):
        for problem in weak_problems(self.chosen, self.folder):
            yield from self.runs_of(problem, [(*way, None) for way in itertools.product(*WEAK[1:])])

    def runs_of(self, problem, expected):
        begin, rest = time.time(), self.rest(problem)
        if not rest:
            self.left_out.append(f"{problem.name}: no rest position to {KNOWN:g} mm")
            return
        for task in expected:
            run = self.run(problem, rest, *task)
            if run:
                yield run
            else:
                self.left_out.append(" ".join(map(str, (f"{problem.name}:", *task))))
        print(f"  {problem.name}: {time.time() - begin:.1f} s", flush=True)


def known(step):
    return step if step["converged"] and step["displacement_error"] <= KNOWN else None


def row(title, runs):
    """Row of the runs at the load path's rest position, others counted apart; empty for no run."""
    if not runs:
        return ""
    here = [run for run in runs if not run.elsewhere]
    finite = [run.ratio for run in here if np.isfinite(run.estimate) and run.error > KNOWN]
    low, middle, high = np.percentile(finite, [5, 50, 95]) if finite else [np.nan] * 3
    infinite = sum(not np.isfinite(run.estimate) for run in here)
    return (f"| {title} | {len(runs)} | {share(sum(run.below for run in here), len(here))} | "
            f"{share(sum(run.within for run in here), len(here))} | {infinite} | "
            f"{middle:.2f} ({low:.2f} … {high:.2f}) | {len(runs) - len(here)} |\n")


def share(count, total):
    return f"{count} ({count / total:.1%})" if total else "–"


def table(runs):
    text = ("| runs | number | estimate below the error | at most 10 times above | no minimum yet | "
            "ratio, median (5 … 95 %) | at another rest position |\n|---|" + "--:|" * 6 + "\n")
    whole = [run for run in runs if not run.interrupted]
    for solver in SOLVERS:
        text += row(f"{solver}", [run for run in whole if run.solver == solver])
    for accuracy in ACCURACIES:
        text += row(f"{accuracy} mm", [run for run in whole if run.accuracy == accuracy])
    for kind in ("penalty", "none", "paper", "forces"):
        text += row(f"{kind}" if kind == "forces" else f"volume {kind}",
                    [run for run in whole if run.problem.endswith(kind)])
    text += row("all to their end", whole)
    text += row("interrupted", [run for run in runs if run.interrupted])
    return text + row("**all**", runs)


def verdict(runs):
    here = [run for run in runs if not run.elsewhere]
    sound = sum(not run.below for run in here) / len(here)
    sharp = sum(run.within for run in here) / len(here)
    lost = [run for run in runs if run.elsewhere]
    strict = sum(not run.below and not run.elsewhere for run in runs) / len(runs)
    text = (f"Of {len(here)} runs the estimate is not below the true error in {sound:.1%} (wanted: 99 %, "
            f"{'reached' if sound >= 0.99 else 'missed'}) and not more than 10 times above it in "
            f"{sharp:.1%} (wanted: 90 %, {'reached' if sharp >= 0.9 else 'missed'}).")
    if lost:
        text += (f" {len(lost)} more ended at another rest position than the load path's, which no "
                 f"estimate at one state can detect; with them counted as too low, {strict:.1%} of "
                 f"{len(runs)} are not below.")
    return text + "\n"


def weak_place(weak):
    """Section on a second study, of solvers whose estimate fell short in the first."""
    if not weak:
        return ""
    rows = "".join(row(solver, [run for run in weak if run.solver == solver]) for solver in WEAK[1])
    heads = len({run.problem for run in weak})
    return f"""
## Where it is weakest

The paper's volume term (λ = 0.5) gives an energy that is hardly convex. {heads} more heads with it, by
Newton's methods to coarse accuracies ({", ".join(WEAK[2])} mm). These runs are not in the figures above, of which
such runs are a small part.

{table([])}{rows}{row("**all**", weak)}{listed(weak, [])}"""


def listed(runs, left_out):
    """The runs that are no good, one by one."""
    def name(run):
        until = f", {run.interrupted}, load {run.load:.3g}" if run.interrupted else ""
        return f"- {run.problem}: {run.solver}, {run.accuracy} mm{until}"
    text = "".join(f"{name(run)}: estimate {run.estimate:.2g} mm, error {run.error:.2g} mm\n"
                   for run in runs if run.below and not run.elsewhere)
    text = f"\nEstimate below the error:\n\n{text}" if text else ""
    lost = "".join(f"{name(run)}: {run.elsewhere:.2g} mm from the load path's; estimate "
                   f"{run.estimate:.2g} mm, distance from its own {run.error:.2g} mm\n"
                   for run in runs if run.elsewhere)
    text += f"\nAt another rest position:\n\n{lost}" if lost else ""
    if left_out:
        text += "\nLeft out, because the program did not finish in 120 s or no rest position is known:\n\n"
        text += "".join(f"- {line}\n" for line in left_out)
    return text


def draw(runs, file):
    """Draws a histogram of ratios, and the estimate over the error of each run."""
    shown = [run for run in runs if np.isfinite(run.estimate) and run.error > KNOWN
             and not run.elsewhere]
    groups = {solver: [run for run in shown if run.solver == solver] for solver in SOLVERS}
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), gridspec_kw={"wspace": 0.28})
    left.hist([[np.log10(run.ratio) for run in group] for group in groups.values()], stacked=True,
              bins=np.arange(-0.5, 1.51, 0.04), color=[MARKS[s] for s in groups], label=list(groups))
    left.axvline(0, color="0.3", lw=0.8)
    left.axvline(1, color="0.3", lw=0.8, ls="--")
    left.set_yscale("symlog", linthresh=10)
    left.set_xlabel("estimate over true error")
    left.set_xticks(np.log10([0.5, 1, 2, 5, 10, 20]), ["0.5", "1", "2", "5", "10", "20"])
    left.set_ylabel("runs")
    for solver, group in groups.items():
        for interrupted, mark in ((False, "o"), (True, "x")):
            part = [run for run in group if bool(run.interrupted) == interrupted]
            right.loglog([run.error for run in part], [run.estimate for run in part], mark, ms=3.5,
                         color=MARKS[solver], label=None if interrupted else solver)
    ends = np.array(right.get_xlim())
    right.loglog(ends, ends, color="0.3", lw=0.8)
    right.loglog(ends, 10 * ends, color="0.3", lw=0.8, ls="--")
    right.set_xlabel("true error, mm (crosses: interrupted)")
    right.set_ylabel("estimate, mm")
    right.legend(fontsize=7)
    write_figure(figure, Target(file, ".png"))


def page(runs, weak, study, seconds, picture):
    chosen = study.chosen
    options = (f" -seeds {chosen.seeds}" if chosen.seeds != 8 else "") + " -few" * chosen.few
    shown = f"![Estimates and true errors]({os.path.relpath(picture, chosen.output.parent)})\n\n" if (
        matplotlib) else ""
    stops = ", ".join(f"{solver} {how} {value:g}" for solver, how, value in INTERRUPTED)
    heads = len({run.problem for run in runs})
    return f"""# The error estimate against known errors

Every result holds an estimate of its distance to the rest position (`displacement_error`,
[theory](../theory/error_estimate.md)). Here {len(runs)} runs on {heads} problems are compared with rest
positions known to {KNOWN:g} mm. Made by `tests/benchmark/estimate.py{options}` in {seconds / 60:.0f} minutes of CPU
time on one core of a machine with {os.cpu_count()} cores.

{verdict(runs)}
{shown}{table(runs)}
- Problems, all of springs: the shipped heads of the paper's size (jaw forward, jaw opened), and for each
  seed a synthetic head with 477 to 800 skin vertices, 2 to 4 layers, and a random spring law, stiffnesses,
  move of the jaw and, in some, turgor and weight; volume term penalty, none or paper, or the force
  functional.
- Runs: {", ".join(SOLVERS)} to {", ".join(ACCURACIES)} mm, and runs to {HARD} mm that are interrupted:
  {stops} (of the time to {TIMED} mm).
  A load step that reaches its iteration limit is halved five times before the run ends.
- The true error is the largest distance of a point from the rest position at the end of the load path,
  solved to {KNOWN:g} mm. A run that ends before the last load is compared with the rest position at its own
  load. A run whose error is above its estimate is compared with the rest position near it, found by Newton's
  method to {KNOWN:g} mm: if this is more than {SAME:g} mm from the load path's, the run is counted as at
  another rest position.
- The estimate relies on a quadratic model of the objective. It can be too low only where that model is
  poor: far from rest, or where the energy is hardly convex.
- No minimum yet: the state has negative curvature, and the estimate is infinite. It does not count as
  within 10 times.
{listed(runs, study.left_out)}{weak_place(weak)}"""


def arguments():
    parser = option_parser(__doc__, PROJECT / "docs/measurements/estimate.md", seeds=8)
    parser.add_argument("-few", action="store_true")
    parser.add_argument("-rows", type=pathlib.Path)
    parser.add_argument("-picture", type=pathlib.Path,
                        default=PROJECT / "docs/images/estimate.png")
    return parser.parse_args()


def cpu_seconds():
    """CPU time of this process and of those it waited for."""
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in spent)


def write_rows(runs, file):
    with open(file, "w", newline="") as out:
        table = csv.DictWriter(out, [field.name for field in dataclasses.fields(Run)])
        table.writeheader()
        table.writerows(dataclasses.asdict(run) for run in runs)


def main():
    chosen = arguments()
    with tempfile.TemporaryDirectory() as folder:
        study = Study(chosen, pathlib.Path(folder))
        runs, weak = list(study.runs()), list(study.weak_runs())
    if chosen.rows:
        write_rows(runs + weak, chosen.rows)
    if matplotlib:
        draw(runs, chosen.picture)
    else:
        print("no picture: apt-get install --no-install-recommends python3-matplotlib")
    write(chosen.output, page(runs, weak, study, cpu_seconds(), chosen.picture))
    print(verdict(runs) + f"wrote {chosen.output}")


if __name__ == "__main__":
    main()
