"""The skin that is shown of a result: the one that was given, displaced, where another was solved in
its place, with lips and cuts open; otherwise the one that was solved. Arrays in mm."""

import numpy as np

from sheet.meshes import edges
from sheet.script import Unusable

FARTHEST = 5.0     # mm, in the median: a mesh farther from a skin is not one of it
AROUND_CUTS = 4.0  # mm: so near to a cut the solved skin is shown, which is cut open
SMOOTHINGS = 8     # as many neighbors from a side of a cut, whose border may be jagged


def read_places(group, name, count=None):
    """The places [n, 3] of a stored array, which must be finite, and `count` where that is given."""
    found = group[name][:]
    if found.ndim != 2 or found.shape[1] != 3 or count not in (None, len(found)):
        raise ValueError(f"{name} has the shape {found.shape}")
    if not np.isfinite(found).all():
        raise ValueError(f"{name} holds coordinates that are no finite numbers")
    return found


def read_rows(group, name, count):
    """The indices of a stored array, of rows of an array of length `count`."""
    found = group[name][:]
    if found.size and not 0 <= found.min() <= found.max() < count:
        raise ValueError(f"{name} has indices from {found.min()} to {found.max()}, of {count} rows")
    return found


class Skin:
    """A skin before and after, with its triangles; `solved`: 1 where the model computed a vertex, 0
    where it does not move, between in the strip where the motion fades."""

    def __init__(self, before, after, corners, solved):
        self.before, self.after, self.corners, self.solved = before, after, corners, solved
        self.movement = np.linalg.norm(after - before, axis=1)

    def turn(self, axes):
        """Takes all places to axes that are given as rows."""
        self.before, self.after = self.before @ axes.T, self.after @ axes.T


def read_given(h5):
    """The skin that the scene named, of an open result; None where that was solved itself."""
    if "given_skin" not in h5:
        return None
    group = h5["given_skin"]
    before = read_places(group, "points")
    return Skin(before, before + read_places(group, "displacement", len(before)),
                read_rows(group, "triangles", len(before)), group["solved"][:])


def solved_skin(h5, step=None):
    """The solved skin of a result at a step (the last), and the rows of its points in the model."""
    step = step or h5["step"][sorted(h5["step"])[-1]]
    before = read_places(h5, "model/point/position")
    after = read_places(step, "point/position", len(before))
    used, corners = np.unique(read_rows(h5, "model/skin/points", len(before)), return_inverse=True)
    return Skin(before[used], after[used], corners.reshape(-1, 3),
                np.ones(len(used))), used


def sides_of_cuts(solved):
    """Places [n, 3] at which vertices of the solved skin lie twice, and are apart in the end."""
    _, place, count = np.unique(solved.before, axis=0, return_inverse=True, return_counts=True)
    twice = np.flatnonzero(count[place.ravel()] > 1)
    return solved.before[twice]


def near(points, places, reach):
    """Returns a mask of the points within `reach` of one of a few places."""
    found = np.zeros(len(points), bool)
    if len(places) == 0:
        return found
    inside = np.flatnonzero(((points > places.min(0) - reach) &
                             (points < places.max(0) + reach)).all(1))
    for some in np.array_split(inside, max(1, len(inside) * len(places) // 4_000_000)):
        apart = ((points[some, None] - places[None])**2).sum(2).min(1)
        found[some[apart < reach * reach]] = True
    return found


def opened(given, solved):
    """The given skin with the solved one in place of it beside cuts and between lips, so that these
    open. Both lie within a fraction of a millimeter of each other."""
    places = sides_of_cuts(solved)
    if len(places) == 0:
        return given
    spaced = denser(places)
    kept = ~near(given.before, spaced, AROUND_CUTS)[given.corners].any(1)
    edge = np.linalg.norm(np.ptp(solved.before[solved.corners], axis=1), axis=1).mean()
    patch = near(solved.before, spaced, AROUND_CUTS + edge)[solved.corners].any(1)
    used, corners = np.unique(np.concatenate([given.corners[kept], solved.corners[patch] + len(given.before)]),
                              return_inverse=True)
    before, after, computed = (np.concatenate(both)[used] for both in (
        (given.before, solved.before), (given.after, solved.after), (given.solved, solved.solved)))
    return Skin(before, after, corners.reshape(-1, 3), computed)


def denser(places):
    """Places with those between neighbors, at most 8 mm apart, so that they cover a curve."""
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    one, other = np.nonzero((apart > 0) & (apart < 8))
    return np.concatenate([places, (places[one] + places[other]) / 2])


def shown_skin(h5):
    """The skin to show of an open result."""
    solved, _ = solved_skin(h5)
    given = read_given(h5)
    return opened(given, solved) if given else solved


def nearest(points, places):
    """For each place the row of the nearest point."""
    middle = points.mean(0)
    points, places = points - middle, places - middle
    squares, found = (points**2).sum(1), np.empty(len(places), int)
    size = max(1, 20_000_000 // max(len(points), 1))
    for first in range(0, len(places), size):
        apart = squares - 2 * places[first:first + size] @ points.T
        found[first:first + size] = apart.argmin(1)
    return found


def smoothed(skin):
    """Places of the vertices, smoothed along the triangles: away from a cut or lip, to the own side of it."""
    ends = np.concatenate([edges(skin.corners), edges(skin.corners)[:, ::-1]]).T
    links, places = 1 + np.bincount(ends[0], minlength=len(skin.before)), skin.before
    for _ in range(SMOOTHINGS):
        around = [np.bincount(ends[0], column[ends[1]], len(places)) for column in places.T]
        places = (places + np.transpose(around)) / links[:, None]
    return places


def matching_rows(skin, other):
    """For each vertex of another skin of the same face the row of this one: its own row where both are one
    mesh, else the nearest. Of several vertices at one place, as along cuts and parted lips, it is the one on the
    same side."""
    if skin.before.shape == other.before.shape and np.array_equal(skin.corners, other.corners) and \
            np.allclose(skin.before, other.before, rtol=0, atol=1e-6):
        return np.arange(len(skin.before))
    used = np.unique(skin.corners)
    both = np.concatenate([skin.before[used], other.before]).round(4)  # 0.1 µm
    _, first, place = np.unique(both, axis=0, return_index=True, return_inverse=True)
    found, place = first[place.ravel()[len(used):]], place.ravel()[:len(used)]
    elsewhere = found >= len(used)
    found[elsewhere] = nearest(skin.before[used], other.before[elsewhere])
    count = np.bincount(place)
    sides, other_sides = smoothed(skin)[used], smoothed(other)
    for shared in np.unique(place[found[count[place[found]] > 1]]):
        twins, rows = np.flatnonzero(place == shared), np.flatnonzero(place[found] == shared)
        found[rows] = twins[nearest(sides[twins], other_sides[rows])]
    return used[found]


def median_distance(points, places):
    """The median distance of places, of a thousand or so, from the nearest of some points."""
    some = places[::max(1, len(places) // 1000)]
    return np.median(np.linalg.norm(points[nearest(points, some)] - some, axis=1))


def rows_of_patient(skin, other, files):
    """Rows as of `matching_rows`; refuses skins of two patients, by the files of both plans."""
    if median_distance(skin.before, other.before) > FARTHEST:
        raise Unusable(f"{files[1]}: not the skin of {files[0]}; two plans of one patient can be compared")
    return matching_rows(skin, other)
