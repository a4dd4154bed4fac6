"""Energy of a model file with its gradient and Hessian, in NumPy, from docs/theory and docs/reference
alone: springs with a volume term, or the neo-Hookean solid. Positions are [N, 3] in mm, energies in N mm."""

import h5py
import numpy as np


def read(group):
    """All datasets and attributes below an HDF5 group by their path in it."""
    found = dict(group.attrs)

    def visit(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = item[()]
        else:
            found.update({f"{name}@{key}": value for key, value in item.attrs.items()})

    group.visititems(visit)
    return found


def read_result(file):
    """The model of a result, and its last step."""
    with h5py.File(file) as h5:
        return read(h5["model"]), read(h5["step"][sorted(h5["step"])[-1]])


def volume_of(x):
    """Volumes of wedges [..., 6, 3]: the formula of docs/theory/model.md."""
    a0, a1, a2, b0, b1, b2 = np.moveaxis(x, -2, 0)
    A1, A2, B1, B2 = a1 - a0, a2 - a0, b1 - b0, b2 - b0
    area = 2 * np.cross(A1, A2) + np.cross(A1, B2) + np.cross(B1, A2) + 2 * np.cross(B1, B2)
    return ((b0 - a0 + b1 - a1 + b2 - a2) / 3 * area).sum(-1) / 12


def polarized_volume():
    """The symmetric tensor T [18, 18, 18] with v(x) = T(x, x, x)/6, a cubic form, by polarization."""
    unit = np.eye(18).reshape(18, 6, 3)
    one = volume_of(unit)
    two = volume_of(unit[:, None] + unit)
    three = volume_of(unit[:, None, None] + unit[:, None] + unit)
    return (three - two[:, :, None] - two[:, None] - two[None]
            + one[:, None, None] + one[:, None] + one)


WEDGE = polarized_volume()


def wedges(x, prisms):
    """Volumes [M], gradients [M, 18] and Hessians [M, 18, 18]."""
    corners = x[prisms]
    corners = (corners - corners.mean(1, keepdims=True)).reshape(-1, 18)
    hessian = np.tensordot(corners, WEDGE, 1)
    gradient = np.einsum("mij,mj->mi", hessian, corners) / 2
    return (gradient * corners).sum(1) / 3, gradient, hessian


def rows_of(points):
    """Rows of unknowns of points: [..., k] to [..., 3 k]."""
    return (3 * points[..., None] + np.arange(3)).reshape(*points.shape[:-1], -1)


class Energy:
    """Objective that a step minimizes. `soft` are the unknown points, `free` their unknowns."""

    def __init__(self, model, step):
        self.model, self.start = model, model["point/position"]
        self.soft = model["point/set"] == 0
        self.free = rows_of(np.flatnonzero(self.soft)[:, None]).ravel()
        self.count = 3 * len(self.start)
        self.load = np.where(self.soft[:, None], model["point/mass"][:, None] * model["gravity"]
                             + model["point/external_force"], 0)
        self.solid = "edge/points" in model
        self.prisms = model.get("prism/points", np.zeros((0, 6), int))
        self.rest = model.get("prism/rest_volume", np.zeros(0))
        self.used = self.soft[self.prisms].any(1)
        if self.solid:
            self.set_solid()
        else:
            self.set_springs(step)
        self.rows = rows_of(self.prisms)
        self.gather_volumes()
        self.set_supports()

    def set_supports(self):
        """Elastic supports: points, initial places, stiffnesses and bones."""
        numbers, self.supported = np.zeros((0, 5)), np.zeros(0, int)
        for name, term in self.model.items():
            if name.endswith("@term") and term == b"elastic_support":
                group = name.removesuffix("@term")
                self.supported = self.model[f"{group}/points"]
                numbers = self.model[f"{group}/numbers"].reshape(-1, 5)
        self.support_start, self.support = numbers[:, :3], numbers[:, 3]
        self.support_bone = numbers[:, 4].astype(int)
        self.place_supports([(np.eye(3), np.zeros(3))] * (1 + self.support_bone.max(initial=-1)))

    def place_supports(self, motions):
        """Carries the supports' places with bones, of each its rotation and translation."""
        self.places = np.array([motions[bone][0] @ at + motions[bone][1] for at, bone in
                                zip(self.support_start, self.support_bone)]).reshape(-1, 3)

    def set_solid(self):
        """Prisms: ½ own (v − V)²/V + slope (v − V); points: ½ e²/C of averaged volumes."""
        model = self.model
        self.elastic = 1.0
        averaged = model.get("prism/nodal_modulus", np.zeros(len(self.rest)))
        kappa, target = model["prism/modulus"], model["prism/target_volume"]
        self.quadratic = (kappa - averaged) / self.rest
        self.linear = -kappa * (target - self.rest) / self.rest
        self.averaged = averaged

    def set_springs(self, step):
        """`elastic` multiplies the springs' energy and the potential, as λ of the volume form paper does."""
        form, weight = step["volume"].decode(), float(step["lambda"])
        self.elastic = weight if form == "paper" else 1.0
        self.linear = np.zeros(len(self.rest))
        self.averaged = np.zeros(len(self.rest))
        self.quadratic = {
            "none": lambda: np.zeros(len(self.rest)),
            "paper": lambda: np.full(len(self.rest), 2 * (1 - weight)),
            "penalty": lambda: step["bulk_modulus"] / self.rest,
        }[form]() * self.used
        points = self.model["spring/points"]
        self.spring = self.soft[points].any(1)

    def gather_volumes(self):
        """share [N, M]: a sixth of each prism to its points; yields: 1/C."""
        self.share = None
        if not self.averaged.any():
            return
        self.share = np.zeros((len(self.start), len(self.rest)))
        for corner in range(6):
            np.add.at(self.share, (self.prisms[:, corner], np.arange(len(self.rest))), 1 / 6)
        compliance = self.share @ (self.rest / self.averaged)
        self.stiffness = np.divide(1, compliance, where=compliance > 0, out=np.zeros_like(compliance))

    def pull(self, x):
        """Springs: energy, first and second derivative by elongation, direction, length."""
        m = self.model
        p, q = m["spring/points"][self.spring].T
        d = x[q] - x[p]
        r = np.sqrt((d * d).sum(1))
        k, s = m["spring/stiffness"][self.spring], r - m["spring/rest_length"][self.spring]
        z = (s / m["spring/reference"][self.spring]) ** 2
        n = m["spring/exponent"][self.spring].astype(int)
        energy = k * s * s / 2 * np.choose(n, [1 + 0 * z, 1 + z / 2, 1 + z + z * z / 3])
        tension = k * s * np.choose(n, [1 + 0 * z, 1 + z, (1 + z) ** 2])
        slope = k * np.choose(n, [1 + 0 * z, 1 + 3 * z, (1 + z) * (1 + 5 * z)])
        return energy, tension, slope, d / np.maximum(r, 1e-300)[:, None], r, p, q

    def parts(self, x):
        """The numbers f_e, potential and volume energy as a result states them."""
        potential = -(self.load * (x - self.start)).sum()
        if self.solid:
            stretch = (self.support * ((x[self.supported] - self.places) ** 2).sum(1)).sum() / 2
            return self.solid_energy(x) - self.solid_energy(self.start) + stretch, potential, 0.0
        v = wedges(x, self.prisms)[0]
        return self.pull(x)[0].sum(), potential, (self.quadratic * (v - self.rest) ** 2).sum() / 2

    def solid_energy(self, x):
        p, q = self.model["edge/points"].T
        change = wedges(x, self.prisms)[0] - self.rest
        value = (self.model["edge/weight"] * ((x[p] - x[q]) ** 2).sum(1)).sum() / 2
        value += (self.quadratic * change**2 / 2 + self.linear * change).sum()
        if self.share is not None:
            value += (self.stiffness * (self.share @ change) ** 2).sum() / 2
        return value

    def value(self, x):
        """The objective."""
        elastic, potential, volume = self.parts(x)
        return self.elastic * (elastic + potential) + volume

    def gradient(self, x):
        """[N, 3], of fixed points too."""
        gradient = -self.elastic * self.load
        if self.solid:
            p, q = self.model["edge/points"].T
            force = self.model["edge/weight"][:, None] * (x[q] - x[p])
        else:
            _, tension, _, unit, _, p, q = self.pull(x)
            force = self.elastic * tension[:, None] * unit
        np.add.at(gradient, p, -force)
        np.add.at(gradient, q, force)
        np.add.at(gradient, self.supported, self.support[:, None] * (x[self.supported] - self.places))
        v, slopes, _ = wedges(x, self.prisms)
        np.add.at(gradient, self.prisms, (self.pressure(v)[:, None] * slopes).reshape(-1, 6, 3))
        return gradient

    def pressure(self, v):
        """Derivative of the energy by the volume of each prism."""
        slope = self.quadratic * (v - self.rest) + self.linear
        if self.share is not None:
            slope += self.share.T @ (self.stiffness * (self.share @ (v - self.rest)))
        return slope

    def hessian(self, x):
        """[3 N, 3 N]."""
        hessian = np.zeros((self.count, self.count))
        self.add_edges(hessian, x)
        rows = 3 * self.supported[:, None] + np.arange(3)
        np.add.at(hessian, (rows, rows), self.support[:, None])
        v, slopes, bends = wedges(x, self.prisms)
        blocks = self.pressure(v)[:, None, None] * bends
        blocks += self.quadratic[:, None, None] * slopes[:, :, None] * slopes[:, None]
        np.add.at(hessian, (self.rows[:, :, None], self.rows[:, None]), blocks)
        if self.share is not None:
            change = np.zeros((len(v), self.count))
            np.add.at(change, (np.arange(len(v))[:, None], self.rows), slopes)
            change = self.share @ change
            hessian += change.T @ (self.stiffness[:, None] * change)
        return hessian

    def add_edges(self, hessian, x):
        if self.solid:
            p, q = self.model["edge/points"].T
            blocks = self.model["edge/weight"][:, None, None] * np.eye(3)
        else:
            _, tension, slope, unit, r, p, q = self.pull(x)
            along = unit[:, :, None] * unit[:, None]
            stress = (tension / np.maximum(r, 1e-300))[:, None, None]
            blocks = self.elastic * (slope[:, None, None] * along + stress * (np.eye(3) - along))
        one, other = rows_of(p[:, None]), rows_of(q[:, None])
        for a, b, sign in ((one, one, 1), (other, other, 1), (one, other, -1), (other, one, -1)):
            np.add.at(hessian, (a[:, :, None], b[:, None]), sign * blocks)
