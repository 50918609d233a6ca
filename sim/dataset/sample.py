"""One drape or one sequence in memory: cloth, body and certificate."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.dataset.certificate import Certificate

if TYPE_CHECKING:
    from muslin.garments.mesh import GarmentMesh
    from muslin.sim.body.model import BodyModel

Kind = Literal["drape", "sequence"]


@dataclass(frozen=True, eq=False)
class BodyTrack:
    """A parametric body in every frame: enough to compute its vertices again.

    model          name or path given to `muslin.sim.body.load_body`
    digest         sha256 of the model's arrays (`BodyModel.digest`)
    beta           (n,) float64, standard deviations
    poses          (T, 24, 3) float64, axis-angle, radians
    translations   (T, 3) float64, metres
    """

    model: str
    digest: str
    beta: np.ndarray
    poses: np.ndarray
    translations: np.ndarray


@dataclass(frozen=True, eq=False)
class Sample:
    """One garment on one body: a drape (T = 1) or a sequence of T frames.

    What works for a sequence whose mesh is replaced between frames too (`RemeshedSequence`) reads the cloth
    through `frame_garment` and `frame_positions` instead of `garment` and `positions`.

    What the cloth lies on is either `body` or, for other colliders (a sphere, a scan), `obstacle_vertices`
    with `obstacle_faces`; with neither, the cloth is alone.

    id                  unique in its dataset; letters, digits, `-` and `_`
    positions           (T, V, 3) float32, metres
    fps                 frames per second of a sequence, None for a drape
    obstacle_vertices   (T, N, 3), or (1, N, 3) if it stands still, float32, metres
    obstacle_faces      (M, 3) int32
    masked_faces        a frame: int32 indices of body faces, between parts of it, that cloth crosses; or ()
    labels              what splits and tables go by: {"design": …, "shape": …, "sequence": …, "split": …}
    scene               the scene it was made from, as JSON values
    """

    id: str
    kind: Kind
    garment: GarmentMesh
    positions: np.ndarray
    certificate: Certificate
    fps: float | None = None
    body: BodyTrack | None = None
    obstacle_vertices: np.ndarray | None = None
    obstacle_faces: np.ndarray | None = None
    masked_faces: tuple[np.ndarray, ...] = ()
    fabric: str = ""
    scene: dict[str, Any] = field(default_factory=dict)
    seed: int = 0
    labels: dict[str, str] = field(default_factory=dict)

    @property
    def num_frames(self) -> int:
        return len(self.positions)

    @property
    def garments(self) -> tuple[GarmentMesh, ...]:
        """The distinct meshes of the garment: one, but in a `RemeshedSequence`."""
        return (self.garment,)

    def frame_garment(self, frame: int) -> GarmentMesh:
        """The mesh of the garment in a frame; the same object in every frame of one topology."""
        return self.garment

    def frame_positions(self, frame: int) -> np.ndarray:
        """(V_t, 3) float32 positions of the vertices of `frame_garment(frame)`, metres."""
        return self.positions[frame]

    @property
    def num_vertices(self) -> int:
        """Cloth vertices; the most of any frame where the topology changes."""
        return max(garment.num_vertices for garment in self.garments)

    @property
    def times(self) -> np.ndarray:
        """(T,) float64, seconds from the first frame."""
        return np.arange(self.num_frames) / (self.fps or 1.0)

    @property
    def body_faces(self) -> np.ndarray:
        """(M, 3) int32 faces of the body or obstacle; (0, 3) without one."""
        if self.body is not None:
            return body_model(self.body).faces
        if self.obstacle_faces is not None:
            return self.obstacle_faces
        return np.zeros((0, 3), dtype=np.int32)

    def body_vertices(self, frame: int) -> np.ndarray:
        """(N, 3) float64 vertices of the body or obstacle in a frame, metres; (0, 3) without one.

        A body is computed from its model, so this raises InputError if the model is missing or is not the one
        that the sample was made with.
        """
        frame = range(self.num_frames)[frame]
        if self.body is not None:
            track = self.body
            return body_model(track).vertices(track.beta, track.poses[frame], track.translations[frame])
        if self.obstacle_vertices is not None:
            still = len(self.obstacle_vertices) == 1
            return self.obstacle_vertices[0 if still else frame].astype(np.float64)
        return np.zeros((0, 3))

    def masked(self, frame: int) -> np.ndarray:
        """Indices (int32) of the collider's faces left out of contact in a frame."""
        frame = range(self.num_frames)[frame]
        return self.masked_faces[frame] if self.masked_faces else np.zeros(0, dtype=np.int32)

    def validate(self) -> Sample:
        """Raise InputError naming the first array whose shape, type or values cannot be; return self."""
        T = self.num_frames
        named = bool(self.id) and all(c.isascii() and (c.isalnum() or c in "-_") for c in self.id)
        self._require(named, f"id {self.id!r}", "of letters, digits, - and _")
        self._require(self.kind in ("drape", "sequence"), f"kind {self.kind!r}", "'drape' or 'sequence'")
        self._require(T == 1 or (self.kind == "sequence" and T > 1), f"{T} frames", "1 in a drape, 1 or more")
        if self.kind == "sequence":
            positive = self.fps is not None and 0 < self.fps < np.inf
            self._require(positive, f"fps = {self.fps}", "a positive number in a sequence")
        self._validate_cloth()
        if self.body is not None:
            self._require(self.obstacle_vertices is None, "obstacle_vertices beside body", "one of the two")
            self._array("body.beta", self.body.beta, (None,), np.float64)
            self._array("body.poses", self.body.poses, (T, 24, 3), np.float64)
            self._array("body.translations", self.body.translations, (T, 3), np.float64)
        self._validate_obstacle()
        masked = len(self.masked_faces)
        self._require(masked in (0, T), f"{masked} frames of masked_faces", f"{T}, or none")
        for indices in self.masked_faces:
            self._array("masked_faces", indices, (None,), np.int32)
        return self

    def _validate_cloth(self) -> None:
        shape = (self.num_frames, self.garment.num_vertices, 3)
        self._array("positions", self.positions, shape, np.float32)

    def _validate_obstacle(self) -> None:
        vertices, faces = self.obstacle_vertices, self.obstacle_faces
        if vertices is None and faces is None:
            return
        if vertices is None or faces is None:
            raise InputError(f"sample {self.id}: obstacle_vertices and obstacle_faces must be given together")
        self._array(
            "obstacle_vertices", vertices, (self.num_frames if len(vertices) > 1 else 1, None, 3), np.float32
        )
        self._array("obstacle_faces", faces, (None, 3), np.int32)
        inside = faces.size == 0 or (faces.min() >= 0 and faces.max() < vertices.shape[1])
        self._require(inside, "an index in obstacle_faces", f"0 to {vertices.shape[1] - 1}")

    def _require(self, holds: bool, what: str, allowed: str) -> None:
        if not holds:
            raise InputError(f"sample {self.id}: {what} is not allowed; it must be {allowed}")

    def _array(self, name: str, array: np.ndarray, shape: tuple[int | None, ...], dtype: type) -> None:
        fits = array.ndim == len(shape) and all(
            n is None or n == m for n, m in zip(shape, array.shape, strict=True)
        )
        wanted = tuple("any" if n is None else n for n in shape)
        self._require(fits, f"{name} of shape {array.shape}", f"of shape {wanted}")
        self._require(array.dtype == dtype, f"{name} of type {array.dtype}", np.dtype(dtype).name)
        if array.dtype.kind == "f":
            self._require(bool(np.isfinite(array).all()), f"NaN or infinity in {name}", "finite everywhere")


@lru_cache(maxsize=4)
def _load(model: str) -> BodyModel:
    from muslin.sim.body import load_body

    return load_body(model)


def body_model(track: BodyTrack) -> BodyModel:
    """The body model of a track. Raises InputError if its digest is not the track's."""
    model = _load(track.model)
    if model.digest != track.digest:
        raise InputError(
            f"body model {track.model!r} has digest {model.digest[:12]}…, but the sample was made with "
            f"{track.digest[:12]}…; give the model file that it was made with"
        )
    return model
