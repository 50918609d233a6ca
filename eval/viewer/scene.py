"""What the viewer shows: scenes of moving surfaces, the truth first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from muslin.garments.errors import InputError


@dataclass(frozen=True, eq=False)
class MovingMesh:
    """One moving surface, whose topology may change over time.

    positions   a frame: (V_t, 3), metres, y up
    faces       a frame: (F_t, 3) ints, counter-clockwise from outside; one object for frames of one topology
    values      a frame: (V_t,), not negative, such as the error of each vertex in the scene's unit; or None
    """

    positions: Sequence[np.ndarray]
    faces: Sequence[np.ndarray]
    values: Sequence[np.ndarray] | None = None

    @property
    def num_frames(self) -> int:
        return len(self.positions)

    def every(self, stride: int) -> MovingMesh:
        """Frames 0, stride, 2 stride, ..."""
        values = self.values
        return MovingMesh(
            self.positions[::stride], self.faces[::stride], None if values is None else values[::stride]
        )


@dataclass(frozen=True, eq=False)
class Scene:
    """What is compared side by side: the truth and predictions of it.

    sides     name: surface, the truth first; all of one number of frames
    fps       frames per second; None where it is not known
    body      what the cloth is worn on: a surface a frame, or one for all frames
    unit      of the sides' values
    high      value that gets the brightest colour; None: 99% of all values lie below it
    azimuth   radians from +z towards +x from which the camera looks at first
    """

    name: str
    sides: dict[str, MovingMesh]
    fps: float | None = None
    body: MovingMesh | None = None
    unit: str = "mm"
    high: float | None = None
    azimuth: float = float(np.deg2rad(22.0))

    @property
    def num_frames(self) -> int:
        return next(iter(self.sides.values())).num_frames

    def validate(self) -> Scene:
        """This scene. Raises InputError for missing or mismatched frames, and for what is not finite."""
        where = f"viewer, scene '{self.name}'"
        if not self.sides:
            raise InputError(f"{where}: no side to show; give at least the truth")
        for name, mesh in self.sides.items():
            _check(mesh, f"{where}, side '{name}'")
        counts = {name: mesh.num_frames for name, mesh in self.sides.items()}
        if len(set(counts.values())) > 1:
            raise InputError(f"{where}: sides differ in frames, {counts}; cut them to one length first")
        if self.body is not None:
            _check(self.body, f"{where}, body")
            if self.body.num_frames not in (1, self.num_frames):
                raise InputError(
                    f"{where}: the body has {self.body.num_frames} frames and the sides {self.num_frames}; "
                    "give the body one frame, or as many"
                )
        for label, value in (("fps", self.fps), ("high", self.high)):
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(f"{where}: {label} is {value}; it must be positive, or None")
        if not np.isfinite(self.azimuth):
            raise InputError(f"{where}: azimuth is {self.azimuth}; it must be finite, in radians")
        return self


def _check(mesh: MovingMesh, where: str) -> None:
    if not mesh.num_frames:
        raise InputError(f"{where}: no frame; give at least one")
    for label, entries in (("faces", mesh.faces), ("values", mesh.values)):
        if entries is not None and len(entries) != mesh.num_frames:
            raise InputError(
                f"{where}: {mesh.num_frames} frames of positions but {len(entries)} of {label}; "
                "give one of each a frame"
            )
    checked: dict[int, tuple[int, int]] = {}
    for t, (positions, faces) in enumerate(zip(mesh.positions, mesh.faces, strict=True)):
        _check_positions(positions, f"{where}, frame {t}")
        if id(faces) not in checked:
            checked[id(faces)] = _face_range(faces, f"{where}, frame {t}")
        lowest, highest = checked[id(faces)]
        if lowest < 0 or highest >= len(positions):
            raise InputError(
                f"{where}, frame {t}: faces name vertices {lowest} to {highest} of {len(positions)}; "
                "give positions and faces of one mesh"
            )
        if mesh.values is not None:
            _check_values(mesh.values[t], len(positions), f"{where}, frame {t}")


def _check_positions(positions: np.ndarray, where: str) -> None:
    shape = np.shape(positions)
    if len(shape) != 2 or shape[1] != 3 or not shape[0]:
        raise InputError(f"{where}: positions of shape {shape}; expected (V, 3) with V >= 1")
    if not np.isfinite(positions).all():
        bad = int((~np.isfinite(positions).all(axis=1)).argmax())
        raise InputError(f"{where}: vertex {bad} is not finite; leave this frame out, or repair it")


def _face_range(faces: np.ndarray, where: str) -> tuple[int, int]:
    shape = np.shape(faces)
    if len(shape) != 2 or shape[1] != 3 or not shape[0]:
        raise InputError(f"{where}: faces of shape {shape}; expected (F, 3) with F >= 1")
    if not np.issubdtype(np.asarray(faces).dtype, np.integer):
        raise InputError(f"{where}: faces of type {np.asarray(faces).dtype}; expected integers")
    return int(np.min(faces)), int(np.max(faces))


def _check_values(values: np.ndarray, num_vertices: int, where: str) -> None:
    if np.shape(values) != (num_vertices,):
        raise InputError(
            f"{where}: values of shape {np.shape(values)} for {num_vertices} vertices; give one a vertex"
        )
    if not np.isfinite(values).all() or np.min(values) < 0:
        bad = int((~(np.isfinite(values) & (np.asarray(values) >= 0))).argmax())
        raise InputError(f"{where}: value {values[bad]} of vertex {bad}; values are finite and not negative")
