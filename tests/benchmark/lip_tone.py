"""A tone of the ring muscle of the mouth (orbicularis oris) in a model file, for ratios.py.

The muscle fills the ellipse about the line between the lips that reaches from subnasale to B′ and 10 mm
beyond the corners of the mouth. Its fibers f run along the lips and turn round their corners. A stress
σ(1 − ρ²), with ρ 0 on that line and 1 on the ellipse, adds ½ σ(1 − ρ²) |F f|² to the energy. Constant
forces balance it at the recorded shape, in place of teeth and of the muscles beyond the corners."""

import h5py
import numpy as np

BEYOND = 10  # mm, of the muscle's ends from the corners of the mouth
BEHIND = 40  # mm, from stomion, where it ends
PAIRS = [(i, j) for i in range(6) for j in range(i + 1, 6)]
IN_TRIANGLE = ((1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3))


def shape_slopes(xi, eta, zeta):
    """Derivatives of a wedge's shape functions by its own coordinates, [3, 6]."""
    within, by_xi, by_eta = (1 - xi - eta, xi, eta), (-1, 1, 0), (-1, 0, 1)
    upper = [[by_xi[i] * (1 - zeta), by_eta[i] * (1 - zeta), -within[i]] for i in range(3)]
    lower = [[by_xi[i] * zeta, by_eta[i] * zeta, within[i]] for i in range(3)]
    return np.transpose(upper + lower)


def fibers(corners, landmarks):
    """Unit directions of the fibers, [n, 3], and 1 − ρ², 0 outside, [n], of prisms with corners
    [n, 6, 3] in mm."""
    right, left, stomion = (landmarks[name] for name in ("mouth_right", "mouth_left", "stomion"))
    middle, half = corners.mean(axis=1), (left[0] - right[0]) / 2
    x = middle[:, 0] - (left[0] + right[0]) / 2
    corner = np.where(x < 0, right[2], left[2])
    z = middle[:, 2] - stomion[2] - np.clip(abs(x) / half, 0, 1) * (corner - stomion[2])
    height = np.where(z > 0, landmarks["subnasale"][2] - stomion[2],
                      stomion[2] - landmarks["b_soft"][2])
    share = 1 - (x / (half + BEYOND)) ** 2 - (z / height) ** 2
    share[middle[:, 1] > stomion[1] + BEHIND] = 0
    straight = 0.8 * half  # where fibers do not turn yet
    turn = np.maximum(abs(x) - straight, 0) * np.sign(x) / (half + BEYOND - straight) ** 2
    along = np.column_stack([np.where(turn == 0, 1, -z / height ** 2), 0 * x, turn])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    along -= (along * normal).sum(axis=1)[:, None] * normal
    return along / np.linalg.norm(along, axis=1)[:, None], np.clip(share, 0, 1)


def pair_weights(corners, along):
    """−∫ (∇N_i · f)(∇N_j · f) dV of each prism by PAIRS, mm, [n, 15]."""
    half, weights = 0.5 / np.sqrt(3), np.zeros((len(corners), len(PAIRS)))
    first, second = np.transpose(PAIRS)
    for xi, eta in IN_TRIANGLE:
        for zeta in (0.5 - half, 0.5 + half):
            local = shape_slopes(xi, eta, zeta)
            mapped = np.einsum("nia,bi->nab", corners, local)
            slopes = np.einsum("nba,bi,na->ni", np.linalg.inv(mapped), local, along)
            weights -= np.linalg.det(mapped)[:, None] / 12 * slopes[:, first] * slopes[:, second]
    return weights


def add_tone(source, file, landmarks, stress):
    """Writes the model of the result `source` as the model `file`, with a tone of `stress` N/mm².
    Returns the mean pressure, N/mm², with which it draws the front of the lower lip back."""
    with h5py.File(source) as result, h5py.File(file, "w") as h5:
        h5.attrs.update(format=np.bytes_("tissue-model"), version=1)
        result.copy("model", h5)
        model = h5["model"]
        position, prisms = model["point/position"][:], model["prism/points"][:]
        along, share = fibers(position[prisms], landmarks)
        prisms, along, share = (values[share > 0] for values in (prisms, along, share))
        weights = stress * share[:, None] * pair_weights(position[prisms], along)
        ends = np.sort(prisms[:, PAIRS].reshape(-1, 2), axis=1)
        edges = np.sort(model["edge/points"][:], axis=1)
        count = len(position)
        key = edges @ [count, 1]
        order = np.argsort(key)
        found = order[np.searchsorted(key[order], ends @ [count, 1])]
        added = np.bincount(found, weights.ravel(), len(edges))
        model["edge/weight"][:] = model["edge/weight"][:] + added
        pull = added[:, None] * (position[edges[:, 1]] - position[edges[:, 0]])
        force = np.zeros_like(position)
        np.add.at(force, edges[:, 0], pull)
        np.add.at(force, edges[:, 1], -pull)
        force[model["point/set"][:] != 0] = 0
        model["point/external_force"][:] = model["point/external_force"][:] - force
        return lip_pressure(position, force, landmarks)


def lip_pressure(position, force, landmarks):
    """Force to the back on the lower lip between the corners, over its area seen from the front."""
    right, left, stomion, low = (landmarks[name] for name in
                                 ("mouth_right", "mouth_left", "stomion", "b_soft"))
    front = np.abs(position[:, 0] - (left[0] + right[0]) / 2) < (left[0] - right[0]) / 4
    front &= (position[:, 2] < stomion[2]) & (position[:, 2] > low[2])
    front &= position[:, 1] < stomion[1] + BEHIND
    return force[front, 1].sum() / ((left[0] - right[0]) / 2 * (stomion[2] - low[2]))
