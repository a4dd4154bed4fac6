"""Springs with a volume term in numpy, with exact second derivatives, in any floating type: what
judges
the rows of springs. Like continuum.Solid in its interface, and sharing nothing with the programs.
"""

import numpy as np
from scipy import sparse

from continuum import PAIRS, VOLUME, centered, volumes


def law(elongation, stiffness, reference, power):
    """Energy, tension and its derivative of springs, docs/theory/model.md."""
    s2 = (elongation / reference) ** 2
    energy = (
        stiffness
        * elongation**2
        / 2
        * np.choose(power, [1 + 0 * s2, 1 + s2 / 2, 1 + s2 + s2**2 / 3])
    )
    tension = stiffness * elongation * (1 + s2) ** power
    slope = (
        stiffness
        * (1 + s2) ** power
        * np.choose(power, [1 + 0 * s2, (1 + 3 * s2) / (1 + s2), (1 + 5 * s2) / (1 + s2)])
    )
    return energy, tension, slope


class Network:
    """Energy of a model of springs with loads and a volume term Σ ½ w (v - v0)², `weight(v0)` → w
    of each prism (None: no such term).

    Positions are [N, 3], mm, of the type of `dtype`.
    """

    def __init__(self, model, weight=None, dtype=float):
        self.model, self.dtype = model, dtype
        self.rest = model["point/position"].astype(dtype)
        self.soft = np.flatnonzero(model["point/set"] == 0)
        self.ends = model["spring/points"]
        self.length, self.stiffness, self.reference = (
            model[f"spring/{name}"].astype(dtype)
            for name in ("rest_length", "stiffness", "reference")
        )
        self.power = model["spring/exponent"].astype(int)
        self.prisms = model["prism/points"] if weight else np.zeros((0, 6), int)
        self.volume = volumes(self.rest.astype(float), self.prisms)[0]
        self.weight = weight(self.volume) if weight else self.volume
        self.load = (
            model["point/mass"][:, None] * model["gravity"] + model["point/external_force"]
        ).astype(dtype)
        self.at_rest = 0.0

    def value_and_gradient(self, x):
        p, q = self.ends.T
        d = x[q] - x[p]
        r = np.sqrt((d**2).sum(1))
        energy, tension, _ = law(r - self.length, self.stiffness, self.reference, self.power)
        pull = (tension / np.where(r > 0, r, 1))[:, None] * d
        gradient = -self.load.copy()
        np.add.at(gradient, p, -pull)
        np.add.at(gradient, q, pull)
        value = energy.sum() - (self.load * (x - self.rest)).sum()
        if len(self.prisms):
            v, slopes = volumes(x, self.prisms)
            push = self.weight * (v - self.volume)
            value += (push * (v - self.volume)).sum() / 2
            np.add.at(gradient, self.prisms, push[:, None, None] * slopes)
        return value, gradient

    def value(self, x):
        return self.value_and_gradient(x)[0]

    def hessian(self, x, curved=True):
        """[3N, 3N], sparse of float and dense of other types; with curved = False a positive
        semidefinite one."""
        p, q = self.ends.T
        d = x[q] - x[p]
        r = np.sqrt((d**2).sum(1))
        _, tension, slope = law(r - self.length, self.stiffness, self.reference, self.power)
        across = np.where(r > 0, tension / np.where(r > 0, r, 1), slope)
        if not curved:
            across = np.maximum(across, 0)
        u = d / np.where(r > 0, r, 1)[:, None]
        along = u[:, :, None] * u[:, None, :]
        k = slope[:, None, None] * along + across[:, None, None] * (np.eye(3) - along)
        at = [(p, p, k), (q, q, k), (p, q, -k), (q, p, -k)]
        if len(self.prisms):
            volume = self.of_volume(x, curved)
            at += [
                (self.prisms[:, i], self.prisms[:, j], volume[:, i, j])
                for i in range(6)
                for j in range(6)
            ]
        return self.gathered(at)

    def gathered(self, at):
        """Sum of blocks [., 3, 3] at (rows, columns) of points."""
        size, three = 3 * len(self.rest), np.arange(3)
        rows = np.concatenate(
            [
                np.broadcast_to(3 * i[:, None, None] + three[:, None], k.shape).ravel()
                for i, _, k in at
            ]
        )
        columns = np.concatenate(
            [np.broadcast_to(3 * j[:, None, None] + three, k.shape).ravel() for _, j, k in at]
        )
        values = np.concatenate([k.ravel() for _, _, k in at])
        if self.dtype is float:
            return sparse.coo_matrix((values, (rows, columns)), (size, size)).tocsr()
        dense = np.zeros((size, size), self.dtype)
        np.add.at(dense, (rows, columns), values)
        return dense

    def of_volume(self, x, curved):
        """Second derivatives of the volume term, [M, 6, 6, 3, 3]."""
        v, slopes = volumes(x, self.prisms)
        k = self.weight[:, None, None, None, None] * np.einsum("mid,mje->mijde", slopes, slopes)
        if curved:
            along = 6 * np.einsum(
                "m,ijk,mkd->mijd", self.weight * (v - self.volume), VOLUME, centered(x, self.prisms)
            )
            for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                k[..., a, b] += along[..., c]
                k[..., b, a] -= along[..., c]
        return k


def factorized_dense(matrix):
    """A solver of a symmetric matrix of any floating type, by elimination without pivots after the
    scaling that makes its diagonal one."""
    matrix = np.array(matrix)
    scale = 1 / np.sqrt(np.maximum(np.abs(np.diagonal(matrix)), np.finfo(matrix.dtype).tiny))
    work = matrix * scale[:, None] * scale
    count = len(work)
    for i in range(count):
        if work[i, i] == 0:
            work[i, i] = np.finfo(matrix.dtype).eps
        work[i + 1 :, i] /= work[i, i]
        work[i + 1 :, i + 1 :] -= work[i + 1 :, i, None] * work[i, i + 1 :]

    def solve(right):
        y = right * scale
        for i in range(count):
            y[i + 1 :] -= work[i + 1 :, i] * y[i]
        for i in reversed(range(count)):
            y[i] = (y[i] - work[i, i + 1 :] @ y[i + 1 :]) / work[i, i]
        return y * scale

    return solve


def springs_of(points, prisms, stiffness, **more):
    """The datasets of the paper's springs on prisms: one for each of a prism's 15 pairs of
    points."""
    ends = np.unique(np.sort(prisms[:, PAIRS], axis=2).reshape(-1, 2), axis=0)
    return springs(points, ends, stiffness, **more)


def springs(points, ends, stiffness=1.0, power=2, reference=1.0, rest=None):
    """The datasets of springs between points; without tension unless rest lengths are given."""
    count = len(ends)
    length = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
    return {
        "spring/points": np.asarray(ends, "i8").reshape(count, 2),
        "spring/set": np.zeros(count, "i4"),
        "spring_set": np.array([b"all"]),
        "spring/rest_length": (
            length if rest is None else np.broadcast_to(rest, count).astype(float)
        ),
        "spring/stiffness": np.broadcast_to(stiffness, count).astype(float),
        "spring/exponent": np.broadcast_to(power, count).astype("i1"),
        "spring/reference": np.broadcast_to(reference, count).astype(float),
    }
