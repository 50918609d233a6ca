"""A motion: poses and translations of SMPL's 24 joints over time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.garments.errors import InputError
from muslin.sim.motion.rotations import (
    angular_speed,
    axis_angle_from_quaternion,
    multiply,
    quaternion_from_axis_angle,
    rotate,
    slerp,
)
from muslin.sim.motion.skeleton import MIRRORED

Array = NDArray[np.float64]

_FRAME_SLACK = 1e-6  # of a frame: times that come from decimal fractions still hit their frame


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses of a body over time, y up, ground at y = 0.

    name            clip name, for people and file names
    poses           (T, 24, 3) axis-angle of each SMPL joint relative to its parent, radians
    translations    (T, 3) metres, SMPL's: added after the root has turned about the rest pelvis
    fps             frames per second
    source          where the motion came from and what was done to it
    rest_pelvis     (3,) rest pelvis of the body the translations are for; the pelvis of frame t is
                    at rest_pelvis + translations[t]. `fit_to_body` changes it.
    """

    name: str
    poses: Array
    translations: Array
    fps: float
    source: str
    rest_pelvis: Array

    def __init__(
        self,
        name: str,
        poses: ArrayLike,
        translations: ArrayLike,
        fps: float,
        source: str,
        rest_pelvis: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        arrays = {
            "poses": np.array(poses, dtype=np.float64),
            "translations": np.array(translations, dtype=np.float64),
            "rest_pelvis": np.array(rest_pelvis, dtype=np.float64),
        }
        frames = arrays["poses"].shape[0] if arrays["poses"].ndim else 0
        for key, shape in [("poses", (frames, 24, 3)), ("translations", (frames, 3)), ("rest_pelvis", (3,))]:
            if arrays[key].shape != shape or frames == 0:
                raise InputError(
                    f"motion {name!r}: {key} has shape {arrays[key].shape}; allowed are poses (T, 24, 3) and "
                    f"translations (T, 3) of the same T >= 1 frames"
                )
            if not np.isfinite(arrays[key]).all():
                frame = int(np.argwhere(~np.isfinite(arrays[key]))[0, 0])
                raise InputError(
                    f"motion {name!r}: {key} holds NaN or inf at frame {frame}; every value must be finite: "
                    f"cut that part out of the file"
                )
            arrays[key].setflags(write=False)
            object.__setattr__(self, key, arrays[key])
        if not (np.isfinite(fps) and fps > 0.0):
            raise InputError(
                f"motion {name!r}: fps is {fps}; it must be a positive number of frames a second"
            )
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "fps", float(fps))
        object.__setattr__(self, "source", source)

    @property
    def num_frames(self) -> int:
        return len(self.poses)

    @property
    def duration(self) -> float:
        """Seconds from the first to the last frame."""
        return (self.num_frames - 1) / self.fps

    @property
    def quaternions(self) -> Array:
        """(T, 24, 4) unit quaternions (w, x, y, z) of the poses."""
        return quaternion_from_axis_angle(self.poses)

    @property
    def pelvis(self) -> Array:
        """(T, 3) world positions of the pelvis, metres."""
        return self.rest_pelvis + self.translations

    def max_joint_speed(self) -> float:
        """Largest angular speed of any joint relative to its parent, radians per second."""
        if self.num_frames == 1:
            return 0.0
        return float(angular_speed(self.quaternions, self.fps).max())

    def at(self, times: ArrayLike) -> tuple[Array, Array]:
        """Poses (n, 24, 3) and translations (n, 3) at `times` (n,) seconds from the first frame.

        Quaternion slerp and linear interpolation between the two frames around; the clip's ends outside.
        """
        place = np.clip(np.asarray(times, dtype=np.float64) * self.fps, 0.0, self.num_frames - 1)
        nearest = np.round(place)
        place = np.where(np.abs(place - nearest) < _FRAME_SLACK, nearest, place)
        before = np.minimum(place.astype(int), max(self.num_frames - 2, 0))
        after = np.minimum(before + 1, self.num_frames - 1)
        weight = place - before
        q = self.quaternions
        poses = axis_angle_from_quaternion(slerp(q[before], q[after], weight[:, None]))
        # Frames that are hit exactly stay as they were, to the last bit.
        poses = np.where((weight == 0.0)[:, None, None], self.poses[before], poses)
        poses = np.where((weight == 1.0)[:, None, None], self.poses[after], poses)
        weight = weight[:, None]
        return poses, (1.0 - weight) * self.translations[before] + weight * self.translations[after]

    def resample(self, fps: float) -> Motion:
        """The same motion at another frame rate, by slerp; starts at the same frame, ends within a frame."""
        if not (np.isfinite(fps) and fps > 0.0):
            raise InputError(f"motion {self.name!r}: cannot resample to fps {fps}; it must be positive")
        if fps == self.fps:
            return self
        frames = int(np.floor(self.duration * fps + _FRAME_SLACK)) + 1
        poses, translations = self.at(np.arange(frames) / fps)
        return self.with_frames(
            poses, translations, fps=fps, did=f"resampled from {self.fps:g} to {fps:g} fps"
        )

    def clip(self, start: float, end: float) -> Motion:
        """The frames from `start` to `end` seconds, both included."""
        if not (0.0 <= start <= end <= self.duration + 0.5 / self.fps):
            raise InputError(
                f"motion {self.name!r}: cannot clip from {start} to {end} s; allowed is "
                f"0 <= start <= end <= {self.duration:.3f}, the clip's length"
            )
        first = int(np.ceil(start * self.fps - _FRAME_SLACK))
        last = min(int(np.floor(end * self.fps + _FRAME_SLACK)), self.num_frames - 1)
        if last < first:
            raise InputError(
                f"motion {self.name!r}: no frame lies between {start} and {end} s at {self.fps:g} fps; "
                f"widen the range to at least one frame"
            )
        keep = slice(first, last + 1)
        return self.with_frames(
            self.poses[keep], self.translations[keep], did=f"clipped to {start:g}-{end:g} s"
        )

    def mirror(self) -> Motion:
        """Left and right exchanged: the reflection x -> -x of space.

        Under the reflection M = diag(-1, 1, 1) a rotation R becomes M R M, whose axis-angle is
        (r_x, -r_y, -r_z), and the joints of a pair change places.
        """
        poses = self.poses[:, list(MIRRORED)] * np.array([1.0, -1.0, -1.0])
        translations = self.pelvis * np.array([-1.0, 1.0, 1.0]) - self.rest_pelvis
        return self.with_frames(poses, translations, name=f"{self.name}_mirrored", did="mirrored")

    def moved(self, turn: float = 0.0, shift: ArrayLike = (0.0, 0.0, 0.0)) -> Motion:
        """Turned about the world's vertical axis by `turn` radians, then shifted by `shift` (3,) metres."""
        half = quaternion_from_axis_angle(np.array([0.0, turn, 0.0]))
        poses = self.poses.copy()
        poses[:, 0] = axis_angle_from_quaternion(multiply(half, self.quaternions[:, 0]))
        pelvis = rotate(half, self.pelvis) + np.asarray(shift, dtype=np.float64)
        return self.with_frames(poses, pelvis - self.rest_pelvis)

    def with_frames(
        self,
        poses: Array,
        translations: Array,
        *,
        fps: float | None = None,
        name: str | None = None,
        did: str | None = None,
    ) -> Motion:
        """This motion with other frames, and what was done to them added to its provenance."""
        return replace(
            self,
            name=name or self.name,
            poses=poses,
            translations=translations,
            fps=fps or self.fps,
            source=self.source if did is None else f"{self.source}; {did}",
        )
