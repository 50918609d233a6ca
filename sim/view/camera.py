"""A pinhole camera that frames what it is shown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FIELD_OF_VIEW = np.deg2rad(24.0)  # vertical, radians: a portrait lens, little distortion
MARGIN = 1.08


@dataclass(frozen=True, eq=False)
class Camera:
    """eye, target (3,), metres; up is y; field_of_view vertical, radians."""

    eye: np.ndarray
    target: np.ndarray
    field_of_view: float = float(FIELD_OF_VIEW)

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): right, up and backward unit vectors, one a row."""
        backward = self.eye - self.target
        backward = backward / np.linalg.norm(backward)
        right = np.cross([0.0, 1.0, 0.0], backward)
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(backward, right), backward])

    def directions(self, x: np.ndarray, y: np.ndarray, width: int, height: int) -> np.ndarray:
        """Unit directions through pixel positions (x right, y down, pixels); (N, 3)."""
        scale = 2.0 * np.tan(self.field_of_view / 2.0) / height
        right, up, backward = self.axes
        d = (
            ((x - width / 2.0) * scale)[:, None] * right
            - ((y - height / 2.0) * scale)[:, None] * up
            - backward
        )
        return d / np.linalg.norm(d, axis=1, keepdims=True)

    def project(self, points: np.ndarray, width: int, height: int) -> np.ndarray:
        """Pixel positions (x right, y down) of points (N, 3); (N, 2)."""
        local = (points - self.eye) @ self.axes.T
        scale = height / (2.0 * np.tan(self.field_of_view / 2.0))
        depth = -local[:, 2]
        return np.stack(
            [width / 2.0 + scale * local[:, 0] / depth, height / 2.0 - scale * local[:, 1] / depth], axis=1
        )


def frame_camera(points: np.ndarray, width: int, height: int, azimuth: float, elevation: float) -> Camera:
    """The camera that looks at a cloud of points from a direction and just holds all of it.

    points (N, 3), metres; azimuth: radians from +z towards +x; elevation: radians above the horizon.

    Every point must lie inside the four planes of the view; for a fixed direction that is linear in the
    camera's place, so the nearest place is found in closed form: along each picture axis the two extreme
    planes fix centre and distance, and the larger distance counts.
    """
    backward = np.array(
        [np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)]
    )
    axes = Camera(eye=backward, target=np.zeros(3)).axes
    local = points @ axes.T
    tangent = np.tan(FIELD_OF_VIEW / 2.0) / MARGIN
    place = np.zeros(3)
    for axis, t in ((0, tangent * width / height), (1, tangent)):
        # |u - u0| <= t (d - w) for every point, u along the axis, w backward, d the eye's distance
        low = np.min(local[:, axis] - t * local[:, 2])
        high = np.max(local[:, axis] + t * local[:, 2])
        place[axis] = (low + high) / 2.0
        place[2] = max(place[2] if axis else -np.inf, (high - low) / (2.0 * t))
    eye = place @ axes
    middle = (local[:, 2].min() + local[:, 2].max()) / 2.0
    return Camera(eye=eye, target=eye - (place[2] - middle) * axes[2])
