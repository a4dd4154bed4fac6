"""Surfaces in text for a page: made coarser where they are fine, rounded, packed and compressed.
`unpack` in drivers/web/pack.js is the inverse."""

import base64
import zlib

import numpy as np

FINER = 2.0  # so many times longer are edges where nothing moves


def coarser(states, corners, fields, most, still=None):
    """States, corners and fields of the surface with at most so many triangles. `states` are places
    [n, 3] of its vertices, initial ones first. Connected vertices in one cell of a grid become one, so
    that the sides of a cut, which begin at one place, stay apart. `still` marks vertices that may be in
    larger cells."""
    if len(corners) <= most:
        return states, corners, fields
    points, links = states[0], np.concatenate([edges(corners), joints(states)])
    low, one = points.min(0), points[corners[:, 0]] - points[corners[:, 1]]
    edge = np.linalg.norm(one, axis=1).mean()
    size = np.where(still, FINER, 1.0) if still is not None else np.ones(len(points))
    while True:
        cell = np.floor((points - low) / (edge * size)[:, None]).astype(np.int64)
        key = ((cell[:, 2] << 40) + (cell[:, 1] << 20) + cell[:, 0]) * 2 + (size > 1)
        inside = links[key[links[:, 0]] == key[links[:, 1]]]
        _, row, count = np.unique(components(len(points), inside), return_inverse=True,
                                  return_counts=True)
        faces = row.ravel()[corners]
        whole = (faces != np.roll(faces, 1, axis=1)).all(1)
        faces = faces[whole]
        _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        if len(first) <= most:
            break
        edge *= 1.1
    kept = np.sort(first)
    faces, origin = faces[kept], corners[whole][kept]
    used, faces = np.unique(faces, return_inverse=True)

    def mean(values):
        flat = values.reshape(len(values), -1)
        sums = np.stack([np.bincount(row.ravel(), flat[:, k]) for k in range(flat.shape[1])], 1)
        return (sums / count[:, None])[used].reshape(-1, *values.shape[1:])

    states, faces = [mean(places) for places in states], faces.reshape(-1, 3)
    turned = (normals(states[0], faces) * normals(points, origin)).sum(1) < 0
    faces[turned] = faces[turned][:, ::-1]  # by the merging of their corners
    return states, faces, [mean(values) for values in fields]


def edges(corners):
    """[3 T, 2], those of a triangle and its neighbor twice."""
    return np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])


def joints(states):
    """Pairs of vertices [n, 2] that lie at one place in every state, as on a seam of a texture."""
    _, first, place = np.unique(np.concatenate(states, axis=1), axis=0, return_index=True,
                                return_inverse=True)
    pairs = np.stack([first[place.ravel()], np.arange(len(states[0]))], axis=1)
    return pairs[pairs[:, 0] != pairs[:, 1]]


def components(count, links):
    """For each of so many vertices the first vertex of its connected component."""
    root = np.arange(count)
    while len(links):
        root[links.max(1)] = links.min(1)
        while (root[root] != root).any():
            root = root[root]
        links = root[links]
        links = links[links[:, 0] != links[:, 1]]
    return root


def normals(points, corners):
    """[T, 3], of twice the triangles' areas."""
    a, b, c = (points[corners[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


class Pack:
    """Arrays one behind another; each is described by a map for the page."""

    def __init__(self):
        self.bytes = bytearray()

    def add(self, values, bits):
        """Whole numbers [n, columns] as differences down each column, their bytes apart."""
        values = np.asarray(values, np.int64)
        values = values.reshape(len(values), -1)
        kind = {8: "<u1", 16: "<u2", 32: "<u4"}[bits]
        steps = np.diff(values, axis=0, prepend=0).T % (1 << bits)
        begin = len(self.bytes)
        self.bytes += np.ascontiguousarray(steps, kind).view("u1").reshape(-1, bits // 8).T.tobytes()
        return {"at": begin, "rows": len(values), "columns": values.shape[1], "bits": bits}

    def numbers(self, values, bits=16):
        """Any numbers, rounded to 2^bits − 1 steps between their extremes."""
        low, high = (float(f(values)) if np.size(values) else 0.0 for f in (np.min, np.max))
        step = max((high - low) / ((1 << bits) - 1), 1e-9)
        return self.add(np.rint((values - low) / step), bits) | {"low": low, "step": step}

    def text(self):
        return base64.b64encode(zlib.compress(bytes(self.bytes), 6)).decode()
