"""A constrained minimum in dense NumPy: penalties that grow, with Newton's method in a trust region,
then an active set with exact multipliers."""

import numpy as np
from scipy.linalg import (LinAlgError, cho_factor, cho_solve, eigvalsh, expm, logm, lu_factor,
                          lu_solve, null_space)
from scipy.optimize import nnls

from bodies import Touches
from energy import Energy
from walls import walls_of


class Problem:
    """Minimize the energy of `soft` points subject to gaps."""

    def __init__(self, model, step):
        self.energy = Energy(model, step)
        self.free, self.soft = self.energy.free, self.energy.soft
        self.touches, self.walls = Touches(model), walls_of(model)
        self.area = np.concatenate([self.touches.area, *(w.area for w in self.walls)])
        self.equal = np.zeros(len(self.area), bool)
        self.equal[:len(self.touches.equal)] = self.touches.equal
        self.number = len(self.area)
        self.stiffness = float(model.get("contact@stiffness", 1.0))  # N/mm³, what gaps compare by

    def look(self, x):
        """Gaps [C], and what their derivatives need."""
        gap, slope, bend = self.touches.gaps(x)
        feet = [wall.gaps(x) for wall in self.walls]
        return np.concatenate([gap, *(g for g, _ in feet)]), (slope, bend, [f for _, f in feet])

    def owner(self, c):
        """The wall of a constraint and its number there."""
        c -= len(self.touches.point)
        for k, wall in enumerate(self.walls):
            if c < len(wall.area):
                return k, c
            c -= len(wall.area)
        raise IndexError(c)

    def jacobian(self, rows, seen):
        """∂g by the unknowns of some constraints, [rows, free]."""
        jacobian = np.zeros((len(rows), self.energy.count))
        for k, c in enumerate(rows):
            if c < len(self.touches.point):
                p = self.touches.point[c]
                jacobian[k, 3 * p:3 * p + 3] = seen[0][c]
            else:
                wall, w = self.owner(c)
                jacobian[k] = self.walls[wall].gradient(w, seen[2][wall]).ravel()
        return jacobian[:, self.free]

    def bend(self, rows, forces, seen):
        """Σ force ∂²g by the unknowns, [free, free]."""
        bend = np.zeros((self.energy.count,) * 2)
        for c, force in zip(rows, forces):
            if c < len(self.touches.point):
                p = slice(3 * self.touches.point[c], 3 * self.touches.point[c] + 3)
                bend[p, p] += force * seen[1][c]
            else:
                wall, w = self.owner(c)
                points, block = self.walls[wall].hessian(w, seen[2][wall])
                own = (3 * points[:, None] + np.arange(3)).ravel()
                bend[np.ix_(own, own)] += force * block
        return bend[np.ix_(self.free, self.free)]

    def gradient(self, x):
        return self.energy.gradient(x).ravel()[self.free]

    def hessian(self, x):
        return self.energy.hessian(x)[np.ix_(self.free, self.free)]

    def derivative_error(self, x, width=1e-6):
        """Largest relative miss of derivatives against differences along a random direction."""
        x = self.moved(x, np.random.default_rng(1).uniform(-0.1, 0.1, len(self.free)))
        way = np.random.default_rng(0).normal(size=len(self.free))
        ahead, back = self.moved(x, width * way), self.moved(x, -width * way)
        rows = np.flatnonzero(np.abs(self.look(x)[0]) < 0.2) if self.number else np.zeros(0, int)
        force = np.ones(len(rows))

        def both(x):
            value, gradient = self.energy.value(x), self.gradient(x)
            if not len(rows):
                return value, gradient
            gap, seen = self.look(x)
            return (value + gap[rows].sum(), gradient + force @ self.jacobian(rows, seen))

        (above, up), (_, middle), (below, down) = both(ahead), both(x), both(back)
        bend = self.hessian(x)
        if len(rows):
            bend = bend + self.bend(rows, force, self.look(x)[1])
        change = bend @ way
        slope = np.abs(middle) @ np.abs(way)
        return max(abs((above - below) / (2 * width) - middle @ way) / slope,
                   np.abs((up - down) / (2 * width) - change).max() / np.abs(change).max())

    def moved(self, x, step):
        x = x.copy()
        x.ravel()[self.free] += step
        return x


class Penalized:
    """The energy and ½ K min(0, g)², K = area × stiffness; of sliding points ½ K g²."""

    def __init__(self, problem, stiffness):
        self.problem, self.weight = problem, stiffness * problem.area

    def value(self, x):
        if not self.problem.number:
            return self.problem.energy.value(x)
        gap = self.problem.look(x)[0]
        gap = np.where(self.problem.equal, gap, np.minimum(gap, 0))
        return self.problem.energy.value(x) + (self.weight * gap**2).sum() / 2

    def derivatives(self, x):
        problem = self.problem
        gradient, hessian = problem.gradient(x), problem.hessian(x)
        if problem.number:
            gap, seen = problem.look(x)
            acts = np.flatnonzero(problem.equal | (gap < 0))
            force, jacobian = self.weight[acts] * gap[acts], problem.jacobian(acts, seen)
            gradient = gradient + jacobian.T @ force
            hessian = hessian + jacobian.T @ (self.weight[acts, None] * jacobian)
            hessian += problem.bend(acts, force, seen)
        return gradient, hessian


def trusted(function, x, longest=3.0, tolerance=1e-8, most=200):
    """A minimum near x by Newton's method with a shift that grows until steps descend."""
    problem, shift = function.problem, 0.0
    value = function.value(x)
    gradient, hessian = function.derivatives(x)
    scale = np.abs(np.diag(hessian)).mean()
    for _ in range(most):
        try:
            factor = cho_factor(hessian + shift * np.eye(len(hessian)))
        except LinAlgError:
            shift = max(4 * shift, 1e-6 * scale)
            continue
        step = -cho_solve(factor, gradient)
        length = np.abs(step).max()
        if length < tolerance and shift < 1e-3 * scale:
            break
        if length > longest:
            step *= longest / length
        there = problem.moved(x, step)
        new = function.value(there)
        predicted = -(gradient @ step + step @ hessian @ step / 2)
        if not (np.isfinite(new) and value - new > 1e-4 * predicted) and length > 1e-7:
            shift = max(4 * shift, 1e-6 * scale)
            if shift > 1e8 * scale:
                break
            continue
        shift = 0 if shift < 1e-5 * scale else shift / 8
        x, value = there, new
        gradient, hessian = function.derivatives(x)
    return x


class Rest:
    """A place that an active-set search ended at, and what says that it is a constrained minimum."""

    def __init__(self, x, step, force, depth, least):
        self.x, self.step, self.force, self.depth, self.least = x, step, force, depth, least

    @property
    def found(self):
        return self.step < 1e-8 and self.depth < 1e-8 and self.least > -1e-9


def first_forces(problem, x, near):
    """Nonnegative forces of the constraints closer than `near` that balance the energy best."""
    gap, seen = problem.look(x)
    rows = np.flatnonzero(problem.equal | (gap < near))
    force = np.zeros(problem.number)
    if len(rows):
        jacobian, gradient = problem.jacobian(rows, seen), problem.gradient(x)
        equal = problem.equal[rows]
        matrix = np.vstack([jacobian, -jacobian[equal]]).T
        best = nnls(matrix, gradient, maxiter=100 * matrix.shape[1])[0]
        force[rows] = best[:len(rows)]
        force[rows[equal]] -= best[len(rows):]
    return force


def active_set(problem, x, near=1e-3, most=60, longest=1.0):
    """Newton's method on energy gradient = Σ force ∂g with the gaps that press closed, from x."""
    stiffness = max(1e-12, np.abs(np.diag(problem.hessian(x))).mean())
    force = first_forces(problem, x, near) if problem.number else np.zeros(0)
    length, presses = np.inf, force > 0
    for _ in range(most):
        hessian, gradient = problem.hessian(x), problem.gradient(x)
        gap, seen = problem.look(x)
        rows = np.flatnonzero(problem.equal | presses)
        jacobian = problem.jacobian(rows, seen)
        acting = np.flatnonzero(force)
        hessian = hessian - problem.bend(acting, force[acting], seen)
        weak = 1e-11 / stiffness
        matrix = np.block([[hessian, -jacobian.T], [jacobian, weak * np.eye(len(rows))]])
        right = np.concatenate([-gradient, -gap[rows] + weak * force[rows]])
        solution = lu_solve(lu_factor(matrix), right)
        step = solution[:len(gradient)]
        length = np.abs(step).max(initial=0)
        x = problem.moved(x, step * min(1, longest / max(length, 1e-300)))
        force = np.zeros(problem.number)
        force[rows] = solution[len(gradient):]
        before, presses = presses, force > problem.stiffness * problem.area * problem.look(x)[0]
        if length < 1e-9 and (before | problem.equal == presses | problem.equal).all():
            break
    return finished(problem, x, length, force)


def finished(problem, x, length, force):
    """Depth of gaps and pull of forces, mm, and the least curvature along closed gaps."""
    gap, seen = problem.look(x)
    rows = np.flatnonzero(problem.equal | (force > 0))
    hessian = problem.hessian(x) - problem.bend(rows, force[rows], seen)
    scale = np.abs(np.diag(hessian)).mean()
    violation = np.where(problem.equal, np.abs(gap), np.maximum(-gap, 0)).max(initial=0)
    pull = np.where(problem.equal, 0, -force).max(initial=0) / scale
    if len(rows):
        along = null_space(problem.jacobian(rows, seen), rcond=1e-9)
        hessian = along.T @ hessian @ along
    least = eigvalsh(hessian)[0] / scale if len(hessian) else 1.0
    return Rest(x, length, force, max(violation, pull), least)


def screw(transform, load):
    """Part of a rigid motion, by the logarithm of its matrix."""
    part = np.real(expm(load * logm(transform)))
    return part[:3, :3], part[:3, 3]


def place_bodies(problem, model, load):
    transforms = model.get("bone_transform", np.zeros((0, 4, 4)))
    motions = []
    for bone, push in zip(model.get("contact/body_bone", []), model.get("contact/body_push", [])):
        still = bone >= 0 and len(transforms) == 0
        motions.append((np.eye(3), np.zeros(3)) if still else screw(transforms[bone], load)
                       if bone >= 0 else (np.eye(3), load * push))
    problem.touches.place(motions)
    if len(transforms):
        problem.energy.place_supports([screw(transform, load) for transform in transforms])


def fixed_at(model, x, load):
    """x with known points where a load puts them, straight on."""
    known = model["point/set"] > 0
    x = x.copy()
    start = model["point/position"]
    x[known] = (start + load * (model["point/target"] - start))[known]
    return x


def from_the_start(problem, model, loads=4):
    """A constrained minimum by following the load with penalties from the initial state."""
    x = model["point/position"].copy()
    stiffness = max(float(model.get("contact@stiffness", 1.0)), 1e-6)
    for n in range(1, loads + 1):
        place_bodies(problem, model, n / loads)
        x = trusted(Penalized(problem, stiffness), fixed_at(model, x, n / loads), tolerance=1e-5)
    for factor in (10, 100, 1000) if problem.number else ():
        x = trusted(Penalized(problem, factor * stiffness), x, tolerance=1e-7)
    return active_set(problem, x, near=1e-2)
