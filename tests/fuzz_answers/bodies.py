"""Signed distances to bodies with two derivatives, and gaps of contact, from docs/theory/contact.md."""

import numpy as np

REACH = 6.0  # mm, outside a mesh up to which distances are known at least


def ball(from_center, radius, axis=None):
    """Distance to a sphere, or to a capsule's side with a unit `axis` (0 where its ends are nearest)."""
    length = np.linalg.norm(from_center, axis=1)
    n = from_center / np.maximum(length, 1e-300)[:, None]
    across = np.eye(3) - n[:, :, None] * n[:, None]
    if axis is not None:
        across -= axis[:, :, None] * axis[:, None]
    return length - radius, n, across / np.maximum(length, 1e-300)[:, None, None]


def sphere(x, shape):
    return ball(x - shape[:3], shape[3])


def capsule(x, shape):
    begin, end = shape[:3], shape[3:6]
    axis = end - begin
    share = (x - begin) @ axis / (axis @ axis)
    inner = ((share > 0) & (share < 1))[:, None]
    foot = begin + np.clip(share, 0, 1)[:, None] * axis
    return ball(x - foot, shape[6], inner * axis / np.linalg.norm(axis))


def box(x, shape):
    """Its largest coordinate beyond a side inside; outside the distance to the nearest point."""
    away = x - shape[:3]
    sign, beyond = np.where(away < 0, -1.0, 1.0), np.abs(away) - shape[3:6] / 2
    out = np.maximum(beyond, 0)
    length = np.linalg.norm(out, axis=1)
    side = np.eye(3)[beyond.argmax(1)]
    outside = (length > 0)[:, None]
    n = sign * np.where(outside, out / np.maximum(length, 1e-300)[:, None], side)
    across = (out > 0)[:, :, None] * np.eye(3) - n[:, :, None] * n[:, None]
    across = np.where(outside[:, :, None], across / np.maximum(length, 1e-300)[:, None, None], 0)
    return np.where(outside[:, 0], length, beyond.max(1)), n, across


def half_space(x, shape):
    n = shape[3:6] / np.linalg.norm(shape[3:6])
    return (x - shape[:3]) @ n, np.tile(n, (len(x), 1)), np.zeros((len(x), 3, 3))


def exact_distance(x, corners):
    """Signed distances of points [P, 3] to a closed mesh [T, 3, 3]; the sign by the winding number."""
    a, b, c = corners.transpose(1, 0, 2)
    best = np.full(len(x), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        d = q - p
        t = np.clip(((x[:, None] - p) * d).sum(2) / (d * d).sum(1), 0, 1)
        best = np.minimum(best, np.linalg.norm(x[:, None] - p - t[..., None] * d, axis=2).min(1))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    height = ((x[:, None] - a) * normal).sum(2)
    foot = x[:, None] - height[..., None] * normal
    above = np.ones(height.shape, bool)
    for p, q in ((a, b), (b, c), (c, a)):
        above &= (np.cross(q - p, foot - p) * normal).sum(2) >= 0
    best = np.minimum(best, np.where(above, np.abs(height), np.inf).min(1))
    u, v, w = (p - x[:, None] for p in (a, b, c))
    lu, lv, lw = (np.linalg.norm(p, axis=2) for p in (u, v, w))
    angle = np.arctan2((u * np.cross(v, w)).sum(2), lu * lv * lw + (u * v).sum(2) * lw
                       + (v * w).sum(2) * lu + (w * u).sum(2) * lv)
    return np.where(np.abs(angle.sum(1)) > np.pi, -best, best)


class Field:
    """A mesh's distance: the cubic B-spline that is exact for cubics, of exact distances at a grid's
    points, computed where they are needed."""

    def __init__(self, points, triangles, spacing):
        self.corners, self.spacing = points[triangles], spacing
        self.reach = max(REACH, 4 * spacing)
        margin = self.reach + 4 * spacing
        self.origin = self.corners.min((0, 1)) - margin
        self.end = (self.corners.max((0, 1)) + margin - self.origin) / spacing
        self.known = {}

    def coefficients(self, index):
        """[..., 3] of grid points to [...]: distances less a sixth of their second differences."""
        second = -6 * self.distances(index)
        for step in np.eye(3, dtype=int):
            second += self.distances(index + step) + self.distances(index - step)
        return self.distances(index) - second / 6

    def distances(self, index):
        """[..., 3] of grid points to [...]."""
        flat = index.reshape(-1, 3)
        missing = {tuple(at) for at in flat.tolist()} - self.known.keys()
        missing = sorted(missing)
        for begin in range(0, len(missing), 500):
            part = missing[begin:begin + 500]
            values = exact_distance(self.origin + self.spacing * np.array(part), self.corners)
            self.known.update(zip(part, np.minimum(values, self.reach)))
        return np.array([self.known[tuple(at)] for at in flat.tolist()]).reshape(index.shape[:-1])

    def __call__(self, x, _):
        value = np.full(len(x), self.reach)
        slope, bend = np.zeros((len(x), 3)), np.zeros((len(x), 3, 3))
        at = (x - self.origin) / self.spacing
        inside = np.flatnonzero((at >= 2).all(1) & (at < self.end - 3).all(1))
        if not len(inside):
            return value, slope, bend
        at = at[inside]
        first = np.floor(at).astype(int)
        t = at - first
        u = 1 - t
        w = np.array([  # [derivative, control, point, axis]
            [u**3 / 6, (4 - 6 * t**2 + 3 * t**3) / 6, (4 - 6 * u**2 + 3 * u**3) / 6, t**3 / 6],
            [-u**2 / 2, (3 * t**2 - 4 * t) / 2, (4 * u - 3 * u**2) / 2, t**2 / 2],
            [u, 3 * t - 2, 3 * u - 2, t]])
        steps = np.stack(np.meshgrid(*[np.arange(-1, 3)] * 3, indexing="ij"), -1)
        c = self.coefficients(first[:, None, None, None] + steps)

        def spline(*orders):
            return np.einsum("pijk,ip,jp,kp->p", c, *(w[o][:, :, a] for a, o in enumerate(orders)))

        value[inside] = spline(0, 0, 0)
        for a in range(3):
            slope[inside, a] = spline(*np.eye(3, dtype=int)[a]) / self.spacing
            for b in range(3):
                orders = np.eye(3, dtype=int)[a] + np.eye(3, dtype=int)[b]
                bend[inside, a, b] = spline(*orders) / self.spacing**2
        return value, slope, bend


CLOSED_FORMS = {1: sphere, 2: capsule, 3: box, 4: half_space}


class Touches:
    """Points against bodies: gaps g ≥ 0, or g = 0 where `equal`. The bodies are moved by `place`."""

    def __init__(self, model):
        self.point = model.get("contact/point", np.zeros(0, int))
        self.body = model.get("contact/body_row", np.zeros(0, int))
        self.equal = model.get("contact/binding", np.zeros(0)) == 1
        self.area = model.get("contact/area", np.zeros(0))
        self.shapes = model.get("contact/body_shape", np.zeros((0, 7)))
        self.distance = [shape_of(model, k) for k in range(len(self.shapes))]
        self.place([(np.eye(3), np.zeros(3))] * len(self.shapes))
        self.offset = np.zeros(len(self.point))
        start = self.gaps(model["point/position"])[0]
        self.offset = np.where(self.equal, start, np.minimum(start, 0))

    def place(self, motions):
        """Rotation and translation of each body."""
        self.motions = motions

    def gaps(self, x):
        """g [C], ∂g [C, 3] and ∂²g [C, 3, 3] by the constraint's own point."""
        value, slope = np.zeros(len(self.point)), np.zeros((len(self.point), 3))
        bend = np.zeros((len(self.point), 3, 3))
        for k, (turn, shift) in enumerate(self.motions):
            own = np.flatnonzero(self.body == k)
            if len(own):
                v, s, b = self.distance[k]((x[self.point[own]] - shift) @ turn, self.shapes[k])
                value[own], slope[own], bend[own] = v, s @ turn.T, turn @ b @ turn.T
        return value - self.offset, slope, bend


def shape_of(model, k):
    kind, bone = model["contact/body_kind"][k], model["contact/body_bone"][k]
    if kind in CLOSED_FORMS:
        return CLOSED_FORMS[kind]
    mesh = f"bone_surface/{bone}" if kind == 0 else f"contact/body_mesh/{k}"
    return Field(model[f"{mesh}/points"], model[f"{mesh}/triangles"], float(model["contact@grid"]))
