"""A result file as the planning sheet reads it: the skin to show, bones, and the steps' numbers."""

import math

import h5py
import numpy as np

from sheet.script import Unusable, reading
from sheet.shown_skin import matching_rows, opened, read_given, read_places, read_rows, solved_skin
from sheet.summary import cautions, parted


class Figure(str):
    """A number as it is to be shown."""


def three_digits(values):
    """The largest of them."""
    return Figure(f"{np.abs(values).max(initial=0):.3g}")


def text(value):
    return value.decode() if isinstance(value, bytes) else value


class Result:
    """Model, the steps' numbers, the solved and the shown skin, bones before and after."""

    def __init__(self, file):
        self.file = file
        with reading(file, "a result of repose-solve"), h5py.File(file) as h5:
            if "step" not in h5 or not len(h5["step"]):
                raise Unusable(f"{file}: holds no step; solve it with repose-solve first")
            if "model/skin/points" not in h5:
                raise Unusable(f"{file}: holds no skin to show")
            self.steps = [{name: text(value) for name, value in h5["step"][step].attrs.items()}
                          for step in sorted(h5["step"])]
            self.origin = {name: text(h5.attrs[name]) for name in
                           ("program", "command", "ranks", "libraries") if name in h5.attrs}
            self.end = self.steps[-1]
            last = h5["step"][sorted(h5["step"])[-1]]
            self.solved, used = solved_skin(h5)
            self.given = read_given(h5)
            self.skin = opened(self.given, self.solved) if self.given else self.solved
            self.read_tissue(h5["model"], last)
            self.read_bones(h5["model"], last)
            self.read_summary(h5)
            self.read_uncertainty(last, used)

    def read_tissue(self, model, step):
        self.counts = {f"{kind}s": len(model[f"{kind}/points"]) for kind in ("spring", "prism")
                       if kind in model}
        self.counts |= {"points": len(model["point/set"]),
                        "skin triangles": len(self.solved.corners),
                        "layers": int(model["point/layer"][:].max()) + 1}
        self.volume, self.ratio = model["prism/rest_volume"][:], step["prism/volume_ratio"][:]
        points = model["point/position"][:]
        self.places = points[read_rows(model, "prism/points", len(points))].mean(1) \
            if len(self.ratio) else np.zeros((0, 3))
        self.strain = {label: three_digits(step[name][:]) for label, name in (
            ("largest tension of a spring, N", "spring/tension"),
            ("largest von Mises stress, N/mm²", "prism/von_mises"),
            ("largest stretch", "prism/principal_stretch")) if name in step}
        if "point/contact_pressure" in step:
            pressure = np.nan_to_num(step["point/contact_pressure"][:])
            self.strain |= {"points of tissue in contact": int((pressure > 0).sum()),
                            "largest contact pressure, N/mm²": three_digits(pressure),
                            "deepest that anything passes what it touches, mm":
                            Figure(f"{step.attrs['penetration']:.2g}")}

    def read_bones(self, model, step):
        self.bone_names = names = [text(name) for name in model["bone"][:]] if "bone" in model else []
        surfaces = model.get("bone_surface", {})
        planned = read_transforms(model) if self.end["load"] < 1 else None
        self.bones, first = [], 0
        moved = read_places(step, "bone_surface/points") if "bone_surface/points" in step else None
        for b, name in enumerate(names):
            if str(b) not in surfaces or not len(surfaces[str(b)]["points"]):
                continue
            points = read_places(surfaces, f"{b}/points")
            faces = read_rows(surfaces, f"{b}/triangles", len(points))
            after = points if moved is None else moved[first:first + len(points)]
            first += len(points)
            goal = after if planned is None else points @ planned[b, :3, :3].T + planned[b, :3, 3]
            self.bones.append({"name": name, "corners": faces, "before": points, "after": after, "planned": goal,
                               "motion": rigid(points, after)})

    def read_summary(self, h5):
        """Warnings of the summary of repose-solve: [(name of the row, text before a place, place or None, text
        after it)]."""
        self.cautions = []
        for name, told in cautions(map(text, h5["summary"][()]) if "summary" in h5 else ()):
            before, place, after = parted(told)
            self.cautions.append((name, before, None if place is None else np.array(place), after))

    def turn(self, axes):
        """Takes all places to axes that are given as rows."""
        for skin in {self.solved, self.given, self.skin} - {None}:
            skin.turn(axes)
        self.places = self.places @ axes.T
        self.cautions = [(name, before, None if place is None else axes @ place, after)
                         for name, before, place, after in self.cautions]
        for bone in self.bones:
            bone.update({state: bone[state] @ axes.T for state in ("before", "after", "planned")})
            bone["motion"] = rigid(bone["before"], bone["after"])

    def read_uncertainty(self, step, used):
        """mm at each vertex of the shown skin: how far the face may be from the model's exact
        answer; None where mesh and layers were not estimated."""
        error = float(self.end["displacement_error"])
        self.uncertainty = None
        if "point/discretisation_error" in step and math.isfinite(error):
            values = error + step["point/discretisation_error"][:][used]
            near = matching_rows(self.solved, self.skin)
            self.uncertainty = np.where(self.skin.solved > 0, values[near], 0.0)


def read_transforms(model):
    """The whole planned motion [bones, 4, 4]; None where it is not stored."""
    if "bone_transform" not in model:
        return None
    found = model["bone_transform"][:]
    if not np.isfinite(found).all():
        raise ValueError("bone_transform holds numbers that are not finite")
    return found


def rigid(before, after):
    """The rigid motion (rotation matrix, translation) that takes points where they went."""
    middle, there = before.mean(0), after.mean(0)
    u, _, v = np.linalg.svd((before - middle).T @ (after - there))
    turn = v.T @ np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))]) @ u.T
    return turn, there - turn @ middle
