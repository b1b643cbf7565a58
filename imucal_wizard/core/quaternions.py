"""Vectors, rotation matrices and unit quaternions, vectorised.

Components are along the first axis, (3, n) and (4, n), so that each component is contiguous.
"""

import itertools
import math

import numpy as np

from imucal_wizard.core.readings import FloatArray


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the first axis (faster than NumPy's for many short vectors)."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


def quaternions(phi: FloatArray) -> FloatArray:
    """Unit quaternions (w, x, y, z) of rotation vectors (3, n), shape (4, n)."""
    half = 0.5 * np.sqrt(phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2])
    out = np.empty((4, *phi.shape[1:]))
    out[0] = np.cos(half)
    out[1:] = 0.5 * np.sinc(half / np.pi) * phi
    return out


def multiply(p: FloatArray, q: FloatArray) -> FloatArray:
    """Hamilton product along the first axis, shape (4, …)."""
    out = np.empty(np.broadcast_shapes(p.shape, q.shape))
    out[0] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3]
    out[1] = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2]
    out[2] = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1]
    out[3] = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]
    return out


def matrices(q: FloatArray) -> FloatArray:
    """Rotation matrices (body to world) of unit quaternions (4, …), shape (3, 3, …).

    For a quaternion of another norm the result is the rotation times the squared norm.
    """
    return matrices_of(products(q))


def products(q: FloatArray) -> FloatArray:
    """Products of the components of quaternions (4, …), in which matrices are linear, (10, …)."""
    w, x, y, z = q
    out = np.empty((10, *q.shape[1:]))
    np.multiply(q, q, out=out[:4])
    np.multiply(x, y, out=out[4])
    np.multiply(x, z, out=out[5])
    np.multiply(y, z, out=out[6])
    np.multiply(q[1:], w, out=out[7:])
    return out


def matrices_of(products: FloatArray) -> FloatArray:
    """Rotation matrices of ``products``, or of sums of them, shape (3, 3, …)."""
    ww, xx, yy, zz, xy, xz, yz, wx, wy, wz = products
    out = np.empty((3, 3, *products.shape[1:]))
    out[0, 0] = ww + xx - yy - zz
    out[1, 1] = ww - xx + yy - zz
    out[2, 2] = ww - xx - yy + zz
    out[0, 1], out[1, 0] = 2.0 * (xy - wz), 2.0 * (xy + wz)
    out[0, 2], out[2, 0] = 2.0 * (xz + wy), 2.0 * (xz - wy)
    out[1, 2], out[2, 1] = 2.0 * (yz - wx), 2.0 * (yz + wx)
    return out


def carried_back(q: FloatArray, vectors: FloatArray) -> FloatArray:
    """``Cᵀ u`` with C the rotations of unit quaternions (4, n), of vectors (3, n), shape (3, n)."""
    turn = 2.0 * cross(vectors, q[1:])
    return np.asarray(vectors + q[0] * turn + cross(turn, q[1:]))


def rotation_matrix(vector: FloatArray) -> FloatArray:
    """Rotation matrix of a rotation vector, rad, shape (3, 3).

    The bits of ``matrices`` of ``quaternions``; for one vector, numbers are faster than arrays.
    """
    px, py, pz = vector.tolist()
    half = 0.5 * math.sqrt(px * px + py * py + pz * pz)
    inside = math.pi * (half / math.pi)
    # NumPy's functions: those of the C library may differ from them in the last bit
    w = float(np.cos(half))
    share = 0.5 * (float(np.sin(inside)) / inside if inside else 1.0)
    x, y, z = share * px, share * py, share * pz
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, x * w, y * w, z * w
    return np.array(
        [
            [ww + xx - yy - zz, 2.0 * (xy - wz), 2.0 * (xz + wy)],
            [2.0 * (xy + wz), ww - xx + yy - zz, 2.0 * (yz - wx)],
            [2.0 * (xz - wy), 2.0 * (yz + wx), ww - xx - yy + zz],
        ]
    )


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """The rotation vector of a rotation matrix, rad, shape (3,)."""
    sine = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    size = float(np.linalg.norm(sine))
    angle = float(np.arctan2(size, 0.5 * (np.trace(rotation) - 1.0)))
    if size > 1e-9:
        return np.asarray(sine * (angle / size))
    if angle < 1.0:
        return sine
    # half a turn: the axis is the column of R + 1 that is longest
    columns = rotation + np.eye(3)
    longest = columns[:, np.argmax(np.diag(columns))]
    return np.asarray(np.pi * longest / np.linalg.norm(longest))


def quarter_turns() -> list[FloatArray]:
    """The 24 rotations that bring axes onto axes."""
    out = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0.0:
                out.append(matrix)
    return out
