"""A reader of results written from docs/reference/formats.md alone, with NumPy and h5py: recomputes
the numbers of a step of a solid from /model and the step's positions."""

import h5py
import numpy as np
from scipy.ndimage import minimum_filter

from tissue import read

GAP_LIMIT = 6.0  # mm


class File:
    """Arrays by path: `model`, and of each step `arrays` and `numbers`."""

    def __init__(self, file):
        self.folder = file.parent
        with h5py.File(file) as h5:
            self.model = read(h5["model"])
            self.contact = dict(h5["model/contact"].attrs) if "contact" in h5["model"] else {}
            self.adhesion = dict(h5["model/adhesion"].attrs) if "adhesion" in h5["model"] else {}
            self.gravity = h5["model"].attrs["gravity"]
            self.elements = {item.attrs["term"].decode(): (item["points"][()], item["numbers"][()].reshape(
                -1, item.attrs["numbers_each"])) for item in h5["model"].get("element", {}).values()}
            self.steps = [(read(step), dict(step.attrs)) for step in h5["step"].values()]


# ----- motion


def screw(matrix, load):
    """The rigid motion `matrix` at a load: the angle and the way along the axis times the load."""
    turn, shift = matrix[:3, :3], matrix[:3, 3]
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    angle = np.arctan2(np.linalg.norm(axis), (np.trace(turn) - 1) / 2)
    if angle == 0:
        return np.eye(3), load * shift
    axis /= np.linalg.norm(axis)
    along = (axis @ shift) * axis
    across = shift - along
    center = (across + np.cross(axis, across) / np.tan(angle / 2)) / 2
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    part = np.eye(3) + np.sin(load * angle) * k + (1 - np.cos(load * angle)) * k @ k
    return part, load * along + center - part @ center


def motions(file, load):
    return [screw(matrix, load) for matrix in file.model["bone_transform"]]


def prescribed(file, load):
    """Positions of the points that are no unknowns; not a number for the others."""
    model = file.model
    x, kind = model["point/position"], model["point/set"]
    found = np.where((kind == 0)[:, None], np.nan, x)
    for bone, (turn, shift) in enumerate(motions(file, load)):
        rows = (kind == 2) & (model["point/bone"] == bone)
        found[rows] = x[rows] @ turn.T + shift
    held = kind == 3
    found[held] = (1 - load) * x[held] + load * model["point/target"][held]
    return found


def advance(file, displacement):
    x, column = file.model["point/position"], file.model["point/column"]
    a, b, c = (x[file.model["skin/points"][:, k]] for k in range(3))
    normal = np.zeros((column.max() + 1, 3))
    for corner in file.model["skin/points"].T:
        np.add.at(normal, column[corner], np.cross(b - a, c - a))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return (displacement * normal[column]).sum(1)


# ----- the solid


def prism_terms(p):
    """Volumes [M] of corners [M, 6, 3] and their gradients [M, 6, 3]."""
    a1, a2, b1, b2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], p[:, 4] - p[:, 3], p[:, 5] - p[:, 3]
    d = (p[:, 3:] - p[:, :3]).mean(1)
    area = 2 * np.cross(a1, a2) + np.cross(a1, b2) + np.cross(b1, a2) + 2 * np.cross(b1, b2)
    by_a1, by_a2 = np.cross(2 * a2 + b2, d) / 12, np.cross(d, 2 * a1 + b1) / 12
    by_b1, by_b2 = np.cross(a2 + 2 * b2, d) / 12, np.cross(d, a1 + 2 * b1) / 12
    third = area / 36
    gradient = np.stack([-by_a1 - by_a2 - third, by_a1 - third, by_a2 - third,
                         -by_b1 - by_b2 + third, by_b1 + third, by_b2 + third], axis=1)
    return (d * area).sum(1) / 12, gradient


def deformation(before, now):
    """F in the middle of prisms [M, 3, 3]."""
    slopes = np.array([[-1, 1, 0, -1, 1, 0], [-1, 0, 1, -1, 0, 1]]) / 2
    upwards = np.array([-1, -1, -1, 1, 1, 1]) / 3
    local = np.vstack([slopes, upwards])
    jacobian = lambda p: np.einsum("mci,kc->mik", p, local)
    return jacobian(now) @ np.linalg.inv(jacobian(before))


def solid(file, position):
    """The numbers of prisms and edges, and the forces on all points."""
    model, before = file.model, file.model["point/position"]
    points, soft = model["prism/points"], model["point/set"] == 0
    v, slope_of_v = prism_terms(position[points])
    v0, target, kappa = (model[f"prism/{name}"] for name in
                         ("rest_volume", "target_volume", "modulus"))
    averaged = np.zeros_like(v)
    energy_averaged, own = 0.0, kappa
    if "prism/nodal_modulus" in model:
        change, compliance = np.zeros(len(before)), np.zeros(len(before))
        for corner in points.T:
            np.add.at(change, corner, (v - v0) / 6)
            np.add.at(compliance, corner, v0 / model["prism/nodal_modulus"] / 6)
        pressure = np.divide(change, compliance, out=np.zeros_like(change), where=compliance > 0)
        averaged, own = pressure[points].mean(1), kappa - model["prism/nodal_modulus"]
        energy_averaged = 0.5 * (pressure * change).sum()
    at_rest = kappa * (v0 - target) / v0
    slope = own * (v - v0) / v0 + at_rest + averaged
    p, q = model["edge/points"].T
    weight, apart = model["edge/weight"], position[q] - position[p]
    apart_before = before[q] - before[p]
    energy = 0.5 * (weight * ((apart**2).sum(1) - (apart_before**2).sum(1))).sum()
    energy += (0.5 * own * (v - v0)**2 / v0 + at_rest * (v - v0)).sum() + energy_averaged
    force = np.zeros_like(position)
    np.add.at(force, p, weight[:, None] * apart)
    np.add.at(force, q, -weight[:, None] * apart)
    for k in range(6):
        np.add.at(force, points[:, k], -slope[:, None] * slope_of_v[:, k])
    f = deformation(before[points], position[points])
    stretch = np.linalg.svd(f, compute_uv=False)
    stress = model["prism/shear_modulus"][:, None] / np.linalg.det(f)[:, None] * stretch**2
    mean = stress.mean(1)
    of_soft = soft[points].any(1)
    return {"force": force, "f_e": energy, "f_v": ((v - v0)**2)[of_soft].sum(),
            "prism/volume_ratio": v / v0, "prism/pressure": -mean - slope,
            "prism/von_mises": np.sqrt(1.5 * ((stress - mean[:, None])**2).sum(1)),
            "prism/principal_stretch": stretch,
            "volume_error_max": np.abs(v / v0 - 1)[of_soft].max(),
            "inverted_prisms": int((v[of_soft] <= 0).sum())}


# ----- distances


def closest_on_triangles(point, a, b, c):
    """Squared distances [P, T] of points to triangles: to the plane or to an edge."""
    def along(way, start):
        return point @ way.T - (start * way).sum(1)

    def to_edge(p, q):
        way = q - p
        length = np.maximum((way**2).sum(1), 1e-300)
        share = np.clip(along(way, p) / length, 0, 1)
        off = point[:, None] - p - share[..., None] * way
        return np.einsum("ptx,ptx->pt", off, off)

    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(size, 1e-300)[:, None]
    inside = np.tile(size > 0, (len(point), 1))
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= along(np.cross(unit, q - p), p) >= 0
    edges = np.minimum(np.minimum(to_edge(a, b), to_edge(b, c)), to_edge(c, a))
    return np.where(inside, along(unit, a)**2, edges)


class Mesh:
    """The signed distance to a mesh: a cubic B-spline on a grid."""

    def __init__(self, points, triangles, spacing):
        self.spacing, self.reach = spacing, max(6.0, 4 * spacing)
        used = points[triangles.ravel()]
        margin = self.reach + 4 * spacing
        self.origin = used.min(0) - margin
        self.blocks = 1 + ((used.max(0) - self.origin + margin) / (8 * spacing)).astype(int)
        self.corners = [points[triangles[:, k]] for k in range(3)]
        self.middle = sum(self.corners) / 3
        self.radius = np.max([np.linalg.norm(x - self.middle, axis=1) for x in self.corners], 0)
        self.low, self.high = np.min(self.corners, 0), np.max(self.corners, 0)
        self.known, self.lines = {}, {}

    def coefficients(self, index):
        """[n] at grid points [n, 3]: distances less a sixth of their second differences."""
        beside = [self.values(index + side * np.eye(3, dtype=int)[a])
                  for a in range(3) for side in (-1, 1)]
        here = self.values(index)
        return here - (sum(beside) - 6 * here) / 6

    def values(self, index):
        """[n] distances of grid points [n, 3]."""
        keys = [tuple(i) for i in index]
        missing = np.array(sorted(set(keys) - self.known.keys()))
        if len(missing):
            blocks, block = np.unique(missing // 4, axis=0, return_inverse=True)
            for number in range(len(blocks)):
                rows = missing[block.ravel() == number]
                self.known.update(zip(map(tuple, rows), self.distances(rows)))
        return np.array([self.known[key] for key in keys])

    def distances(self, index):
        """Signed distances of grid points near each other, at most `reach`."""
        at = self.origin + self.spacing * index
        center = at.mean(0)
        around = np.linalg.norm(at - center, axis=1).max()
        off = np.linalg.norm(self.middle - center, axis=1)
        near = off - self.radius <= (off + self.radius).min() + 2 * around
        squared = closest_on_triangles(at, *(x[near] for x in self.corners)).min(1)
        sign = np.where(self.windings(index, at) != 0, -1, 1)
        return np.minimum(sign * np.sqrt(squared), self.reach)

    def exact(self, at):
        """Signed distances of places to the triangles themselves."""
        found = np.empty(len(at))
        for row, place in enumerate(at):
            off = np.linalg.norm(self.middle - place, axis=1)
            near = off - self.radius <= (off + self.radius).min()
            distance = np.sqrt(
                closest_on_triangles(place[None], *(x[near] for x in self.corners)).min())
            x, sign = self.crossings(place[1:])
            found[row] = distance if sign[x > place[0]].sum() == 0 else -distance
        return found

    def windings(self, index, at):
        """Winding numbers: signed crossings with the half-line in +x."""
        number = np.zeros(len(at), int)
        for row, (point, line) in enumerate(zip(at, map(tuple, index[:, 1:]))):
            if line not in self.lines:
                self.lines[line] = self.crossings(point[1:])
            x, sign = self.lines[line]
            number[row] = sign[x > point[0]].sum()
        return number

    def crossings(self, line):
        """x and signs of the triangles that a line in the direction x crosses."""
        line = line + self.spacing * np.array([1.1e-7, 2.3e-7])
        around = np.flatnonzero(((self.low[:, 1:] <= line) & (self.high[:, 1:] >= line)).all(1))
        y = [x[around, 1:] - line for x in self.corners]
        side = [p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
                for p, q in ((y[1], y[2]), (y[2], y[0]), (y[0], y[1]))]
        crossed = (np.min(side, 0) > 0) | (np.max(side, 0) < 0)
        side, total = [part[crossed] for part in side], sum(side)[crossed]
        x = sum(part * corner[around][crossed, 0] for part, corner in zip(side, self.corners))
        return x / total, np.sign(total).astype(int)

    def __call__(self, at):
        """Distances [n] and their gradients [n, 3]."""
        value, slope = np.full(len(at), self.reach), np.zeros((len(at), 3))
        place = (at - self.origin) / self.spacing
        inside = ((place >= 2) & (place < 8 * self.blocks - 3)).all(1)
        rows = np.flatnonzero(inside)
        rows = rows[self.lower_bound(at[rows]) < GAP_LIMIT + self.spacing]
        if len(rows) == 0:
            return value, slope
        first = place[rows].astype(int) - 1
        weights = [bspline(place[rows, a] - first[:, a] - 1) for a in range(3)]
        steps = np.stack(np.meshgrid(*[range(4)] * 3, indexing="ij"), -1).reshape(-1, 3)
        index = (first[:, None] + steps).reshape(-1, 3)
        f = self.coefficients(index).reshape(-1, 4, 4, 4)
        value[rows] = np.einsum("nijk,ni,nj,nk->n", f, *(w[0] for w in weights))
        for a in range(3):
            slope[rows, a] = np.einsum("nijk,ni,nj,nk->n", f, *(
                weights[b][int(a == b)] for b in range(3))) / self.spacing
        return value, slope

    def lower_bound(self, at):
        """Less than the distance: what is farther than the limit of gaps need not be computed."""
        square, bound = (self.middle**2).sum(1), []
        for part in np.array_split(at, 1 + len(at) // 1000):
            off = (part**2).sum(1)[:, None] + square - 2 * part @ self.middle.T
            bound.append(np.sqrt(np.maximum(off.min(1), 0)) - self.radius.max())
        return np.concatenate(bound)


def bspline(t):
    """Weights [n, 4] of value and slope at the share t of an interval."""
    u = 1 - t
    return (np.stack([u**3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * u**2 + 3 * u**3, t**3], 1) / 6,
            np.stack([-u**2, 3 * t**2 - 4 * t, 4 * u - 3 * u**2, t**2], 1) / 2)


def closed_form(kind, row):
    """distance(points) → values, gradients of a sphere, capsule, box or half-space."""
    def ball(at, middle, radius):
        way = at - middle
        length = np.linalg.norm(way, axis=1)
        return length - radius, way / np.maximum(length, 1e-300)[:, None]

    def capsule(at):
        axis = row[3:6] - row[:3]
        share = np.clip((at - row[:3]) @ axis / max(axis @ axis, 1e-300), 0, 1)
        return ball(at, row[:3] + share[:, None] * axis, row[6])

    def box(at):
        way = at - row[:3]
        beyond, side = np.abs(way) - row[3:6] / 2, np.where(way < 0, -1.0, 1.0)
        out = np.maximum(beyond, 0)
        length = np.linalg.norm(out, axis=1)
        deepest = side * (beyond == beyond.max(1, keepdims=True))
        outside = side * out / np.maximum(length, 1e-300)[:, None]
        return (np.where(length > 0, length, beyond.max(1)),
                np.where((length > 0)[:, None], outside, deepest))

    def half_space(at):
        normal = row[3:6] / np.linalg.norm(row[3:6])
        return (at - row[:3]) @ normal, np.tile(normal, (len(at), 1))

    return {1: lambda at: ball(at, row[:3], row[3]), 2: capsule, 3: box, 4: half_space}[kind]


# ----- adhesion


def nearest_places(points, a, b, c):
    """The nearest place of triangles [T, 3] to each of the points [P, 3]."""
    found = np.empty_like(points)
    middle = (a + b + c) / 3
    radius = np.max([np.linalg.norm(x - middle, axis=1) for x in (a, b, c)], 0)
    for row, point in enumerate(points):
        off = np.linalg.norm(middle - point, axis=1)
        near = off - radius <= (off + radius).min()
        one, two, three = a[near], b[near], c[near]
        normal = np.cross(two - one, three - one)
        square = np.maximum((normal**2).sum(1), 1e-300)[:, None]
        places = [point - ((point - one) * normal).sum(1)[:, None] / square * normal]
        inside = np.ones(len(one), bool)
        for p, q in ((one, two), (two, three), (three, one)):
            inside &= (np.cross(q - p, places[0] - p) * normal).sum(1) >= 0
            share = ((point - p) * (q - p)).sum(1) / np.maximum(((q - p)**2).sum(1), 1e-300)
            places.append(p + np.clip(share, 0, 1)[:, None] * (q - p))
        places[0] = np.where((inside & (square[:, 0] > 1e-300))[:, None], places[0], np.inf)
        places = np.concatenate(places)
        found[row] = places[((places - point)**2).sum(1).argmin()]
    return found


def adhering(file):
    """Rows of points that adhere, of their jaws' bones, normals, areas."""
    model, x = file.model, file.model["point/position"]
    layer, column = model["point/layer"], model["point/column"]
    skin = np.zeros((column.max() + 1, 3))
    first = np.flatnonzero(layer == 0)[::-1]
    skin[column[first]] = x[first]
    right, middle, left = model["adhesion/lip_line"]
    point, touches = model["contact/point"], model["contact/binding"] == 0
    bones = np.where(model["contact/body_kind"] == 0, model["contact/body_bone"], -1)
    axes = model["adhesion/axes"].T
    at, above = x[point] @ axes, skin[column[point]] @ axes
    line = np.interp(above[:, 0], [right[0], middle[0], left[0]], [right[2], middle[2], left[2]])
    found = []
    for bone, upper, box, reach in zip(*(model[f"adhesion/{name}"] for name in
                                         ("bone", "upper", "box", "reach"))):
        rows = touches & (bones[model["contact/body_row"]] == bone)
        rows &= (layer[point] == layer.max()) & ((at >= box[:3]) & (at <= box[3:])).all(1)
        rows &= ~np.isin(column[point], model["adhesion/cut_column"])
        rows = np.flatnonzero(rows & ((above[:, 2] > line) == bool(upper)))
        corners = (model[f"bone_surface/{bone}/points"][corner]
                   for corner in model[f"bone_surface/{bone}/triangles"].T)
        off = x[point[rows]] - nearest_places(x[point[rows]], *corners)
        away = np.linalg.norm(off, axis=1)
        rows, off, away = (values[away <= reach] for values in (rows, off, away))
        found += zip(point[rows], np.full(len(rows), bone), off / away[:, None],
                     model["contact/area"][rows])
    return sorted(found, key=lambda film: film[0])


def adhesion(file, films, position, load):
    """Energy and forces [N, 3] on the tissue."""
    energy, force = 0.0, np.zeros_like(position)
    moved, reach = motions(file, load), file.adhesion.get("range")
    for point, bone, normal, area in films:
        turn, shift = moved[bone]
        way = position[point] - turn @ file.model["point/position"][point] - shift
        s = max(0, (turn @ normal) @ way / reach)
        most = area * file.adhesion["tension"]
        energy += most * reach * ((1 + s**2)**0.5 - 1)
        force[point] -= most * s / (1 + s**2)**0.5 * (turn @ normal)
    return energy, force


# ----- elastic supports


def supports(file, position, load):
    """Energy and forces [N, 3] on the tissue."""
    force = np.zeros_like(position)
    points, numbers = file.elements.get("elastic_support", (np.empty(0, int), np.empty((0, 5))))
    moved, energy = motions(file, load), 0.0
    for point, (*place, stiffness, bone) in zip(points, numbers):
        turn, shift = moved[int(bone)]
        way = position[point] - turn @ place - shift
        energy += stiffness / 2 * way @ way
        force[point] -= stiffness * way
    return energy, force


# ----- contact


class Contact:
    """Bodies and sides of cuts of a model."""

    def __init__(self, file):
        self.file, model = file, file.model
        self.bodies = []
        for d, kind in enumerate(model["contact/body_kind"]):
            where = f"bone_surface/{model['contact/body_bone'][d]}" if kind == 0 else \
                f"contact/body_mesh/{d}"
            self.bodies.append(
                Mesh(model[where + "/points"], model[where + "/triangles"], file.contact["grid"])
                if kind in (0, 5) else closed_form(kind, model["contact/body_shape"][d]))
        self.point, self.body = model["contact/point"], model["contact/body_row"]
        self.slides, self.area = model["contact/binding"] == 1, model["contact/area"]
        initial, _ = self.distances(model["point/position"], 0)
        self.offset = np.where(self.slides, initial, np.minimum(0, initial))
        self.cuts = cuts_of(model) if "contact/wall/net" in model else []

    def distances(self, position, load):
        """Distances of the constraints and their gradients in space."""
        moved = motions(self.file, load)
        value, slope = np.zeros(len(self.point)), np.zeros((len(self.point), 3))
        for d, body in enumerate(self.bodies):
            bone, rows = self.file.model["contact/body_bone"][d], self.body == d
            turn, shift = moved[bone] if bone >= 0 else \
                (np.eye(3), load * self.file.model["contact/body_push"][d])
            value[rows], gradient = body((position[self.point[rows]] - shift) @ turn)
            slope[rows] = gradient @ turn.T
        return value, slope

    def stated_gaps(self, position, load, value):
        """The gaps as contact_gap has them: away from a mesh by the distance to its triangles."""
        moved, gap = motions(self.file, load), value - self.offset
        for d, body in enumerate(self.bodies):
            if not isinstance(body, Mesh):
                continue
            bone, grid = self.file.model["contact/body_bone"][d], self.file.contact["grid"]
            rows = np.flatnonzero((self.body == d) & ~self.slides & (gap >= 0))
            turn, shift = moved[bone] if bone >= 0 else \
                (np.eye(3), load * self.file.model["contact/body_push"][d])
            rows = rows[body.lower_bound((position[self.point[rows]] - shift) @ turn) < GAP_LIMIT]
            exact = body.exact((position[self.point[rows]] - shift) @ turn)
            away = exact >= 1.67 * grid + 1e-5
            gap[rows[away]] = (np.minimum(exact, body.reach) - self.offset[rows])[away]
        return gap

    def exact_penetration(self, position, load):
        """Largest depth inside the bodies' own triangles, less that at the start."""
        moved, deepest = motions(self.file, load), 0.0
        value, _ = self.distances(position, load)
        for d, body in enumerate(self.bodies):
            bone, rows = self.file.model["contact/body_bone"][d], self.body == d
            rows &= value < 2 * self.file.contact["grid"]
            turn, shift = moved[bone] if bone >= 0 else \
                (np.eye(3), load * self.file.model["contact/body_push"][d])
            places = ((position[self.point[rows]] - shift) @ turn,
                      self.file.model["point/position"][self.point[rows]])
            now, start = (np.maximum(0, -(body.exact(at) if isinstance(body, Mesh) else body(at)[0]))
                          for at in places)
            deepest = max(deepest, (now - start).max(initial=0))
        return deepest

    def measure(self, position, load, pressing):
        """Gaps of points, the penetration and, of each constraint nearer than `pressing` mm: its
        point, gap, area and the force [N, 3] of a pressure of 1 N/mm²."""
        value, slope = self.distances(position, load)
        gap = value - self.offset
        of_point, acting = np.full(len(position), GAP_LIMIT), []
        np.minimum.at(of_point, self.point, self.stated_gaps(position, load, value))
        for c in np.flatnonzero((gap < pressing) | self.slides):
            acting.append((self.point[c], gap[c], self.area[c],
                           {self.point[c]: self.area[c] * slope[c]}))
        deepest = max(0, -gap.min())
        for place, point, area in (entry for cut in self.cuts for entry in cut.places):
            one, foot = place(position)
            of_point[point] = min(of_point[point], one)
            deepest = max(deepest, -one)
            if foot is not None and one < pressing:
                acting.append((point, one, area, foot(area)))
        return of_point, deepest, acting


class Net:
    """A bicubic B-spline surface whose controls are weighted sums of points."""

    def __init__(self, size, controls):
        self.columns, self.rows = size
        self.ends = np.array([(-1.0, 0.0), (self.columns, self.rows - 1.0)])
        self.controls = controls  # [(points, weights)]
        self.last = None

    def places(self, position):
        if self.last is None or self.last[0] is not position:
            at = np.array([weights @ position[points] for points, weights in self.controls])
            self.last = position, at.reshape(self.columns, self.rows, 3)
        return self.last[1]

    def weights(self, where, derivatives):
        """[columns, rows] at a place, of the derivative of the given order in each direction."""
        return np.outer(*(straight_on(at, count, order) for at, count, order in
                          zip(where, (self.columns, self.rows), derivatives)))

    def point(self, position, where, derivatives=(0, 0)):
        return np.einsum("ij,ijx->x", self.weights(where, derivatives), self.places(position))

    def samples(self, position):
        """The surface at multiples of a half from its first end on."""
        along, inwards = (np.array([straight_on(at, count, 0) for at in np.arange(first, last + 0.5, 0.5)])
                          for count, first, last in zip((self.columns, self.rows), *self.ends))
        return np.einsum("ik,jl,klx->ijx", along, inwards, self.places(position))

    def shares(self, weights):
        """{point: share} of a sum of controls."""
        found = {}
        for weight, (points, parts) in zip(weights.ravel(), self.controls):
            if weight != 0:
                for point, part in zip(points, parts):
                    found[point] = found.get(point, 0) + weight * part
        return found


def straight_on(at, count, order):
    """Weights of `count` controls of a uniform cubic B-spline whose control k is at k; controls
    beyond an end lie in a straight line with the last two."""
    span = int(np.floor(at))
    t = np.array([at - span])
    u = 1 - t
    four = (*bspline(t), np.stack([u, 3 * t - 2, 3 * u - 2, t], 1))[order][0]
    weights = np.zeros(count)
    for control, weight in zip(range(span - 1, span + 3), four):
        if control < 0:
            weights[[0, 1]] += weight * np.array([1 - control, control])
        elif control >= count:
            beyond = control - count + 1
            weights[[-1, -2]] += weight * np.array([1 + beyond, -beyond])
        else:
            weights[control] += weight
    return weights


class Cut:
    """The places of a cut's first side, which stay off the surface of the second."""

    def __init__(self, first, second, areas, nearest):
        self.first, self.second = first, second
        self.places = [(lambda position, w=w: self.gap(position, divmod(w, first.rows)),
                        nearest[w], areas[w]) for w in np.flatnonzero(areas > 0)]

    def gap(self, position, own):
        """The gap of a place and, where the surface is opposite, force(area) of unit pressure."""
        at, other = self.first.point(position, own), self.second
        first, last = other.ends
        samples = other.samples(position)
        far = np.linalg.norm(samples - at, axis=2)
        least = minimum_filter(far, footprint=[[0, 1, 0], [1, 1, 1], [0, 1, 0]], mode="nearest") == far
        feet = [self.foot(position, at, first + 0.5 * start)
                for start in np.argwhere(least & (far <= 2 * far.min()))]
        where = min(feet, key=lambda foot: np.linalg.norm(at - other.point(position, foot)))
        way = at - other.point(position, where)
        normal = np.cross(*(other.point(position, where, order) for order in ((1, 0), (0, 1))))
        if (where <= first).any() or (where >= last).any():
            return np.linalg.norm(way), None
        normal /= np.linalg.norm(normal)

        def force(area):
            found = {}
            for shares, sign in ((self.first.shares(self.first.weights(own, (0, 0))), 1),
                                 (other.shares(other.weights(where, (0, 0))), -1)):
                for point, share in shares.items():
                    found[point] = found.get(point, 0) + sign * share * area * normal
            return found
        return way @ normal, force

    def foot(self, position, at, where):
        """The nearest place of the second side, by Newton's method."""
        s = lambda place, *order: self.second.point(position, place, order)
        for _ in range(60):
            way = at - s(where, 0, 0)
            first = np.array([s(where, 1, 0), s(where, 0, 1)])
            second = np.array([[s(where, 2, 0), s(where, 1, 1)], [s(where, 1, 1), s(where, 0, 2)]])
            bend = first @ first.T - second @ way
            if not (bend[0, 0] > 0 and np.linalg.det(bend) > 0):
                bend = first @ first.T
            step = np.linalg.solve(bend, first @ way)
            step *= min(1, 0.5 / max(np.abs(step).max(), 1e-13))
            there = np.clip(where + step, *self.second.ends)
            for _ in range(20):
                if np.linalg.norm(at - s(there, 0, 0)) <= np.linalg.norm(way):
                    break
                there = (where + there) / 2
            moved, where = np.abs(there - where).max(), there
            if moved < 1e-12:
                break
        return where


def cuts_of(model):
    begin, point, weight, area = (model[f"contact/wall/{name}"] for name in
                                  ("begin", "point", "weight", "area"))
    controls = [(point[b:e], weight[b:e]) for b, e in zip(begin[:-1], begin[1:])]
    cuts, first, place = [], 0, 0
    for size in model["contact/wall/net"]:
        count = size[0] * size[1]
        sides = [controls[first + k * count:first + (k + 1) * count] for k in (0, 1)]
        cuts.append(Cut(*(Net(size, side) for side in sides), area[place:place + count],
                        [points[0] for points, _ in sides[0]]))
        first, place = first + 2 * count, place + count
    return cuts
