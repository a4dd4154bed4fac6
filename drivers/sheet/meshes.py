"""Surfaces in text for a page: made coarser where they are fine, rounded, packed and compressed.
`unpack` in drivers/web/pack.js is the inverse."""

import base64
import zlib

import numpy as np

FINER = 2.0  # so many times longer are edges where nothing moves


def coarser(points, corners, attributes, most, still=None):
    """Points, corners and attributes of the surface with at most so many triangles: vertices in one
    cell of a grid become one. `still` marks vertices that may be in larger cells."""
    if len(corners) <= most:
        return points, corners, attributes
    low, one = points.min(0), points[corners[:, 0]] - points[corners[:, 1]]
    edge = np.linalg.norm(one, axis=1).mean()
    size = np.where(still, FINER, 1.0) if still is not None else np.ones(len(points))
    while True:
        cell = np.floor((points - low) / (edge * size)[:, None]).astype(np.int64)
        key = ((cell[:, 2] << 40) + (cell[:, 1] << 20) + cell[:, 0]) * 2 + (size > 1)
        _, row, count = np.unique(key, return_inverse=True, return_counts=True)
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

    places, faces = mean(points), faces.reshape(-1, 3)
    turned = (normals(places, faces) * normals(points, origin)).sum(1) < 0
    faces[turned] = faces[turned][:, ::-1]  # by the merging of their corners
    return places, faces, [mean(values) for values in attributes]


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
