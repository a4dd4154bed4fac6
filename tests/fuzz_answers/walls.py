"""Sides of cuts against each other: places of one side, the other as a bicubic B-spline surface
(docs/theory/contact.md, K2 and K3)."""

import numpy as np


def spline(at, count):
    """Weights of a uniform cubic B-spline's `count` controls at parameters [W], with two derivatives,
    [3, W, count]; beyond its ends the net goes on straight: c_-1 = 2 c_0 - c_1."""
    span = np.floor(at).astype(int)
    s = at - span
    t = 1 - s
    local = np.array([[t**3 / 6, (4 - 6 * s**2 + 3 * s**3) / 6, (4 - 6 * t**2 + 3 * t**3) / 6, s**3 / 6],
                      [-t**2 / 2, (3 * s**2 - 4 * s) / 2, (4 * t - 3 * t**2) / 2, s**2 / 2],
                      [t, 3 * s - 2, 3 * t - 2, s]])
    weights, row = np.zeros((3, len(at), count)), np.arange(len(at))
    for k in range(4):
        control = span - 1 + k
        beyond = np.maximum(np.maximum(-control, control - (count - 1)), 0)
        end = np.clip(control, 0, count - 1)
        beside = np.where(control < 0, 1, np.where(control > count - 1, count - 2, end))
        for order in range(3):
            np.add.at(weights[order], (row, end), local[order, k] * (1 + beyond))
            np.add.at(weights[order], (row, beside), -local[order, k] * beyond)
    return weights


class Wall:
    """One cut: the matrices of its places, and of the controls of the surface that they stay off."""

    def __init__(self, size, shares, area, count):
        self.size = size
        number = size[0] * size[1]
        controls = np.zeros((2 * number, count))
        for row, (points, weights) in enumerate(shares):
            np.add.at(controls[row], points, weights)
        kept = np.flatnonzero(area > 0)
        self.area = area[kept]
        place = self.weights(np.stack(np.divmod(np.arange(number), size[1]), 1).astype(float))[0]
        self.places = place[kept] @ controls[:number]
        self.controls, self.samples = controls[number:], place

    def weights(self, at):
        """Weights of controls in S, S_1, S_2, S_11, S_12, S_22 at parameters [W, 2]: [6, W, controls]."""
        along, inwards = spline(at[:, 0], self.size[0]), spline(at[:, 1], self.size[1])
        return np.stack([(along[i][:, :, None] * inwards[j][:, None]).reshape(len(at), -1)
                         for i, j in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))])

    def feet(self, place, controls):
        """Parameters of the nearest places on the surface by Newton's method, from the nearest sample."""
        samples = self.samples @ controls
        near = ((samples[None] - place[:, None]) ** 2).sum(2).argmin(1)
        at = np.stack(np.divmod(near, self.size[1]), 1).astype(float)
        for _ in range(60):
            s = self.weights(at) @ controls
            way = place - s[0]
            tangent = s[1:3].transpose(1, 0, 2)
            metric = np.einsum("wad,wbd->wab", tangent, tangent)
            bend = np.einsum("kwd,wd->wk", s[3:], way)[:, [[0, 1], [1, 2]]]
            full = metric - bend
            good = (full[:, 0, 0] > 0) & (np.linalg.det(full) > 0)
            full = np.where(good[:, None, None], full, metric)
            step = np.linalg.solve(full, np.einsum("wad,wd->wa", tangent, way)[..., None])[..., 0]
            step *= np.minimum(1, 0.5 / np.maximum(np.abs(step).max(1), 1e-300))[:, None]
            then = np.clip(at + step, -1, self.size)
            before = (way**2).sum(1)
            for _ in range(20):
                longer = ((place - self.weights(then)[0] @ controls) ** 2).sum(1) > before * (1 + 1e-14)
                if not longer.any():
                    break
                then[longer] = (at[longer] + then[longer]) / 2
            moved, at = np.abs(then - at).max(), then
            if moved < 1e-13:
                break
        return at

    def gaps(self, x):
        """g [W] (infinite where nothing is opposite), and what derivatives need."""
        place, controls = self.places @ x, self.controls @ x
        at = self.feet(place, controls)
        weights = self.weights(at)
        s = weights @ controls
        n = np.cross(s[1], s[2])
        n /= np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None]
        opposite = ((at > -1) & (at < self.size)).all(1)
        gap = ((place - s[0]) * n).sum(1)
        return np.where(opposite, gap, np.inf), (weights @ self.controls, s, n, gap)

    def gradient(self, w, foot):
        """∂g of place w, [N, 3]."""
        shares, _, n, _ = foot
        return (self.places[w] - shares[0, w])[:, None] * n[w]

    def hessian(self, w, foot):
        """∂²g of place w over the points it involves: (points, [3 P, 3 P])."""
        shares, s, n, gap = (foot[0][:, w], foot[1][:, w], foot[2][w], foot[3][w])
        points = np.flatnonzero((shares[:3] != 0).any(0) | (self.places[w] != 0))
        own = self.places[w][points] - shares[0, points]
        a = np.einsum("ad,p->apd", s[1:3], own).reshape(2, -1)
        e = np.einsum("ap,d->apd", shares[1:3][:, points], n).reshape(2, -1)  # n · ∂S_2
        metric = s[1:3] @ s[1:3].T
        kappa = (s[3:] @ n)[[[0, 1], [1, 2]]]
        inverse = np.linalg.inv(metric - gap * kappa)
        mixed = a.T @ inverse @ e
        return points, (-a.T @ np.linalg.inv(metric) @ kappa @ inverse @ a - mixed - mixed.T
                        - gap * e.T @ inverse @ e)


def walls_of(model):
    if "contact/wall/net" not in model:
        return []
    begin, point = model["contact/wall/begin"], model["contact/wall/point"]
    weight, area = model["contact/wall/weight"], model["contact/wall/area"]
    walls, first, place = [], 0, 0
    for size in model["contact/wall/net"]:
        number = int(size[0] * size[1])
        shares = [(point[begin[c]:begin[c + 1]], weight[begin[c]:begin[c + 1]])
                  for c in range(first, first + 2 * number)]
        if (area[place:place + number] > 0).any():
            walls.append(Wall(size, shares, area[place:place + number], len(model["point/position"])))
        first, place = first + 2 * number, place + number
    return walls
