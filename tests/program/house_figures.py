#!/usr/bin/env python3
"""Figures of the house: lines (of them comments, and blank) and public headers of each room,
functions beyond a screen, functions with many parameters, data members of classes, and, with the
programs' folder, the frames between main and TaoSolve.

    tests/program/house_figures.py [build/bin] [-tree FOLDER]

-tree: of another tree of the project, an older one for example (git worktree add FOLDER COMMIT).
"""

import argparse
import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import test_house
from conftest import PROJECT
from test_house import LONGEST, USUAL, classes, functions, room_of, sources

PARAMETERS = 5
# A TaoSolve that tells how many frames of the program's own are above it.
COUNTER = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <execinfo.h>
#include <stdio.h>
#include <string.h>
int TaoSolve(void *tao) {
  void *frame[256];
  int own = 0, n = backtrace(frame, 256);
  Dl_info here, me;
  dladdr((void *)TaoSolve, &me);
  for (int i = 0; i < n; ++i)
    own += dladdr(frame[i], &here) && strstr(here.dli_fname, "repose-solve");
  fprintf(stderr, "FRAMES %d\n", own);
  return ((int (*)(void *))dlsym(RTLD_NEXT, "TaoSolve"))(tao);
}
"""


def parameters(text):
    """(first line, number of parameters) of each function that is declared or defined."""
    text = re.sub(r"//.*", "", text)
    found = []
    for match in re.finditer(r"^ {0,4}[\w:<>,&*\[\] ]*?[\w>&*] ?\b(?:\w+::)*~?\w+\(", text, re.M):
        depth, commas, inside = 1, 0, ""
        for char in text[match.end():]:
            depth += {"(": 1, "<": 1, "{": 1, "[": 1, ")": -1, ">": -1, "}": -1, "]": -1}.get(char, 0)
            if depth == 0:
                break
            commas += depth == 1 and char == ","
            inside += char
        head = match.group(0).strip()
        if inside.strip() and not re.match(r"(return|else|if|for|while|throw|case)\b", head):
            found.append((text.count("\n", 0, match.start()) + 1, commas + 1))
    return found


def declares(text, line):
    """Returns whether the statement at `line` has typed parameters, not arguments."""
    head = " ".join(text.splitlines()[line - 1:line + 6]).split("{")[0].split(";")[0]
    return bool(re.search(r"\w[&*>]* \w+[,)=]", head))


def frames(programs):
    """Frames of the program between main and TaoSolve, both left out."""
    with tempfile.TemporaryDirectory() as folder:
        source, library = os.path.join(folder, "count.c"), os.path.join(folder, "count.so")
        with open(source, "w", encoding="utf-8") as file:
            file.write(COUNTER)
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
        solve = os.path.join(os.path.abspath(programs), "repose-solve")
        run = subprocess.run([solve, str(PROJECT / "meshes/head_solid.yaml"), "-output", "frames"],
                             cwd=folder, env=os.environ | {"LD_PRELOAD": library}, text=True,
                             stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False)
    return max(int(n) for n in re.findall(r"FRAMES (\d+)", run.stderr)) - 2  # main, _start


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="?")
    parser.add_argument("-tree", type=pathlib.Path, default=PROJECT)
    chosen = parser.parse_args()
    test_house.PROJECT = chosen.tree
    lines, comments, blank = (collections.Counter() for _ in range(3))
    headers = collections.Counter()
    lengths, many, members = [], [], []
    for name, text in sources():
        public = name.startswith("include/")
        room = room_of(name)
        lines[room] += text.count("\n")
        comments[room] += len(re.findall(r"^ *//", text, re.M))
        blank[room] += len(re.findall(r"^$", text, re.M)) - text.endswith("\n")
        headers[room] += public
        lengths += [length for _, length in functions(text)]
        members += [number for _, number in classes(text)]
        many += [f"{name}:{line}" for line, n in parameters(text)
                 if n > PARAMETERS and declares(text, line)]
    print("| room | lines | comments | blank | public headers |\n|---|--:|--:|--:|--:|")
    counts = (lines, comments, blank, headers)
    for room in sorted(lines):
        print(f"| `{room}` | {' | '.join(str(count[room]) for count in counts)} |")
    print(f"| all | {' | '.join(str(count.total()) for count in counts)} |\n")
    print(f"{len(lengths)} functions: {sum(n > USUAL for n in lengths)} above {USUAL} lines, "
          f"{sum(n > LONGEST for n in lengths)} above {LONGEST}; "
          f"{len(many)} with more than {PARAMETERS} parameters.")
    print(f"{len(members)} classes, of at most {max(members)} data members.")
    if chosen.programs:
        print(f"Frames between main and TaoSolve: {frames(chosen.programs)}.")


if __name__ == "__main__":
    main()
