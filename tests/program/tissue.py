"""Result files read with h5py, and the model of docs/theory/model.md in numpy, which shares nothing with
the programs."""

import re

import h5py
import numpy as np


def steps(file):
    """The steps of a result, in order: attributes and arrays of each in one dictionary."""
    with h5py.File(file) as h5:
        return [dict(h5["step"][name].attrs) | read(h5["step"][name])
                for name in sorted(h5["step"])]


def read(group):
    """All datasets below a group by their path in it."""
    found = {}
    group.visititems(lambda name, item: found.update({name: item[()]})
                     if isinstance(item, h5py.Dataset) else None)
    return found


def last(file):
    return steps(file)[-1]


def model_of(file):
    with h5py.File(file) as h5:
        return read(h5["model"]) | dict(h5["model"].attrs)


def skin(file):
    """Vertices of the skin at the start, and their displacements in the last step."""
    model, step = model_of(file), last(file)
    on_skin = model["point/layer"] == 0
    return model["point/position"][on_skin], step["point/displacement"][on_skin]


def write_model(file, model):
    """A model file of a model as model_of gives it."""
    with h5py.File(file, "w") as h5:
        h5.attrs.update(format=np.bytes_("tissue-model"), version=1)
        for name, values in model.items():
            if name == "gravity":
                h5.require_group("model").attrs[name] = values
            else:
                h5[f"model/{name}"] = values
    return file


def as_springs(scene):
    """The text of a scene of a solid, with the paper's springs for its tissue."""
    text, found = re.subn(
        "^  material: .*$", "  springs: {default: {stiffness: 1.0, law: quartic, reference: 1.0}}",
        scene, flags=re.MULTILINE)
    assert found == 1
    return text + "solve: {volume: {form: penalty, poisson: 0.4967}}\n"


def apart(one, other):
    """Largest distance of a point between two steps, mm."""
    return np.linalg.norm(one["point/position"] - other["point/position"], axis=1).max()


def same_face(file, other, within):
    """Two results end in one rest position: positions to `within` mm, objective to 12 digits."""
    one, two = last(file), last(other)
    assert one["load"] == two["load"] == 1
    assert apart(one, two) <= within
    assert abs(one["objective"] / two["objective"] - 1) < 1e-12


def sums(rows, values, count):
    """The sums [count, 3] of values [..., 3] by row."""
    return np.stack([np.bincount(rows.ravel(), values[..., axis].ravel(), count)
                     for axis in range(3)], axis=1)


def prism_volumes(x, prisms):
    """Volumes [M] and their gradients [M, 6, 3]."""
    a0, a1, a2, b0, b1, b2 = (x[prisms[:, corner]] for corner in range(6))
    u, v, p, q = a1 - a0, a2 - a0, b1 - b0, b2 - b0
    through = b0 - a0 + b1 - a1 + b2 - a2  # 3 D
    area = np.cross(u, 2 * v + q) + np.cross(p, v + 2 * q)
    from_u, from_v = np.cross(2 * v + q, through), np.cross(through, 2 * u + p)
    from_p, from_q = np.cross(v + 2 * q, through), np.cross(through, u + 2 * p)
    gradient = [-from_u - from_v - area, from_u - area, from_v - area,
                -from_p - from_q + area, from_p + area, from_q + area]
    return (through * area).sum(1) / 36, np.stack(gradient, axis=1) / 36


class Tissue:
    """Objective and gradient of a model, with volume term none, paper (weight = lambda) or penalty
    (weight = kappa)."""

    def __init__(self, model, volume, weight):
        self.model, self.volume, self.weight = model, volume, weight
        self.soft = model["point/set"] == 0
        self.spring = self.soft[model["spring/points"]].any(1)
        self.prism = self.soft[model["prism/points"]].any(1)
        self.load = (model["point/mass"][:, None] * model["gravity"]
                     + model["point/external_force"])

    def springs(self, x):
        """Energy and tension of each spring, and its unit direction."""
        m = self.model
        p, q = m["spring/points"].T
        d = x[q] - x[p]
        r = np.linalg.norm(d, axis=1)
        s = r - m["spring/rest_length"]
        k, t, power = m["spring/stiffness"], (s / m["spring/reference"])**2, m["spring/exponent"]
        energy = k * s**2 / 2 * np.choose(power, [1 + 0 * t, 1 + t / 2, 1 + t + t**2 / 3])
        return energy, k * s * (1 + t)**power, d / np.where(r > 0, r, 1)[:, None]

    def value_and_gradient(self, x):
        """Objective, and its gradient [N, 3] with zero rows where a point is no unknown."""
        m, used = self.model, self.spring
        energy, tension, unit = self.springs(x)
        pull = (tension[:, None] * unit)[used]
        elastic = sums(m["spring/points"][used], np.stack([-pull, pull], axis=1), len(x)) - self.load
        value = energy[used].sum()
        value -= (self.load * (x - m["point/position"]))[self.soft].sum()
        value, gradient = self.with_volume(x, value, elastic)
        gradient[~self.soft] = 0
        return value, gradient

    def with_volume(self, x, value, gradient):
        if self.volume == "none":
            return value, gradient
        corners, v0 = self.model["prism/points"][self.prism], self.model["prism/rest_volume"]
        v0 = v0[self.prism]
        v, slopes = prism_volumes(x, corners)
        if self.volume == "penalty":
            value += (self.weight / 2 * (v - v0)**2 / v0).sum()
            push = self.weight * (v - v0) / v0
        else:
            value = self.weight * value + (1 - self.weight) * ((v - v0)**2).sum()
            gradient = self.weight * gradient
            push = 2 * (1 - self.weight) * (v - v0)
        return value, gradient + sums(corners, push[:, None, None] * slopes, len(x))
