"""The neo-Hookean solid in numpy and scipy, from the formulas alone: it judges the programs and
shares nothing with them. Per prism of reference volume V, with F the deformation gradient of the
wedge's shape functions N_i, J its determinant averaged over the prism, mu and kappa in N/mm²:

    W = mu/2 (|F|² - 3) - mu (J - 1) + kappa/2 (J - 1)²

summed as ½ Σ w_ij |x_i - x_j|² + Σ ½ kappa (v - t)²/V - Σ (3/2 mu V + ½ mu² V/kappa), with
w_ij = -Σ mu ∫ ∇N_i·∇N_j dV and t = V (1 + mu/kappa). Rows of arrays are points, edges or prisms."""

import itertools

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

PAIRS = np.array(list(itertools.combinations(range(6), 2)))  # of a prism's points, [15, 2]
TRIANGLE = np.array([[1, 1], [4, 1], [1, 4]]) / 6
LINE = np.array([-1, 1]) / np.sqrt(3)
WEIGHT = 1 / 6  # of each of the 3 × 2 Gauss points


def slopes_at(r, s, z):
    """Derivatives of the six shape functions by (r, s, z), [6, 3]; a's at z = -1, b's at 1."""
    area, by_area = np.array([1 - r - s, r, s]), np.array([[-1, -1], [1, 0], [0, 1]])
    low, high = (1 - z) / 2, (1 + z) / 2
    return np.vstack([np.column_stack([by_area * low, -area / 2]),
                      np.column_stack([by_area * high, area / 2])])


SLOPES = np.array([slopes_at(r, s, z) for z in LINE for r, s in TRIANGLE])  # [6 Gauss points, 6, 3]


def volume_tensor():
    """A, antisymmetric [6, 6, 6], with v = Σ A_ijk det(x_i, x_j, x_k): the integral of det ∂x/∂ξ, a
    polynomial that the Gauss points integrate exactly."""
    plain = WEIGHT * np.einsum("qi,qj,qk->ijk", *np.moveaxis(SLOPES, 2, 0))
    even, odd = [(0, 1, 2), (1, 2, 0), (2, 0, 1)], [(1, 0, 2), (0, 2, 1), (2, 1, 0)]
    return (sum(plain.transpose(p) for p in even) - sum(plain.transpose(p) for p in odd)) / 6


VOLUME = volume_tensor()
BY_PAIR = np.array([6 * VOLUME[:, j, k] for j, k in PAIRS]).T  # ∂v/∂x_i = Σ BY_PAIR x_j × x_k


def moduli(young, poisson):
    """mu and kappa (N/mm²) that make small strains Hooke's."""
    mu = young / (2 * (1 + poisson))
    return mu, young * poisson / ((1 + poisson) * (1 - 2 * poisson)) + mu


def centered(x, prisms):
    """The prisms' points from their middles, [M, 6, 3]."""
    corners = x[prisms]
    return corners - corners.mean(1, keepdims=True)


def volumes(x, prisms):
    """Volumes [M] and their gradients [M, 6, 3]."""
    corners = np.ascontiguousarray(centered(x, prisms).transpose(1, 2, 0))  # [6, 3, M]
    one, other = corners[PAIRS[:, 0]], corners[PAIRS[:, 1]]
    crosses = np.stack([one[:, d] * other[:, e] - one[:, e] * other[:, d]
                        for d, e in ((1, 2), (2, 0), (0, 1))], axis=1)
    gradient = (BY_PAIR @ crosses.reshape(len(PAIRS), -1)).reshape(corners.shape)
    return (gradient * corners).sum((0, 1)) / 3, gradient.transpose(2, 0, 1)


def jacobians(x, prisms):
    """∂x_d/∂ξ_e at the Gauss points, [M, 6, 3, 3]."""
    return np.einsum("qie,mid->mqde", SLOPES, centered(x, prisms))


def wedge_laplacians(x, prisms):
    """∫ ∇N_i·∇N_j dV of each prism, mm, [M, 6, 6]; a ValueError where a map is degenerate."""
    maps = jacobians(x, prisms)
    det = np.linalg.det(maps)
    if det.size and det.min() <= 0:
        raise ValueError(f"prism {det.min(1).argmin()}: det ∂X/∂ξ = {det.min():.3g} mm³")
    slopes = SLOPES @ np.linalg.inv(maps)
    return np.einsum("mq,mqid,mqjd->mij", WEIGHT * det, slopes, slopes)


def edges_of(laplacians, prisms, mu):
    """Edges [E, 2], sorted, and their weights w_ij (N/mm)."""
    ends = np.sort(prisms[:, PAIRS], axis=2).reshape(-1, 2)
    weights = -(mu[:, None] * laplacians[:, PAIRS[:, 0], PAIRS[:, 1]]).ravel()
    edges, row = np.unique(ends, axis=0, return_inverse=True)
    return edges, np.bincount(row.ravel(), weights, len(edges))


def with_material(model, young, poisson):
    """A model (as tissue.model_of gives it) of springs or none, with the datasets of a solid of
    these moduli (numbers or one a prism), and without springs."""
    x, prisms = model["point/position"], model["prism/points"]
    mu, kappa = (np.broadcast_to(value, len(prisms)).astype(float)
                 for value in moduli(np.asarray(young), np.asarray(poisson)))
    edges, weights = edges_of(wedge_laplacians(x, prisms), prisms, mu)
    volume = volumes(x, prisms)[0]
    kept = {name: value for name, value in model.items() if not name.startswith("spring")}
    return kept | {"edge/points": edges, "edge/weight": weights, "prism/rest_volume": volume,
                   "prism/modulus": kappa, "prism/shear_modulus": mu,
                   "prism/target_volume": volume * (1 + mu / kappa)}


class Solid:
    """Energy of a model with edges and prisms' moduli. Positions are [N, 3], mm."""

    def __init__(self, model):
        self.model = model
        self.rest, self.prisms = model["point/position"], model["prism/points"]
        self.soft = np.flatnonzero(model["point/set"] == 0)
        self.kappa, self.mu = model["prism/modulus"], model["prism/shear_modulus"]
        self.target, self.volume = model["prism/target_volume"], model["prism/rest_volume"]
        self.averaged = model.get("prism/nodal_modulus", np.zeros(len(self.prisms)))
        self.own = self.kappa - self.averaged
        self.laplacian = self.laplacian_of(model["edge/points"], model["edge/weight"])
        self.at_rest = ((1.5 + self.mu / (2 * self.kappa)) * self.mu * self.volume).sum()
        count = len(self.rest)
        # one row a point: what adds up the prisms' corners
        self.gather = sparse.csr_matrix(
            (np.ones(self.prisms.size), (self.prisms.ravel(), np.arange(self.prisms.size))),
            (count, self.prisms.size))
        # a sixth of each prism to each of its points, and what a point's volume yields to pressure
        self.share = sparse.csr_matrix(
            (np.full(self.prisms.size, 1 / 6),
             (self.prisms.ravel(), np.repeat(np.arange(len(self.prisms)), 6))),
            (count, len(self.prisms)))
        with np.errstate(divide="ignore"):
            self.stiffness = np.where(self.averaged.any(),
                                      1 / (self.share @ (self.volume / self.averaged)), 0)

    def laplacian_of(self, edges, weights):
        count = len(self.rest)
        off = sparse.coo_matrix((weights, edges.T), (count, count))
        off = (off + off.T).tocsr()
        return sparse.diags(np.asarray(off.sum(1)).ravel()) - off

    def excess(self, x):
        """The energy's slope by the volume of each prism, kappa (v - t)/V or of averaged volumes,
        N/mm², with v and ∂v/∂x."""
        v, slopes = volumes(x, self.prisms)
        by_prism = (self.own * (v - self.volume)
                    - self.kappa * (self.target - self.volume)) / self.volume
        return by_prism + self.share.T @ self.pressure(v), v, slopes

    def pressure(self, v):
        """Pressure of the averaged volumes at each point, N/mm²."""
        return self.stiffness * (self.share @ (v - self.volume))

    def value_and_gradient(self, x):
        """Energy, N mm, of all prisms and edges, and its gradient at all points, N, [N, 3]."""
        from_rest = x - self.rest.mean(0)
        pulls = self.laplacian @ from_rest
        push, v, slopes = self.excess(x)
        change, shift = v - self.volume, self.target - self.volume
        energy = (self.own * change**2 / 2 - self.kappa * shift * change
                  + self.kappa * shift**2 / 2) / self.volume
        energy = energy.sum() + (self.pressure(v) * (self.share @ change)).sum() / 2
        value = (from_rest * pulls).sum() / 2 + energy - self.at_rest
        return value, pulls + self.gather @ (push[:, None, None] * slopes).reshape(-1, 3)

    def value(self, x):
        return self.value_and_gradient(x)[0]

    def hessian(self, x, curved=True):
        """Exact Hessian by all points' coordinates, sparse [3N, 3N]; without the volumes' second
        derivatives (curved = False) it is positive semidefinite."""
        push, _, slopes = self.excess(x)
        flat = slopes.reshape(-1, 18)
        blocks = (self.own / self.volume)[:, None, None] * flat[:, :, None] * flat[:, None, :]
        if curved:
            blocks += self.curvature(x, push)
        rows = (3 * self.prisms[:, :, None] + np.arange(3)).reshape(-1, 18).astype(np.int32)
        at = [np.broadcast_to(rows[:, :, None], blocks.shape).ravel(),
              np.broadcast_to(rows[:, None, :], blocks.shape).ravel()]
        size = self.rest.size
        volume = sparse.coo_matrix((blocks.ravel(), at), (size, size)).tocsr()
        if self.averaged.any():
            change = sparse.csr_matrix((flat.ravel(), (np.repeat(np.arange(len(flat)), 18),
                                                       rows.ravel())), (len(flat), size))
            change = self.share @ change
            volume += change.T @ sparse.diags(self.stiffness) @ change
        return (volume + sparse.kron(self.laplacian, sparse.identity(3))).tocsr()

    def curvature(self, x, push):
        """push ∂²v/∂x², [M, 18, 18]: ∂²v/∂x_i∂x_j = -6 Σ A_ijk [x_k]×."""
        along = 6 * np.einsum("m,ijk,mkd->mijd", push, VOLUME, centered(x, self.prisms))
        crossed = np.zeros(along.shape + (3,))  # -[along]×
        for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            crossed[..., a, b] = along[..., c]
            crossed[..., b, a] = -along[..., c]
        return crossed.transpose(0, 1, 3, 2, 4).reshape(-1, 18, 18)


def factorized(matrix):
    """A solver of a symmetric sparse matrix."""
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=1e-3,
                options={"SymmetricMode": True}).solve


def rest_position(solid, fixed_at=None, tolerance=1e-9, loads=4, force=None, factorize=factorized,
                  message=None):
    """Positions [N, 3] where the energy is least with the fixed points at `fixed_at` [N, 3] (their
    targets if None) and dead forces [N, 3] on the soft ones. The fixed points go there on straight
    lines in `loads` equal parts; each begins with the linear prediction and is followed by Newton's
    method, the last until a whole step moves no point by more than `tolerance` mm. A step that does
    not lead down is made with the positive part of the Hessian, and halved until it does. `message`
    gets one line an iteration."""
    x, soft = solid.rest.copy(), solid.soft
    unknown = (3 * soft[:, None] + np.arange(3)).ravel()
    goal = (solid.model["point/target"] if fixed_at is None else fixed_at) - x
    goal[soft] = 0
    force = np.zeros_like(x) if force is None else force
    for part in range(loads):
        motion, push = goal / loads, force * (part + 1) / loads
        hessian = solid.hessian(x)
        slope = (solid.value_and_gradient(x)[1] - push).ravel() + hessian @ motion.ravel()
        x += motion
        x[soft] -= factorize(hessian[unknown][:, unknown])(slope[unknown]).reshape(-1, 3)
        enough = tolerance if part == loads - 1 else 0.1
        for iteration in range(100):
            x, length = newton_step(solid, x, unknown, push, factorize)
            if message:
                message(f"{part}.{iteration}: step {length:.3g} mm, {solid.value(x):.12g} N mm")
            if length <= enough:
                break
        else:
            raise ArithmeticError("no rest position within 100 steps")
    return x


def newton_step(solid, x, unknown, push, factorize):
    """The next positions and the whole step's largest length, mm."""
    value, gradient = solid.value_and_gradient(x)
    value -= (push * x).sum()
    slope = (gradient - push).ravel()[unknown]
    for curved in (True, False):
        hessian = solid.hessian(x, curved)[unknown][:, unknown]
        step = -factorize(hessian)(slope)
        if step @ slope < 0 and step @ (hessian @ step) > 0:
            break
    length = np.linalg.norm(step.reshape(-1, 3), axis=1).max()
    part, noise = 1.0, 1e-12 * abs(solid.at_rest)
    while True:
        there = x.copy()
        there[solid.soft] += part * step.reshape(-1, 3)
        reached = solid.value(there) - (push * there).sum()
        if reached <= value + 1e-4 * part * (step @ slope) + noise or part < 1e-6:
            return there, length
        part /= 2
