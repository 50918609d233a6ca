"""Rotations as unit quaternions, vectorised over leading axes.

A quaternion is (..., 4) float64 in the order (w, x, y, z); q and -q are the same rotation. An axis-angle
vector (..., 3) is axis times angle in radians, SMPL's form of a joint rotation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d

Array = NDArray[np.float64]

_SMALL = 1e-8


def quaternion_from_axis_angle(axis_angle: ArrayLike) -> Array:
    """q = (cos(|r|/2), sin(|r|/2) r/|r|) for r (..., 3) radians; the identity at r = 0."""
    r = np.asarray(axis_angle, dtype=np.float64)
    half = 0.5 * np.linalg.norm(r, axis=-1, keepdims=True)
    # np.sinc(x) = sin(pi x)/(pi x), so this is sin(half)/(2 half) and smooth through zero.
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * r], axis=-1)


def axis_angle_from_quaternion(quaternion: ArrayLike) -> Array:
    """r = 2 atan2(|v|, w) v/|v| for q = (w, v), of angle at most pi: the shorter of the two ways round."""
    q = np.asarray(quaternion, dtype=np.float64)
    q = np.where(q[..., :1] < 0.0, -q, q)
    length = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(length, q[..., :1])
    factor = np.where(length > _SMALL, angle / np.maximum(length, _SMALL), 2.0)
    return factor * q[..., 1:]


def matrix_from_quaternion(quaternion: ArrayLike) -> Array:
    """Rotation matrix (..., 3, 3) of a unit quaternion (..., 4); acts on column vectors."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def multiply(p: ArrayLike, q: ArrayLike) -> Array:
    """The rotation q followed by p (Hamilton product p q); (..., 4), broadcast."""
    pw, px, py, pz = np.moveaxis(np.asarray(p, dtype=np.float64), -1, 0)
    qw, qx, qy, qz = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    return np.stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ],
        axis=-1,
    )


def conjugate(quaternion: ArrayLike) -> Array:
    """The inverse rotation of a unit quaternion."""
    return np.asarray(quaternion, dtype=np.float64) * np.array([1.0, -1.0, -1.0, -1.0])


def rotate(quaternion: ArrayLike, vector: ArrayLike) -> Array:
    """v + 2 u x (u x v + w v) for q = (w, u): the vector (..., 3) turned by q, broadcast."""
    q = np.asarray(quaternion, dtype=np.float64)
    v = np.asarray(vector, dtype=np.float64)
    u = q[..., 1:]
    return v + 2.0 * np.cross(u, np.cross(u, v) + q[..., :1] * v)


def slerp(p: ArrayLike, q: ArrayLike, weight: ArrayLike) -> Array:
    """Spherical interpolation p (p^-1 q)^w along the shorter arc (Shoemake 1985).

    p, q (..., 4) unit; weight broadcast against the leading axes, 0 gives p and 1 gives q.
    """
    step = axis_angle_from_quaternion(multiply(conjugate(p), q))
    return multiply(p, quaternion_from_axis_angle(np.asarray(weight, dtype=np.float64)[..., None] * step))


def between(start: ArrayLike, end: ArrayLike) -> Array:
    """The rotation of smallest angle that turns direction `start` into direction `end`, (..., 3) each.

    q ~ (1 + a.b, a x b). Opposite directions have no unique answer: half a turn about an axis across `start`.
    """
    a = np.asarray(start, dtype=np.float64)
    b = np.asarray(end, dtype=np.float64)
    a, b = np.broadcast_arrays(
        a / np.linalg.norm(a, axis=-1, keepdims=True), b / np.linalg.norm(b, axis=-1, keepdims=True)
    )
    q = np.concatenate([1.0 + np.sum(a * b, axis=-1, keepdims=True), np.cross(a, b)], axis=-1)
    smallest = np.argmin(np.abs(a), axis=-1)
    across = np.cross(a, np.eye(3)[smallest])
    half_turn = np.concatenate([np.zeros_like(across[..., :1]), across], axis=-1)
    q = np.where(q[..., :1] < 1e-9, half_turn, q)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def about_y(angle: ArrayLike) -> Array:
    """Turn by `angle` (...) radians about the vertical axis y."""
    half = 0.5 * np.asarray(angle, dtype=np.float64)
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, np.sin(half), zero], axis=-1)


def heading(quaternion: ArrayLike) -> Array:
    """The turn about y inside q: the twist of q's swing-twist decomposition about the vertical.

    Returns the angle (...) in (-pi, pi], radians. Zero faces +z.
    """
    q = np.asarray(quaternion, dtype=np.float64)
    angle = 2.0 * np.arctan2(q[..., 2], q[..., 0])
    return np.arctan2(np.sin(angle), np.cos(angle))


def angular_speed(quaternions: ArrayLike, fps: float) -> Array:
    """|log(q_t^-1 q_{t+1})| fps for q (T, ..., 4): (T - 1, ...) radians per second."""
    q = np.asarray(quaternions, dtype=np.float64)
    return np.linalg.norm(axis_angle_from_quaternion(multiply(conjugate(q[:-1]), q[1:])), axis=-1) * fps


def smooth(quaternions: ArrayLike, width: float) -> Array:
    """Low-pass along the first axis: Gaussian mean of q (T, ..., 4) with standard deviation `width` frames.

    The mean of nearby rotations is the normalised sum of their sign-aligned quaternions (Markley 2007 to
    second order in their spread). Ends are extended by their own value.
    """
    q = aligned(quaternions)
    q = gaussian_filter1d(q, width, axis=0, mode="nearest")
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def aligned(quaternions: ArrayLike) -> Array:
    """The same rotations (T, ..., 4) with signs chosen so that neighbours in time never point apart."""
    q = np.array(quaternions, dtype=np.float64)
    flips = np.sum(q[1:] * q[:-1], axis=-1) < 0.0
    q[1:] *= np.where(np.cumsum(flips, axis=0) % 2 == 1, -1.0, 1.0)[..., None]
    return q


def smoothstep(x: ArrayLike) -> Array:
    """3 x^2 - 2 x^3 on [0, 1], clamped: value and slope meet 0 and 1 with zero speed."""
    t = np.clip(np.asarray(x, dtype=np.float64), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
