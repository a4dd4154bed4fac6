"""Rigid motions of a piece: a 4×4 matrix, or translation (mm) and rotation vector (degrees) about its
centroid."""

import numpy as np

RIGID = 1e-4  # that a matrix may miss an orthogonal one by


def cross_matrix(axis):
    x, y, z = axis
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)


def matrix_of(motion, centroid):
    """The 4×4 matrix of a motion {"translate", "rotate"}."""
    vector = np.radians(motion.get("rotate", (0, 0, 0)))
    angle = np.linalg.norm(vector)
    turn = np.eye(3)
    if angle > 0:
        cross = cross_matrix(vector / angle)
        turn = turn + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    matrix[:3, 3] = centroid - turn @ centroid + motion.get("translate", (0, 0, 0))
    return matrix


def motion_of(matrix, centroid):
    """The motion of a 4×4 matrix. ValueError where the matrix scales, shears, mirrors or is not finite."""
    matrix = np.asarray(matrix, float)
    if not np.isfinite(matrix).all():
        raise ValueError("the transform has a number that is not finite; reset it")
    turn = matrix[:3, :3]
    if np.abs(turn.T @ turn - np.eye(3)).max() > RIGID or np.linalg.det(turn) < 0:
        raise ValueError("the transform scales, shears or mirrors; it may only move and turn")
    cosine = (np.trace(turn) - 1) / 2
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, cosine)
    if cosine < -0.99:
        raise ValueError(f"the transform turns by {np.degrees(angle):.0f}°; turn it by less than 170°")
    vector = axis * (angle / sine if sine > 1e-12 else 1)
    translate = turn @ centroid + matrix[:3, 3] - centroid
    return {"translate": translate.tolist(), "rotate": np.degrees(vector).tolist()}
