"""What every contender is given: one garment at rest on a body, and where that body goes.

Read by contenders in environments of their own, so this file needs numpy alone.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

DT = 1.0 / 60.0
"""Seconds between two frames of the body."""


@dataclass(frozen=True, eq=False)
class Setting:
    """A garment of V vertices and F faces on a body of N vertices and M faces over T + 1 frames, SI units.

    `positions` (V, 3): the cloth at rest on frame 0 of the body; `faces` (F, 3).
    `panel_vertices` (P, 2), `panel_faces` (F, 3): the same triangles unstrained, weft along x, warp along y.
    `free_positions` (V, 3): the cloth nearly unstrained in space, without gravity and body; for simulators
    that take rest lengths from a shape in space.
    `mass` (V,) kg.
    `body` (T + 1, N, 3), `body_faces` (M, 3).
    `hidden` (T + 1, M) bool: faces within the body itself, which the judge leaves out for all alike.
    `density` kg/m^2; `stretch` (4,) N/m [c11, c12, c22, c33] and `bend` (3,) N m, of hinges along 0, 45 and
    90 degrees to the warp, at rest, as in `muslin.sim.material`; `friction` of cloth on body and on cloth.
    """

    positions: NDArray[np.float64]
    faces: NDArray[np.int32]
    panel_vertices: NDArray[np.float64]
    panel_faces: NDArray[np.int32]
    free_positions: NDArray[np.float64]
    mass: NDArray[np.float64]
    body: NDArray[np.float64]
    body_faces: NDArray[np.int32]
    hidden: NDArray[np.bool_]
    density: NDArray[np.float64]
    stretch: NDArray[np.float64]
    bend: NDArray[np.float64]
    friction: NDArray[np.float64]

    @property
    def frames(self) -> int:
        """Frames T that follow the first."""
        return len(self.body) - 1

    def save(self, path: Path) -> None:
        """Write a .npz file, and the folder for it."""
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(path, **{field.name: getattr(self, field.name) for field in fields(self)})


def load_setting(path: Path, frames: int | None = None) -> Setting:
    """Read a setting, or its first `frames` frames; ValueError if it has fewer."""
    with np.load(path, allow_pickle=False) as archive:
        arrays = {field.name: archive[field.name] for field in fields(Setting)}
    last = len(arrays["body"]) - 1
    if frames is not None:
        if not 1 <= frames <= last:
            raise ValueError(f"frames = {frames}: {path} holds 1 to {last}; make a longer one")
        for name in ("body", "hidden"):
            arrays[name] = arrays[name][: frames + 1]
    return Setting(**arrays)
