#!/usr/bin/env python3
"""Breaks the program on purpose, one break at a time, in a worktree of its own, and says which test
catches it. A break that no test catches has survived, and wants a test.

    tests/mutations/mutate.py -scratch ../scratch                 # all
    tests/mutations/mutate.py -scratch ../scratch -breaks 'sign'  # those whose names match
    tests/mutations/mutate.py -scratch ../scratch -named          # by the tests they name alone
    tests/mutations/mutate.py -check                  # only that each break has its place

The worktree is of the last commit; it is made if it is not there, and stays. After each break only
what it touches is built again, and the tests end at the first that fails: unit tests that the list
names, then programs that it names, then wider ones. Exit status 1 where a break survived or has no
place.
"""

import argparse
import functools
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True
from breaks import BREAKS  # noqa: E402

PROJECT = pathlib.Path(__file__).resolve().parents[2]
TIME_LIMIT = 1200  # seconds, of one test: a search that does not end is caught, too
# A break may well leave a name unused, and warnings are errors.
UNUSED = "".join(
    f'#pragma GCC diagnostic ignored "-Wunused-{kind}"\n'
    for kind in ("variable", "but-set-variable", "parameter", "function")
)
# Where the tests that a break names pass.
WIDER = (
    r"^(base|scene|mechanics|solve|results|adapt)\.|^model\.(build|cut|motion|stiffness)"
    r"|^program\.(minimum|solid|extremes)$"
)


@functools.lru_cache
def sources(project):
    patterns = [f"{folder}.{ending}" for folder in ("src/**/*", "include/**/*", "drivers/*")
                for ending in ("h", "cpp")]
    return {path: path.read_text() for pattern in patterns for path in project.glob(pattern)}


def place_of(old, project):
    """The one source that has these words, or why there is none."""
    found = [path for path, text in sources(project).items() for _ in range(text.count(old))]
    return found[0] if len(found) == 1 else f"{len(found)} places"


def run(*command, cwd, **more):
    return subprocess.run(
        list(map(str, command)),
        cwd=cwd,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        **more,
    )


def make_scratch(folder):
    if not folder.exists():
        run("git", "worktree", "add", "--detach", folder, "HEAD", cwd=PROJECT, check=True)
        run("cmake", "--preset", "ci", cwd=folder, check=True)
    head = run("git", "rev-parse", "HEAD", cwd=PROJECT, check=True).stdout.strip()
    run("git", "checkout", "-f", "--detach", head, cwd=folder, check=True)


def tests_of(pattern, build):
    text = run("ctest", "-N", "-R", pattern, cwd=build).stdout
    return [name for name in re.findall(r"Test +#\d+: (\S+)", text) if "_ranks" not in name]


def stages(pattern, build, named):
    """Tests in the order of what they cost."""
    tests = tests_of(pattern, build)
    slow = [test for test in tests if test.startswith(("program.", "extremes."))]
    return [
        [test for test in tests if test not in slow],
        slow,
        [] if named else [test for test in tests_of(WIDER, build) if test not in tests],
    ]


def targets_of(tests):
    """Targets to build for tests: test_ROOM, and the programs for those that run programs."""
    rooms = {test.split(".")[0] for test in tests}
    programs = ["repose-solve", "repose-check", "repose-compare", "repose-osteotomy"]
    return sorted(f"test_{room}" for room in rooms - {"program", "extremes"}) + (
        programs if rooms & {"program", "extremes"} else []
    )


def caught_by(build, tests, jobs):
    """The first test that fails, or why there is none."""
    built = run("cmake", "--build", ".", "-j", jobs, "--target", *targets_of(tests), cwd=build)
    if built.returncode != 0:
        return "", "does not compile: " + next(
            (line for line in built.stdout.splitlines() if " error: " in line), ""
        )
    exactly = "^(" + "|".join(map(re.escape, tests)) + ")$"
    options = ["--stop-on-failure", "--timeout", TIME_LIMIT]
    tested = run("ctest", "-R", exactly, *options, cwd=build)
    failed = re.findall(r"^\s*\d+ - (\S+) \((\w+)\)", tested.stdout, re.M)
    words = [name + (" does not converge" if how == "Timeout" else "") for name, how in failed]
    return ", ".join(words), f"passes {', '.join(tests)}"


def one(old, new, pattern, scratch, arguments):
    path = place_of(old, scratch)
    if isinstance(path, str):
        return "NO PLACE", path
    text = path.read_text()
    try:
        path.write_text(UNUSED + text.replace(old, new))
        reasons = []
        for tests in stages(pattern, scratch / "build-ci", arguments.named):
            if not tests:
                continue
            caught, why = caught_by(scratch / "build-ci", tests, arguments.jobs)
            if caught:
                return "caught", caught
            reasons.append(why)
    finally:
        path.write_text(text)
    return "SURVIVED", "; ".join(reasons) or f"no test matches {pattern}"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-check", action="store_true")
    parser.add_argument("-named", action="store_true")
    parser.add_argument("-scratch", type=lambda name: pathlib.Path(name).resolve())
    parser.add_argument("-breaks", default="")
    parser.add_argument("-jobs", default="2")
    arguments = parser.parse_args()
    if not arguments.check and not arguments.scratch:
        parser.error("give -scratch FOLDER or -check")
    if not arguments.check:
        make_scratch(arguments.scratch)
    faults = 0
    print("| break | where | outcome | by |\n|---|---|---|---|")
    for name, old, new, pattern in BREAKS:
        if not re.search(arguments.breaks, name):
            continue
        path = place_of(old, PROJECT)
        where = path if isinstance(path, str) else path.relative_to(PROJECT)
        if arguments.check:
            outcome, by = ("has its place", "") if where != path else ("NO PLACE", path)
        else:
            outcome, by = one(old, new, pattern, arguments.scratch, arguments)
        faults += outcome not in ("caught", "has its place")
        print(f"| {name} | {where} | {outcome} | {by} |", flush=True)
    print(f"\n{faults} breaks not caught")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
