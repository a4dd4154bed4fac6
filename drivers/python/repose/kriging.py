"""Kriging with derivatives: a Gaussian process with a Matérn 5/2 covariance on a quadratic trend, given by
values and gradients at samples in [-1, 1]^d. One covariance serves many outputs. Needs NumPy and SciPy."""

import itertools

import numpy as np
import scipy.linalg

TREND_VARIANCE = 1e3  # of a trend's coefficients, beside 1 of the process
FOLDS = 10
SPREAD_NUGGET = 1e-3
REACH = 2.0  # length of the covariance by which `spread` measures how far samples are


def trend_terms(dimensions):
    """Exponents of the trend's monomials as tuples of the coordinates that are multiplied."""
    return [(), *((k,) for k in range(dimensions)),
            *itertools.combinations_with_replacement(range(dimensions), 2)]


def trend(u):
    """[N, T] values of the monomials and [N, d, T] their derivatives."""
    count, dimensions = u.shape
    terms = trend_terms(dimensions)
    value, slope = np.ones((count, len(terms))), np.zeros((count, dimensions, len(terms)))
    for t, term in enumerate(terms):
        for place, k in enumerate(term):
            value[:, t] *= u[:, k]
            others = term[:place] + term[place + 1:]
            slope[:, k, t] += np.prod(u[:, others], axis=1) if others else 1
    return value, slope


def covariance(u, v, length, slopes_u=True):
    """Covariance of values, then slopes, at u with values, then slopes, at v:
    [N (1 + d), M (1 + d)], or [N, M (1 + d)] without the slopes at u."""
    (n, d), m = u.shape, len(v)
    z = (u[:, None] - v[None]) / length
    r = np.sqrt(5 * (z**2).sum(axis=2))
    decay = np.exp(-r)
    first = 5 / 3 * (1 + r) * decay
    value_value = (1 + r + r**2 / 3) * decay
    value_slope = (first[..., None] * z / length).reshape(n, m * d)
    top = np.hstack([value_value, value_slope])
    if not slopes_u:
        return top
    slope_value = (-first[..., None] * z / length).transpose(0, 2, 1).reshape(n * d, m)
    outer = -25 / 3 * decay[..., None, None] * z[..., :, None] * z[..., None, :]
    outer[..., range(d), range(d)] += first[..., None]
    outer /= length[:, None] * length
    return np.vstack([top, np.hstack([slope_value, outer.transpose(0, 2, 1, 3).reshape(n * d, m * d)])])


class Kriging:
    """`values` [N, M] and `slopes` [N, d, M] at u [N, d]; slopes that are NaN are left out."""

    def __init__(self, u, values, slopes, length=None, nugget=None):
        self.u = np.asarray(u, float)
        count, dimensions = self.u.shape
        slope_rows = slopes.reshape(count * dimensions, -1)
        self.used = np.flatnonzero(np.concatenate(
            [np.ones(count, bool), np.isfinite(slope_rows).all(axis=1)]))
        self.data = np.vstack([values, slope_rows])[self.used]
        self.sample = np.concatenate([np.arange(count), np.repeat(np.arange(count), dimensions)])[self.used]
        self.fold = self.sample % min(FOLDS, count)
        value, slope = trend(self.u)
        self.trend = np.vstack([value, slope.reshape(count * dimensions, -1)])[self.used]
        if length is None:
            length, nugget = self._choose()
        self.length, self.nugget = np.asarray(length, float), nugget
        inverse = self._inverse(self.length, nugget)
        self.weights = inverse @ self.data                          # of the covariances, [n, M]
        self.trend_weights = TREND_VARIANCE * self.trend.T @ self.weights
        self.errors = self._errors(inverse, self.weights)           # [N, M], cross-validated
        self._measure_distance()

    def _inverse(self, length, nugget):
        """Inverse of the covariance of the data, the trend's included."""
        matrix = covariance(self.u, self.u, length)[np.ix_(self.used, self.used)]
        scale = np.diag(matrix).copy()
        matrix += TREND_VARIANCE * self.trend @ self.trend.T
        matrix[np.diag_indices_from(matrix)] += nugget * scale
        factor = scipy.linalg.cho_factor(matrix, lower=True, overwrite_a=True, check_finite=False)
        return scipy.linalg.cho_solve(factor, np.eye(len(scale)), overwrite_b=True, check_finite=False)

    def _errors(self, inverse, weights):
        """Errors of the values where the samples of each fold are predicted by the others."""
        errors = np.empty((len(self.u), weights.shape[1]))
        for fold in range(self.fold.max() + 1):
            rows = np.flatnonzero(self.fold == fold)
            error = np.linalg.solve(inverse[np.ix_(rows, rows)], weights[rows])
            values = rows < len(self.u)
            errors[self.sample[rows[values]]] = error[values]
        return errors

    def _criterion(self, length, nugget):
        """Mean distance of the values from their cross-validated predictions."""
        try:
            inverse = self._inverse(length, nugget)
            errors = self._errors(inverse, inverse @ self.data)
        except np.linalg.LinAlgError:
            return np.inf
        return np.linalg.norm(errors, axis=1).mean()

    def _choose(self):
        """Lengths and nugget of the smallest cross-validated errors: one length for all coordinates,
        then each coordinate's own once."""
        best = np.inf, None, None
        for size, nugget in itertools.product((0.7, 1.2, 2.0, 3.5, 6.0, 12.0), (1e-7, 1e-5, 1e-3)):
            length = np.full(self.u.shape[1], size)
            best = min(best, (self._criterion(length, nugget), length, nugget), key=lambda one: one[0])
        for k in range(self.u.shape[1]):
            for factor in (0.6, 1.7):
                length = best[1].copy()
                length[k] *= factor
                best = min(best, (self._criterion(length, best[2]), length, best[2]),
                           key=lambda one: one[0])
        return best[1:]

    def predict(self, u):
        """[K, M] values at u [K, d]."""
        u = np.atleast_2d(np.asarray(u, float))
        cross = covariance(u, self.u, self.length, slopes_u=False)[:, self.used]
        return cross @ self.weights + trend(u)[0] @ self.trend_weights

    def _measure_distance(self):
        """Precision of the samples' values, by which `spread` measures how far a plan is from them."""
        matrix = values_covariance(self.u, self.u)
        matrix[np.diag_indices_from(matrix)] += SPREAD_NUGGET
        self.precision = np.linalg.inv(matrix)
        self.held_out_spread = np.empty(len(self.u))
        fold = np.arange(len(self.u)) % min(FOLDS, len(self.u))
        for one in range(fold.max() + 1):
            rows = np.flatnonzero(fold == one)
            block = np.linalg.inv(self.precision[np.ix_(rows, rows)])
            self.held_out_spread[rows] = np.sqrt(np.diag(block))

    def spread(self, u):
        """[K] standard deviation at u, given values at the samples, of a process of unit variance."""
        cross = values_covariance(np.atleast_2d(np.asarray(u, float)), self.u)
        known = np.einsum("ki,ij,kj->k", cross, self.precision, cross)
        return np.sqrt(np.maximum(1 + SPREAD_NUGGET - known, SPREAD_NUGGET))


def values_covariance(u, v):
    """[N, M] covariance of values alone, of length REACH."""
    return covariance(u, v, REACH, slopes_u=False)[:, :len(v)]
