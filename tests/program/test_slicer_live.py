"""The module ReposeLive of 3D Slicer, with stand-ins for Slicer's modules: what of it needs no Slicer. Not
tested here: that Slicer loads the file, draws the nodes and runs the timers."""

import importlib.util
import os
import sys
import time
import types
from unittest.mock import MagicMock

import numpy as np
import pytest
from conftest import PROJECT, programs, shipped

sys.path.insert(0, str(PROJECT / "drivers/python"))
from repose.motion import matrix_of, motion_of  # noqa: E402

RAS = np.array([-1, -1, 1])


class Node:
    """A node of the stand-in's scene."""

    def __init__(self, kind, name):
        self.kind, self.name, self.observers, self.matrix, self.display = kind, name, {}, np.eye(4), MagicMock()
        self.points = self.parent = None

    def AddObserver(self, event, work):
        self.observers[len(self.observers)] = event, work
        return len(self.observers) - 1

    def RemoveObserver(self, tag):
        del self.observers[tag]

    def SetAndObservePolyData(self, mesh):
        self.points = mesh.points

    def CreateDefaultDisplayNodes(self):
        pass

    def GetDisplayNode(self):
        return self.display

    def GetID(self):
        return self.name

    def SetAndObserveTransformNodeID(self, name):
        self.parent = name


class Slicer:
    """Stand-ins for slicer, vtk and qt, and the clock of the timers."""

    def __init__(self, environment):
        self.nodes, self.timers = {}, []
        self.slicer = types.ModuleType("slicer")
        self.slicer.mrmlScene = types.SimpleNamespace(
            AddNewNodeByClass=self.add, AddObserver=lambda *_: 0, RemoveObserver=lambda *_: None)
        self.slicer.vtkMRMLTransformNode = types.SimpleNamespace(TransformModifiedEvent="modified")
        self.slicer.vtkMRMLScene = types.SimpleNamespace(StartCloseEvent="closing")
        self.slicer.app = types.SimpleNamespace(processEvents=lambda: None)
        self.slicer.util = types.SimpleNamespace(
            updateTransformMatrixFromArray=self.move, startupEnvironment=lambda: environment,
            arrayFromTransformMatrix=lambda node, toWorld: node.matrix.copy(),
            arrayFromModelPoints=lambda node: node.points, arrayFromModelPointsModified=lambda node: None)
        self.qt = types.ModuleType("qt")
        self.qt.QTimer = types.SimpleNamespace(singleShot=lambda time, work: self.timers.append(work))
        for name in ("QLineEdit", "QPushButton", "QLabel", "QFileDialog"):
            setattr(self.qt, name, MagicMock())

    def add(self, kind, name):
        self.nodes[name] = Node(kind, name)
        return self.nodes[name]

    def move(self, node, matrix):
        node.matrix = np.array(matrix)
        for event, work in list(node.observers.values()):
            assert event == "modified"
            work(node, event)

    def modules(self):
        widgets = types.ModuleType("slicer.ScriptedLoadableModule")
        widgets.ScriptedLoadableModule = type("Module", (), {"__init__": lambda self, parent: None})
        widgets.ScriptedLoadableModuleWidget = type("Widget", (), {"layout": MagicMock(),
                                                                   "setup": lambda self: None})
        vtk, support = types.ModuleType("vtk"), types.ModuleType("vtk.util.numpy_support")
        vtk.vtkPoints = lambda: type("Points", (), {
            "SetData": lambda self, data: setattr(self, "data", data)})()
        vtk.vtkCellArray = lambda: type("Cells", (), {"SetCells": lambda self, count, data: None})()
        vtk.vtkPolyData = lambda: type("Mesh", (), {
            "SetPoints": lambda self, places: setattr(self, "points", places.data),
            "SetPolys": lambda self, cells: None})()
        support.numpy_to_vtk = lambda values, deep: values.copy()
        support.numpy_to_vtkIdTypeArray = lambda values, deep: values
        return {"slicer": self.slicer, "slicer.ScriptedLoadableModule": widgets, "vtk": vtk, "qt": self.qt,
                "vtk.util": types.ModuleType("vtk.util"), "vtk.util.numpy_support": support}

    def run_until(self, done, seconds=60):
        """Runs timers until a condition holds."""
        end = time.monotonic() + seconds
        while not done():
            assert time.monotonic() < end, "nothing came"
            due, self.timers = self.timers, []
            for work in due:
                work()
            time.sleep(0.01)


@pytest.fixture
def started(environment, monkeypatch, tmp_path):
    """(stand-in, widget of the module, status lines) after Start."""
    surroundings = {**os.environ, **environment}
    stand_in = Slicer(surroundings)
    for name, module in stand_in.modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setenv("REPOSE_BUILD", str(programs().parent))
    file = PROJECT / "drivers/slicer/ReposeLive.py"
    specification = importlib.util.spec_from_file_location("ReposeLive", file)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    widget, lines = module.ReposeLiveWidget(), []
    widget.setup()
    widget.tell = lines.append
    (tmp_path / "coarse.yaml").write_text(shipped("head_live.yaml", layers=3, edge=8))
    widget.path = types.SimpleNamespace(text=str(tmp_path / "coarse.yaml"))
    widget.toggle()
    yield stand_in, widget, lines
    widget.stop()


def test_the_skin_follows_the_transform_of_a_bone(started):
    stand_in, widget, lines = started
    follower = widget.follower
    assert set(stand_in.nodes) == {"Predicted skin", "skull", "maxilla", "mandible", "chin", "Move maxilla",
                                   "Move mandible", "Move chin"}, lines
    assert stand_in.nodes["chin"].parent == "Move chin" and stand_in.nodes["skull"].parent is None
    stand_in.run_until(lambda: follower.reference is not None)
    assert lines[-1].startswith("exact to 0.0")
    skin, chin = stand_in.nodes["Predicted skin"], stand_in.nodes["Move chin"]
    first, matrix = skin.points.copy(), chin.matrix.copy()
    matrix[1, 3] += 1  # RAS: forward
    stand_in.move(chin, matrix)
    assert lines[-1].startswith("preview")
    preview = skin.points.copy()
    assert (preview - first)[:, 1].max() > 0.5, "forward in RAS"
    count = len(lines)
    stand_in.run_until(lambda: any(line.startswith("exact") for line in lines[count:]))
    exact = follower.session.solve(follower.plan)
    assert follower.plan["chin"]["translate"] == pytest.approx([0, -5, 0])
    assert np.abs(skin.points - exact.position * RAS).max() < 1e-4
    assert 0 < np.abs(skin.points - preview).max() < 0.5


def test_what_cannot_be_followed_is_said_in_a_line(started):
    stand_in, widget, lines = started
    follower, chin = widget.follower, stand_in.nodes["Move chin"]
    stand_in.run_until(lambda: follower.reference is not None)
    far = np.eye(4)
    far[1, 3] = 30
    stand_in.move(chin, far)
    assert lines[-1].startswith("chin: translate -30.0 mm is outside the plan's box (±8)")
    stand_in.move(chin, np.diag([2.0, 1, 1, 1]))
    assert "scales, shears or mirrors" in lines[-1]
    nowhere = np.eye(4)
    nowhere[0, 3] = np.nan
    stand_in.move(chin, nowhere)
    assert "not finite" in lines[-1]
    process = follower.session._process
    process.kill()
    process.wait()
    stand_in.move(chin, np.eye(4))
    stand_in.run_until(lambda: "has ended" in lines[-1])
    widget.stop()
    assert widget.follower is None and not chin.observers
    stand_in.move(chin, far)  # nothing follows any more


def test_a_failure_of_any_kind_is_said_in_a_line(started):
    stand_in, widget, lines = started
    stand_in.run_until(lambda: widget.follower.reference is not None)
    widget.follower.session.solve = lambda plan, tangents: {}["error"]
    stand_in.move(stand_in.nodes["Move chin"], np.eye(4))
    stand_in.run_until(lambda: lines[-1] == "'error'", 5)


@pytest.mark.long
def test_an_answer_of_an_earlier_plan_is_not_shown_after_a_refusal(started):
    stand_in, widget, lines = started
    stand_in.run_until(lambda: widget.follower.reference is not None)
    chin = stand_in.nodes["Move chin"]
    home, near, far = (chin.matrix.copy() for _ in range(3))
    near[1, 3] += 1  # RAS: forward
    far[1, 3] += 30
    stand_in.move(chin, near)
    stand_in.move(chin, far)
    end = time.monotonic() + 3
    stand_in.run_until(lambda: time.monotonic() > end)
    assert "is outside the plan's box" in lines[-1], lines
    stand_in.move(chin, home)
    stand_in.run_until(lambda: lines[-1].startswith("exact"))


def test_a_scene_without_a_plan_is_refused(started):
    _, widget, lines = started
    widget.stop()
    widget.path.text = str(PROJECT / "meshes/head_genioplasty.yaml")
    widget.toggle()
    assert widget.follower is None and "the scene has no plan" in lines[-1]


def test_a_file_that_is_no_text_is_refused(started, monkeypatch, tmp_path):
    _, widget, lines = started
    widget.stop()
    (tmp_path / "scan.yaml").write_bytes(b"\0\1")
    monkeypatch.setenv("HOME", str(tmp_path))
    widget.path.text = "~/scan.yaml"
    widget.toggle()
    assert widget.follower is None and lines[-1].startswith(f"{tmp_path}/scan.yaml: not a text file"), lines


@pytest.mark.quick
def test_motions_and_matrices_are_inverse():
    centroid = np.array([3.0, -40, 7])
    for rotate in ([0, 0, 0], [1e-9, 0, 0], [10, -20, 5], [0, 0, 160]):
        motion = {"translate": [1.0, -2, 3], "rotate": rotate}
        again = motion_of(matrix_of(motion, centroid), centroid)
        assert np.allclose(again["translate"], motion["translate"])
        assert np.allclose(again["rotate"], rotate, atol=1e-7)
    assert np.allclose((matrix_of({"rotate": [0, 0, 90]}, centroid) @ [*centroid, 1])[:3], centroid)
    assert np.allclose((matrix_of({"rotate": [0, 0, 90]}, np.zeros(3)) @ [1, 0, 0, 1])[:3], [0, 1, 0])
