"""Samples on other triangulations of their garment: the `[topology]` of a scene."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.certify import certify_rounded
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.sample import Sample
from muslin.sim.remesh.fit import Projection, transfer_error
from muslin.sim.remesh.topology import Remeshed, remesh
from muslin.sim.remesh.untangle import untangle
from muslin.sim.scene import Scene, TopologyTable
from muslin.sim.solve.errors import SimulationError

Array = NDArray[np.float64]


def simulated(scene: Scene) -> Scene:
    """The scene that is simulated for this one: without a topology that is fitted to the result."""
    fitted = scene.topology is not None and scene.topology.fit
    return scene.model_copy(update={"topology": None}) if fitted else scene


def same_simulation(scene: Scene, other: Scene) -> bool:
    """Whether both scenes are results of one simulation."""
    own = {"name": "scene", "seed": 0, "expect": None}
    return simulated(scene).model_copy(update=own) == simulated(other).model_copy(update=own)


def retriangulated(mesh: GarmentMesh, table: TopologyTable) -> Remeshed:
    """The topology of a garment, its vertices nowhere yet: a function of its panels and the table alone.

    Raises InputError if the distortion asked for is not reached.
    """
    nowhere = np.zeros((mesh.num_vertices, 3))
    limit = table.max_distortion
    return remesh(mesh, nowhere, table.target_area, seed=table.seed, max_distortion=limit)


class Topologies:
    """Topologies of one garment as they are asked for, each made once."""

    def __init__(self) -> None:
        self._made: dict[TopologyTable, Projection] = {}

    def fitted(self, scene: Scene, source: Sample) -> Sample:
        """The sample of a scene with a topology, fitted to the simulated `source` as it is stored.

        Every frame is the L2 projection, untangled; where that leaves an intersection, the interpolated
        surface, untangled. SimulationError if that leaves one too.
        """
        assert scene.topology is not None
        started = time.perf_counter()
        projection = self._projection(source.garment, scene.topology)
        frames, errors, interpolated = [], [], 0
        for frame in range(source.num_frames):
            found, by_fit = _free_frame(scene, projection, source, frame)
            frames.append(found.positions)
            errors.append(transfer_error(found, source.frame_positions(frame).astype(np.float64)))
            interpolated += not by_fit
        sample = replace(
            source,
            id=scene.name,
            garment=projection.remeshed.mesh,
            positions=np.stack(frames).astype(np.float32),
            scene=scene.model_dump(mode="json"),
            seed=scene.seed,
        )
        base = _certificate(scene, source.certificate, np.concatenate(errors), interpolated, started)
        certified = certify_rounded(sample, base)
        counts = certified.certificate
        if counts.cloth_cloth_intersections or counts.cloth_body_intersections:
            raise SimulationError(f"scene {scene.name}: in single precision, its topology intersects")
        return certified

    def _projection(self, mesh: GarmentMesh, table: TopologyTable) -> Projection:
        made = self._made.get(table)
        if made is None or made.remeshed.source is not mesh:
            made = self._made[table] = Projection(retriangulated(mesh, table))
        return made


def _free_frame(scene: Scene, projection: Projection, source: Sample, frame: int) -> tuple[Remeshed, bool]:
    """A frame without intersections, and whether it is the L2 projection."""
    positions = source.frame_positions(frame).astype(np.float64)
    live = np.ones(len(source.body_faces), bool)
    live[source.masked(frame)] = False
    body, faces = source.body_vertices(frame), source.body_faces[live]
    on_surface = replace(projection.remeshed, positions=projection.remeshed.carry(positions))
    try:
        return untangle(projection.fit(positions), positions, body, faces), True
    except InputError:
        try:
            return untangle(on_surface, positions, body, faces), False
        except InputError as error:
            where = f"scene {scene.name}, frame {frame}, its topology"
            raise SimulationError(f"{where}: {error}") from error


def _certificate(
    scene: Scene, source: Certificate, errors: Array, interpolated: int, started: float
) -> Certificate:
    """What is known of a fitted sample: rest and residual of the simulation, and the distance from it."""
    kept = {"settle_steps", "last_move_m", "at_rest", "frames_not_at_rest"}
    extra = {key: value for key, value in source.extra.items() if key in kept}
    extra |= {
        "transfer_error_mean_m": float(errors.mean()),
        "transfer_error_max_m": float(errors.max()),
        "interpolated_frames": interpolated,
    }
    return Certificate(
        force_residual=source.force_residual,
        seed=scene.seed,
        seconds=time.perf_counter() - started,
        versions=source.versions,
        extra=extra,
    )
