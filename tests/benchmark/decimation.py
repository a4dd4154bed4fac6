#!/usr/bin/env python3
"""Decimates one mesh at several distances, by Repose, by CGAL to the same count and within its
envelope, and by VTK to the same count; measures all with one measure; writes a Markdown table.

    tests/benchmark/decimation.py MESH OUT.md [BIN] [DISTANCE …]

BIN is the folder of the built programs (default build/bin; cmake … -DREPOSE_BENCHMARKS=ON). VTK is
left out, in words, where Python has none."""

import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time

from measure import run
from page import write

DISTANCES = ["0.1", "0.25", "0.5", "1", "2"]
CPU_LIMIT = 60  # seconds of one way at one distance
VTK = """
import sys
from vtkmodules.vtkFiltersCore import vtkQuadricDecimation
from vtkmodules.vtkIOPLY import vtkPLYReader, vtkPLYWriter
reader = vtkPLYReader()
reader.SetFileName(sys.argv[1])
reader.Update()
decimation = vtkQuadricDecimation()
decimation.SetInputConnection(reader.GetOutputPort())
decimation.SetTargetReduction(1 - int(sys.argv[3]) / reader.GetOutput().GetNumberOfPolys())
writer = vtkPLYWriter()
writer.SetFileName(sys.argv[2])
writer.SetInputConnection(decimation.GetOutputPort())
writer.Write()
"""
HEAD = ("| bound | by | triangles | to the input | proven | CGAL's figure | from the input | CPU s "
        "| defects |\n|--:|:--|--:|--:|--:|--:|--:|--:|:--|\n")


def limit_cpu():
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT, CPU_LIMIT))


class Comparison:
    def __init__(self, mesh, programs, folder):
        self.mesh, self.programs, self.folder = mesh, programs, folder
        self.cgal = programs / "benchmark_decimation"
        self.rows = []

    def measured(self, file):
        text = subprocess.check_output([self.cgal, "measure", self.mesh, file], text=True)
        return text.rstrip("\n").split("\t")

    def enter(self, distance, name, command, file):
        """Runs one way and adds its row; the number of triangles it left."""
        done = run(command, ends=None, preexec_fn=limit_cpu)
        if done.status != 0:
            why = f"status {done.status}"
            if -done.status in (signal.SIGXCPU, signal.SIGKILL):
                why = f"stopped after {CPU_LIMIT} s"
            self.rows.append(f"| {distance} | {name} | {why} | | | | | | |\n")
            return 0
        proven = re.search(r"bound proven +(\S+)|$", done.text)[1] or ""
        triangles, reached, _, cgal, back, defects = self.measured(file)
        self.rows.append(f"| {distance} | {name} | {triangles} | {float(reached):.4f} | "
                         f"{proven} | {float(cgal):.4f} | {float(back):.3g} | {done.seconds:.1f} | {defects} |\n")
        print(self.rows[-1], end="", flush=True)
        return int(triangles)

    def run(self, distance):
        out = {way: self.folder / f"{way}_{distance}.ply" for way in
               ("repose", "envelope", "lindstrom_turk", "garland_heckbert", "vtk")}
        count = self.enter(distance, "**Repose**", [
            self.programs / "repose-decimate", self.mesh, "-distance", distance,
            "-output", out["repose"]], out["repose"])
        self.enter(distance, "CGAL, envelope", [
            self.cgal, "envelope", self.mesh, out["envelope"], distance], out["envelope"])
        for way, name in (("lindstrom_turk", "CGAL, Lindstrom–Turk"),
                          ("garland_heckbert", "CGAL, Garland–Heckbert")):
            self.enter(distance, name, [self.cgal, way, self.mesh, out[way], count], out[way])
        if has_vtk():
            self.enter(distance, "VTK, quadric", [
                "/usr/bin/python3", "-c", VTK, self.mesh, out["vtk"], count], out["vtk"])


def has_vtk():
    return subprocess.run(["/usr/bin/python3", "-c", "import vtkmodules.vtkFiltersCore"],
                          stderr=subprocess.DEVNULL).returncode == 0


def main():
    mesh, page = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    programs = pathlib.Path(sys.argv[3] if len(sys.argv) > 3 else "build/bin").resolve()
    start = time.time()
    with tempfile.TemporaryDirectory() as folder:
        comparison = Comparison(mesh, programs, pathlib.Path(folder))
        for distance in sys.argv[4:] or DISTANCES:
            comparison.run(distance)
    note = "" if has_vtk() else "\nVTK was not there to compare with.\n"
    write(page, HEAD + "".join(comparison.rows) + note)
    print(f"{page} written after {time.time() - start:.0f} s")


if __name__ == "__main__":
    main()
