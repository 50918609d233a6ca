"""Sequences whose garment is remeshed while it moves: the topology changes from frame to frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.dataset.sample import Sample

if TYPE_CHECKING:
    from muslin.garments.mesh import GarmentMesh


@dataclass(frozen=True, eq=False)
class RemeshedSequence(Sample):
    """A sequence of one garment whose mesh is replaced between frames.

    There is no one mesh and no array (T, V, 3): `garment` and `positions` raise InputError; `frame_garment`
    and `frame_positions` give those of a frame, as they do for every sample.

    topologies       the distinct meshes; all of one name, with the same parameters and panels
    frame_topology   (T,) int32, which of them each frame has
    frames           a frame: (V_t, 3) float32, metres
    """

    garment: GarmentMesh = field(init=False, repr=False)
    positions: np.ndarray = field(init=False, repr=False)
    topologies: tuple[GarmentMesh, ...] = field(kw_only=True)
    frame_topology: np.ndarray = field(kw_only=True)
    frames: tuple[np.ndarray, ...] = field(kw_only=True)

    def __getattr__(self, name: str) -> Any:
        # Called for what an instance lacks: the two fields of `Sample` that are never set.
        if name in ("garment", "positions"):
            raise InputError(
                f"sample {self.id}: its topology changes over time, so it has no one {name}; "
                f"use frame_{name}(frame), or a sample that was simulated without remeshing"
            )
        raise AttributeError(name)

    @property
    def num_frames(self) -> int:
        return len(self.frames)

    @property
    def garments(self) -> tuple[GarmentMesh, ...]:
        return self.topologies

    def frame_garment(self, frame: int) -> GarmentMesh:
        return self.topologies[self.frame_topology[frame]]

    def frame_positions(self, frame: int) -> np.ndarray:
        return self.frames[frame]

    def _validate_cloth(self) -> None:
        T, K = self.num_frames, len(self.topologies)
        self._require(self.kind == "sequence", f"kind {self.kind!r} with changing topology", "'sequence'")
        self._require(K > 0, "no topology", "1 or more")
        first = self.topologies[0]
        for k, mesh in enumerate(self.topologies):
            same = (mesh.name, mesh.panel_names, mesh.parameters) == (
                first.name,
                first.panel_names,
                first.parameters,
            )
            self._require(same, f"topology {k} of another garment", f"'{first.name}' as topology 0")
        self._array("frame_topology", self.frame_topology, (T,), np.int32)
        used = np.unique(self.frame_topology)
        self._require(
            np.array_equal(used, np.arange(K)),
            f"frame_topology of {used.tolist()}",
            f"of all from 0 to {K - 1}",
        )
        for frame, positions in enumerate(self.frames):
            shape = (self.frame_garment(frame).num_vertices, 3)
            self._array(f"positions in frame {frame}", positions, shape, np.float32)


def sample_of_frames(meshes: Sequence[GarmentMesh], positions: Sequence[np.ndarray], **fields: Any) -> Sample:
    """A sample from the mesh and the positions (V_t, 3), metres, of each frame.

    A `Sample` where all frames have one mesh, else a `RemeshedSequence`. Frames of one topology share one
    object `GarmentMesh`. `fields` are those of `Sample` but the cloth.
    """
    topologies = tuple({id(mesh): mesh for mesh in meshes}.values())
    stored = [np.asarray(frame, dtype=np.float32) for frame in positions]
    if len(topologies) == 1:
        return Sample(garment=topologies[0], positions=np.stack(stored), **fields)
    place = {id(mesh): k for k, mesh in enumerate(topologies)}
    return RemeshedSequence(
        topologies=topologies,
        frame_topology=np.array([place[id(mesh)] for mesh in meshes], dtype=np.int32),
        frames=tuple(stored),
        **fields,
    )
