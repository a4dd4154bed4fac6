"""A map of a box of plans: the skin of every plan from some solved ones, with a bound of its error."""

import dataclasses

import numpy as np

from .kriging import Kriging

SLOPE_SHARE = 0.5     # of derivatives beside displacements, in the choice of modes
COARSE = 0.01         # mm at most that the modes leave out of the samples, if there are enough modes
MOST_MODES = 60
COVERAGE = 0.95
LEAST_BOUNDED = 19    # values that have a 95 % quantile


@dataclasses.dataclass
class Modes:
    """Displacement of the skin = mean + coefficients · shapes."""
    mean: np.ndarray      # [N, 3] mm
    shapes: np.ndarray    # [M, N, 3], orthonormal


def find_modes(samples, most=MOST_MODES):
    """The principal modes of displacements and derivatives of the samples, by the method of snapshots."""
    displacement = np.stack([one.displacement for one in samples])
    mean = displacement.mean(axis=0)
    slopes = np.concatenate([one.slopes[np.isfinite(one.slopes).all(axis=(1, 2))] for one in samples])
    rows = np.concatenate([displacement - mean, SLOPE_SHARE * slopes]).reshape(-1, mean.size)
    value, vector = np.linalg.eigh(rows @ rows.T)
    kept = np.flatnonzero(value > 1e-12 * value[-1])[::-1][:most]
    shapes = (vector[:, kept] / np.sqrt(value[kept])).T @ rows
    left = (displacement - mean).reshape(len(samples), -1)
    for count, shape in enumerate(shapes, 1):
        left = left - np.outer(left @ shape, shape)
        if np.linalg.norm(left.reshape(len(samples), -1, 3), axis=2).max() < COARSE:
            break
    return Modes(mean, shapes[:count].reshape(count, *mean.shape))


class PlanMap:
    """The skin over a box of plans, fitted to the converged ones of the samples. `least_bound`, mm: the
    accuracy of the samples, below which no bound goes."""

    def __init__(self, box, samples, modes=MOST_MODES, least_bound=0):
        self.box, self.least_bound = box, least_bound
        self.failed = np.array([one.u for one in samples if not one.converged]).reshape(-1, len(box.half))
        solved = [one for one in samples if one.converged]
        if len(solved) < 3:
            raise ValueError(f"{len(solved)} of {len(samples)} plans converged; a map needs three")
        self.u = np.stack([one.u for one in solved])
        self.is_bounded = len(solved) >= LEAST_BOUNDED
        self.modes = find_modes(solved, modes)
        shapes = self.modes.shapes.reshape(len(self.modes.shapes), -1)
        offset = np.stack([one.displacement - self.modes.mean for one in solved]).reshape(len(solved), -1)
        coefficients = offset @ shapes.T
        slopes = np.stack([one.slopes.reshape(len(box.half), -1) @ shapes.T for one in solved])
        self.kriging = Kriging(self.u, coefficients, slopes)
        left_out = offset - coefficients @ shapes
        self.errors = np.linalg.norm((self.kriging.errors @ shapes + left_out)
                                     .reshape(len(solved), -1, 3), axis=2)
        self.bound_factor = bound_quantile(self.errors / self.kriging.held_out_spread[:, None])

    def displacement(self, plan):
        """[N, 3] mm at a plan."""
        return self.displacement_at(self.box.vector(plan))

    def displacement_at(self, u):
        return self.modes.mean + np.tensordot(self.kriging.predict(u)[0], self.modes.shapes, 1)

    def bound(self, plan):
        """[N] mm that the error of a point of the skin stays below, with 95 % of plans; where `is_bounded` is
        False, with less."""
        return self.bound_at(self.box.vector(plan))

    def bound_at(self, u):
        return np.maximum(self.bound_factor * self.kriging.spread(u)[0], self.least_bound)


def bound_quantile(scores):
    """The 95 % quantile of each column that also holds for one more row: conformal prediction. With
    fewer than LEAST_BOUNDED rows their largest."""
    count = len(scores)
    row = min(int(np.ceil(COVERAGE * (count + 1))), count) - 1
    return np.sort(scores, axis=0)[row]
