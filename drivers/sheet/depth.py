"""How deep bones lie inside one another, and inside tissue. In mm; surfaces of bones are closed."""

import itertools

import numpy as np

from sheet.shown_skin import nearest

AROUND = 10.0  # mm: vertices so near to the box of the points bound distances; all where there are none
SAME = 1e-6     # of motions: largest difference of entries, mm or none
SAMPLES = 9     # places between the ends of a segment


def expand(first, count):
    """Concatenated ranges from `first`, and for each entry the row of its range."""
    row = np.repeat(np.arange(len(count)), count)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + first[row]


def inside(points, surface, corners):
    """Which points lie inside a closed surface: by the parity of the triangles in front of them along x, which
    are found by squares of the plane across."""
    across = points[:, 1:] + (1.1e-7, 1.7e-7)  # beside vertices that both surfaces share
    low, high = surface[corners].min(1), surface[corners].max(1)
    asked = np.flatnonzero(((points >= surface.min(0)) & (points <= surface.max(0))).all(1))
    found = np.zeros(len(points), bool)
    if len(asked) == 0:
        return found
    begin, end = across[asked].min(0), across[asked].max(0)
    kept = np.flatnonzero(((low[:, 1:] <= end) & (high[:, 1:] >= begin)).all(1))
    low, high = low[kept, 1:], high[kept, 1:]
    side = max(float((high - low).mean()) if len(kept) else 0, float((end - begin).max()) / 1000, 1e-6)
    size = ((end - begin) // side).astype(int) + 1

    def square(places):
        return np.clip((places - begin) // side, 0, size - 1).astype(int)

    first, wide = square(low), square(high) - square(low) + 1
    row, step = expand(np.zeros(len(kept), int), wide.prod(1))
    cell = (first[row, 0] + step // wide[row, 1]) * size[1] + first[row, 1] + step % wide[row, 1]
    order = np.argsort(cell, kind="stable")
    cell, triangle = cell[order], kept[row[order]]
    own = square(across[asked]) @ (size[1], 1)
    begins = np.searchsorted(cell, own)
    point, entry = expand(begins, np.searchsorted(cell, own, "right") - begins)
    a, b, c = (surface[corners[triangle[entry], k]] for k in range(3))
    at = across[asked][point]
    weights = np.stack([turn(q[:, 1:] - at, r[:, 1:] - at) for q, r in ((b, c), (c, a), (a, b))], 1)
    hit = (weights > 0).all(1) | (weights < 0).all(1)
    weights, point = weights[hit], point[hit]
    depth = np.einsum("nk,nk->n", weights, np.stack([a[hit, 0], b[hit, 0], c[hit, 0]], 1)) / weights.sum(1)
    ahead = depth > points[asked, 0][point]
    found[asked] = np.bincount(point[ahead], minlength=len(asked)) % 2 == 1
    return found


def turn(one, other):
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]


def distance(point, a, b, c):
    """From a point to the nearest of triangles."""
    normal = np.cross(b - a, c - a)
    square = np.maximum((normal**2).sum(1), 1e-300)
    over = np.all([(np.cross(q - p, point - p) * normal).sum(1) >= 0 for p, q in ((a, b), (b, c), (c, a))], 0)
    best = (((point - a) * normal).sum(1)[over]**2 / square[over]).min(initial=np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        along = q - p
        share = np.clip(((point - p) * along).sum(1) / np.maximum((along**2).sum(1), 1e-300), 0, 1)
        best = min(best, ((p + share[:, None] * along - point)**2).sum(1).min(initial=np.inf))
    return float(np.sqrt(best))


def depths(points, surface, corners, least):
    """How deep each point lies inside a closed surface; 0 where that is less than `least`."""
    found = np.zeros(len(points))
    rows = np.flatnonzero(inside(points, surface, corners))
    if len(rows) == 0:
        return found
    used = surface[np.unique(corners)]
    low, high = points[rows].min(0) - AROUND, points[rows].max(0) + AROUND
    some = used[((used > low) & (used < high)).all(1)]
    some = some if len(some) else used
    bound = np.linalg.norm(some[nearest(some, points[rows])] - points[rows], axis=1)
    rows, bound = rows[bound >= least], bound[bound >= least]
    if len(rows) == 0:
        return found
    lows, highs = surface[corners].min(1), surface[corners].max(1)
    kept = ((lows <= points[rows].max(0) + bound.max()) & (highs >= points[rows].min(0) - bound.max())).all(1)
    lows, highs = lows[kept], highs[kept]
    a, b, c = (surface[corners[kept, k]] for k in range(3))
    for row, most in zip(rows, bound * (1 + 1e-9)):
        near = ((lows <= points[row] + most) & (highs >= points[row] - most)).all(1)
        found[row] = distance(points[row], a[near], b[near], c[near])
    return np.where(found >= least, found, 0)


def touching(point, surface, corners, apart):
    """True if a point lies inside a closed surface or at most `apart` from it."""
    around = ((surface[corners].min(1) <= point + apart) & (surface[corners].max(1) >= point - apart)).all(1)
    return bool(distance(point, *(surface[corners[around, k]] for k in range(3))) <= apart
                or inside(point[None], surface, corners)[0])


def overlaps(bones, least):
    """[(name, name, mm)] of bones that move differently and end deeper than `least` inside one another."""
    for one, other in itertools.combinations(bones, 2):
        if all(np.allclose(*parts, rtol=0, atol=SAME) for parts in zip(one["motion"], other["motion"])):
            continue
        deepest = max(depths(p["after"], q["after"], q["corners"], least).max(initial=0)
                      for p, q in ((one, other), (other, one)))
        if deepest > least:
            yield one["name"], other["name"], deepest


def pierced(before, after, bones, least):
    """Row of the segment [n, 2, 3] that a bone pierces deepest, between its ends, and did not before; and how
    deep: 0 where that is less than `least`."""
    def within(ends, which, bone):
        places = np.linspace(ends[:, 0], ends[:, 1], SAMPLES + 2)[1:-1]
        return depths(places.reshape(-1, 3), bone[which], bone["corners"], least).reshape(SAMPLES, -1).max(0)

    row, deepest = 0, 0.0
    for bone in bones:
        depth = within(after, "after", bone) if len(after) else np.zeros(1)
        deep = np.flatnonzero(depth > deepest)
        fresh = deep[within(before[deep], "before", bone) == 0] if len(deep) else deep
        if len(fresh):
            row = fresh[np.argmax(depth[fresh])]
            deepest = float(depth[row])
    return row, deepest
