"""Attitudes as arrays of unit quaternions ``(w, x, y, z)``, body to world.

Conventions: ``v_world = q ⊗ v_body ⊗ q*``; a small rotation ``φ`` in the body frame multiplies from
the right, ``q ⊗ exp(φ)``; the world's up direction is ``+z``.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray

WORLD_UP: FloatArray = np.array([0.0, 0.0, 1.0])


def rotation_quaternion(turn: FloatArray) -> FloatArray:
    """Quaternions of the rotation vectors ``turn``, rad, shape (n, 3) -> (n, 4)."""
    angle = np.sqrt((turn * turn).sum(-1, keepdims=True))
    vector = 0.5 * np.sinc(angle / (2.0 * np.pi)) * turn
    return np.concatenate([np.cos(0.5 * angle), vector], -1)


def hamilton_product(p: FloatArray, q: FloatArray) -> FloatArray:
    """Hamilton product ``p ⊗ q``; shapes (…, 4) broadcast."""
    pw, pv = p[..., :1], p[..., 1:]
    qw, qv = q[..., :1], q[..., 1:]
    scalar = pw * qw - (pv * qv).sum(-1, keepdims=True)
    return np.concatenate([scalar, pw * qv + qw * pv + cross_rows(pv, qv)], -1)


def to_world(q: FloatArray, body: FloatArray) -> FloatArray:
    """Body vectors in the world frame: ``q ⊗ v ⊗ q*``."""
    twice = 2.0 * cross_rows(q[..., 1:], body)
    return body + q[..., :1] * twice + cross_rows(q[..., 1:], twice)


def to_body(q: FloatArray, world: FloatArray) -> FloatArray:
    """World vectors in the body frame: ``q* ⊗ v ⊗ q``."""
    twice = 2.0 * cross_rows(world, q[..., 1:])
    return world + q[..., :1] * twice - cross_rows(q[..., 1:], twice)


def body_rate(turn: FloatArray, turn_rate: FloatArray) -> FloatArray:
    """Angular rate in the body frame of ``q0 ⊗ exp(φ(t))``.

    ``w = φ' − (1 − cos θ)/θ² φ×φ' + (θ − sin θ)/θ³ φ×(φ×φ')`` with ``θ = |φ|`` (the right
    Jacobian of the rotation group), exact for any ``φ``.

    Args:
        turn: ``φ``, rad, shape (n, 3).
        turn_rate: its time derivative, rad/s.
    """
    squared = (turn * turn).sum(-1, keepdims=True)
    angle = np.sqrt(squared)
    first = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    safe = np.where(angle > 0.1, angle, 1.0)
    series = 1.0 / 6.0 - squared / 120.0 + squared**2 / 5040.0
    second = np.where(angle > 0.1, (safe - np.sin(safe)) / safe**3, series)
    once = cross_rows(turn, turn_rate)
    rate: FloatArray = turn_rate - first * once + second * cross_rows(turn, once)
    return rate


def cross_rows(a: FloatArray, b: FloatArray) -> FloatArray:
    """``a × b`` along the last axis; several times faster than ``numpy.cross`` for few rows."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def shortest_rotation(now: FloatArray, wanted: FloatArray) -> FloatArray:
    """Body rotation vector after which the body direction ``wanted`` points where ``now`` did.

    The up direction in the body frame obeys ``du/dt = u × w``, so the rotation that carries it from
    ``now`` to ``wanted`` is about ``wanted × now``. If they are opposite, any axis perpendicular to
    ``now`` will do.

    Args:
        now: unit up direction in the body frame, shape (3,).
        wanted: the unit up direction to reach.

    Returns:
        Rotation vector, rad, shape (3,).
    """
    axis = cross_rows(wanted, now)
    sine = float(np.sqrt(axis @ axis))
    angle = float(np.arctan2(sine, wanted @ now))
    if sine < 1e-9:
        if angle < 1.0:
            return np.zeros(3)
        axis = cross_rows(now, np.eye(3)[int(np.argmin(np.abs(now)))])
        sine = float(np.sqrt(axis @ axis))
    return angle / sine * axis
