"""ReposeLive, a scripted module of 3D Slicer beside the panel Repose: the predicted skin follows bones as
their transforms are moved (docs/guide/slicer.md). Nothing is compiled or installed into Slicer; the
solver is the program repose-live."""

import os
import pathlib
import sys

import numpy as np
import qt
import slicer
import vtk
from slicer.ScriptedLoadableModule import ScriptedLoadableModule, ScriptedLoadableModuleWidget

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "python"))
import repose  # noqa: E402
from repose.follow import Follower  # noqa: E402
from repose.motion import matrix_of  # noqa: E402

TO_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])  # of LPS, and back
SKIN = "Predicted skin"


class SlicerView:
    """The nodes of a session in Slicer's scene: a model of the skin, of each bone, and a transform of
    each piece. All calls of MRML are here."""

    def __init__(self, session, status):
        self.initial, self.status, self.follower = session.initial, status, None
        self.skin = self.model(SKIN, session.initial, session.triangles, (0.89, 0.7, 0.61), 0.7)
        self.transforms, self.observers, self.nodes = {}, [], [self.skin]
        pieces = {piece.name: piece for piece in session.pieces}
        for name, (points, triangles) in session.bones.items():
            bone = self.model(name, points, triangles, (0.95, 0.91, 0.81), 1.0)
            self.nodes.append(bone)
            if name in pieces:
                self.transforms[name] = self.transform(pieces[name], bone)

    def model(self, name, points, triangles, color, opacity):
        """A model node, in RAS."""
        from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
        places, cells, mesh = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
        places.SetData(numpy_to_vtk(np.ascontiguousarray(points * TO_RAS.diagonal()[:3]), deep=True))
        corners = np.column_stack([np.full(len(triangles), 3), triangles]).astype(np.int64)
        cells.SetCells(len(triangles), numpy_to_vtkIdTypeArray(corners.ravel(), deep=True))
        mesh.SetPoints(places)
        mesh.SetPolys(cells)
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", name)
        node.SetAndObservePolyData(mesh)
        node.CreateDefaultDisplayNodes()
        node.GetDisplayNode().SetColor(*color)
        node.GetDisplayNode().SetOpacity(opacity)
        return node

    def transform(self, piece, bone):
        """A transform with handles, at the scene's own plan; the bone goes with it."""
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode", f"Move {piece.name}")
        self.nodes.append(node)
        motion = {"translate": piece.translate, "rotate": piece.rotate}
        slicer.util.updateTransformMatrixFromArray(
            node, TO_RAS @ matrix_of(motion, piece.centroid) @ TO_RAS)
        if hasattr(node, "SetCenterOfTransformation"):
            node.SetCenterOfTransformation(*(piece.centroid * TO_RAS.diagonal()[:3]))
        node.CreateDefaultDisplayNodes()
        node.GetDisplayNode().SetEditorVisibility(True)
        bone.SetAndObserveTransformNodeID(node.GetID())
        event = slicer.vtkMRMLTransformNode.TransformModifiedEvent
        self.observers.append((node, node.AddObserver(event, self.modified)))
        return node

    def modified(self, *_):
        if self.follower:
            self.follower.changed()

    def matrices(self):
        return {name: TO_RAS @ slicer.util.arrayFromTransformMatrix(node, toWorld=True) @ TO_RAS
                for name, node in self.transforms.items()}

    def show(self, position, text):
        slicer.util.arrayFromModelPoints(self.skin)[:] = position * TO_RAS.diagonal()[:3]
        slicer.util.arrayFromModelPointsModified(self.skin)
        moved = np.linalg.norm(position - self.initial, axis=1).max()
        self.status(f"{text}; the skin moves by up to {moved:.1f} mm")

    def tell(self, text):
        self.status(text)

    def later(self, seconds, work):
        qt.QTimer.singleShot(int(1000 * seconds), work)

    def close(self):
        """The predicted skin and the transforms stay in the scene."""
        for node, tag in self.observers:
            node.RemoveObserver(tag)
        self.observers = []


def start(scene, status):
    """Starts repose-live for a scene file and shows its nodes; returns the follower."""
    session = repose.Session(scene, environment=slicer.util.startupEnvironment())
    view = SlicerView(session, status)
    view.follower = Follower(session, view)
    return view.follower


class ReposeLive(ScriptedLoadableModule):
    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = "Repose Live"
        parent.categories = ["Surgery"]
        parent.dependencies = []
        parent.contributors = ["the authors of Repose"]
        parent.helpText = ("Choose a scene file with a plan and press Start. Move the bones by the handles "
                           "of their transforms; the predicted skin follows. For planning and teaching.")


class ReposeLiveWidget(ScriptedLoadableModuleWidget):
    follower = None

    def setup(self):
        ScriptedLoadableModuleWidget.setup(self)
        self.path = qt.QLineEdit()
        self.path.placeholderText = "scene file (.yaml) with a plan"
        browse, self.button = qt.QPushButton("Choose scene"), qt.QPushButton("Start")
        self.status = qt.QLabel("")
        self.status.wordWrap = True
        for widget in (self.path, browse, self.button, self.status):
            self.layout.addWidget(widget)
        self.layout.addStretch(1)
        browse.clicked.connect(self.choose)
        self.button.clicked.connect(self.toggle)
        self.closing = slicer.mrmlScene.AddObserver(slicer.vtkMRMLScene.StartCloseEvent, self.stop)

    def choose(self, *_):
        chosen = qt.QFileDialog.getOpenFileName(None, "Scene", self.path.text, "Scenes (*.yaml)")
        if chosen:
            self.path.text = chosen

    def toggle(self, *_):
        if self.follower:
            return self.stop()
        self.tell("building the model …")
        slicer.app.processEvents()
        try:
            self.follower = start(os.path.expanduser(self.path.text), self.tell)
        except (ValueError, OSError) as reason:
            return self.tell(str(reason))
        self.button.text = "Stop"

    def tell(self, text):
        self.status.text = text

    def stop(self, *_):
        if self.follower:
            self.follower.view.close()
            self.follower.close()
            self.follower = None
            self.button.text = "Start"

    def cleanup(self):
        self.stop()
        slicer.mrmlScene.RemoveObserver(self.closing)
