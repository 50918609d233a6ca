"""New motion from seen poses: a smooth random walk in their principal components, inside joint limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline

from muslin.garments.errors import InputError
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.rotations import axis_angle_from_quaternion, quaternion_from_axis_angle

Array = NDArray[np.float64]

_COORDINATES = 69  # 23 joints below the root


@dataclass(frozen=True, eq=False)
class PoseSpace:
    """Principal components of seen poses, root left out: x = mean + components^T (scales c).

    mean          (69,) radians, axis-angle of the 23 joints
    components    (K, 69) orthonormal rows
    scales        (K,) standard deviation of the poses along each row, radians
    low, high     (69,) joint limits: the smallest and largest value seen of each coordinate
    source        whose poses these are
    """

    mean: Array
    components: Array
    scales: Array
    low: Array
    high: Array
    source: str

    @classmethod
    def of(cls, motions: Sequence[Motion], variance: float = 0.95) -> PoseSpace:
        """The fewest components that explain `variance` of the poses of `motions`, at least one."""
        if not motions or not 0.0 < variance <= 1.0:
            raise InputError(
                f"pose space of {len(motions)} motions, variance {variance}; need >= 1, in (0, 1]"
            )
        seen = np.concatenate([seen_coordinates(motion.poses) for motion in motions])
        if len(seen) < 2:
            raise InputError("pose space of one pose; at least two frames are needed")
        mean = seen.mean(axis=0)
        _, singular, rows = np.linalg.svd(seen - mean, full_matrices=False)
        explained = np.cumsum(singular**2) / max(np.sum(singular**2), np.finfo(float).tiny)
        keep = min(int(np.searchsorted(explained, variance)) + 1, len(rows))
        scales = singular[:keep] / np.sqrt(len(seen) - 1)
        # The sign of a component is arbitrary; fix it, so that a seed means the same on every machine.
        signs = np.sign(rows[np.arange(keep), np.argmax(np.abs(rows[:keep]), axis=1)])
        source = " + ".join(f"[{motion.source}]" for motion in motions)
        return cls(mean, rows[:keep] * signs[:, None], scales, seen.min(axis=0), seen.max(axis=0), source)

    def poses(self, coefficients: ArrayLike) -> Array:
        """(n, 69) coordinates of coefficients (n, K) in standard deviations, held inside the limits."""
        x = self.mean + (np.asarray(coefficients, dtype=np.float64) * self.scales) @ self.components
        return np.clip(x, self.low, self.high)


def seen_coordinates(poses: ArrayLike) -> Array:
    """(T, 69) coordinates of poses (T, 24, 3): the shorter axis-angle of each joint below the root."""
    q = quaternion_from_axis_angle(np.asarray(poses, dtype=np.float64)[:, 1:])
    return axis_angle_from_quaternion(q).reshape(-1, _COORDINATES)


def random_walk(
    space: PoseSpace,
    seconds: float,
    fps: float,
    seed: int,
    *,
    stride: float = 0.6,
    memory: float = 0.5,
    spread: float = 1.0,
    translation: ArrayLike = (0.0, 0.0, 0.0),
) -> Motion:
    """A motion on the spot, root upright and facing +z, that wanders through `space`.

    Coefficients every `stride` seconds follow c_{k+1} = memory c_k + spread sqrt(1 - memory^2) e_k with
    e_k ~ N(0, 1), so c ~ N(0, spread^2); their poses, held inside the limits, are the control points of a
    uniform cubic B-spline. The spline is C2 and stays in the convex hull of its control points, hence inside
    the limits too.
    """
    if not (seconds >= 0.0 and fps > 0.0 and stride > 0.0 and 0.0 <= memory < 1.0 and spread >= 0.0):
        raise InputError(
            f"random_walk: seconds {seconds}, fps {fps}, stride {stride}, memory {memory}, spread {spread}; "
            f"allowed are >= 0, > 0, > 0, [0, 1), >= 0"
        )
    rng = np.random.default_rng(seed)
    count = int(np.ceil(seconds / stride)) + 4
    noise = rng.standard_normal((count, len(space.scales)))
    coefficients = np.empty_like(noise)
    coefficients[0] = spread * noise[0]
    for k in range(1, count):
        coefficients[k] = memory * coefficients[k - 1] + spread * np.sqrt(1.0 - memory**2) * noise[k]
    spline = BSpline(np.arange(-3, count + 1) * stride, space.poses(coefficients), 3)
    times = np.arange(int(np.floor(seconds * fps + 1e-6)) + 1) / fps
    poses = np.zeros((len(times), 24, 3))
    poses[:, 1:] = np.clip(spline(times), space.low, space.high).reshape(-1, 23, 3)
    how = f"seed {seed}, stride {stride:g} s, memory {memory:g}, spread {spread:g}"
    source = f"random walk ({how}) among {space.source}"
    return Motion(f"random_walk_{seed}", poses, np.tile(translation, (len(times), 1)), fps, source)
