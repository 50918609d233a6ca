"""Colliders of a scene: their meshes, and where they are at any time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from muslin.garments.errors import InputError
from muslin.sim.world.placing import copies
from muslin.sim.world.rigid import RigidMotion
from muslin.sim.world.tables import (
    Box,
    ColliderTable,
    Cone,
    Cylinder,
    MeshFile,
    PlacedTable,
    Plane,
    Sphere,
    Torus,
)

FACING_Y = Rotation.from_rotvec([-0.5 * np.pi, 0.0, 0.0])
"""From z, the axis of trimesh's shapes, to y."""


class Colliders:
    """All colliders of a scene as one mesh; `faces` (M, 3) int32. They may cross each other."""

    def __init__(self, tables: Sequence[ColliderTable]) -> None:
        self._parts: list[tuple[NDArray[np.float64], RigidMotion]] = []
        faces = [np.zeros((0, 3), np.int32)]
        count = 0
        for table in tables:
            local, triangles = _shape(table)
            turned = Rotation.from_rotvec(table.rotation).apply(local)
            for shift in copies(table.repeat):
                origin = np.array(table.position) + shift
                self._parts.append((turned + origin, RigidMotion.of(table, origin)))
                faces.append((triangles + count).astype(np.int32))
                count += len(local)
        self.faces: NDArray[np.int32] = np.concatenate(faces)
        self.moves = any(table.moves for table in tables)

    def at(self, time: float) -> NDArray[np.float64]:
        """(N, 3) vertices at `time` s, metres."""
        return np.concatenate([np.zeros((0, 3)), *(motion.at(x, time) for x, motion in self._parts)])


def _shape(table: PlacedTable) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (N, 3) about the collider's own origin and faces (M, 3), counter-clockwise from outside."""
    match table:
        case Sphere():
            return _arrays(trimesh.creation.icosphere(table.subdivisions, table.radius))
        case Plane():
            h = 0.5 * table.size
            corners = np.array([(-h, 0.0, -h), (-h, 0.0, h), (h, 0.0, h), (h, 0.0, -h)])
            return corners, np.array([(0, 1, 2), (0, 2, 3)])
        case Box():
            return _arrays(trimesh.creation.box(table.size))
        case Cylinder():
            return _upright(trimesh.creation.cylinder(table.radius, table.height, table.sections))
        case Cone():
            return _upright(trimesh.creation.cone(table.radius, table.height, table.sections))
        case Torus():
            sections = (table.sections, max(8, table.sections // 2))
            return _upright(trimesh.creation.torus(table.radius, table.rod, *sections))
        case MeshFile():
            return _from_file(table.file, table.scale)
    raise TypeError(f"no mesh for {type(table).__name__}")


def _arrays(mesh: trimesh.Trimesh) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)


def _upright(mesh: trimesh.Trimesh) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    vertices, faces = _arrays(mesh)
    return FACING_Y.apply(vertices), faces


def _from_file(file: str, scale: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    if not Path(file).is_file():
        raise InputError(f"collider file {file!r}: does not exist; give a mesh file, such as OBJ, PLY or STL")
    try:
        mesh = trimesh.load_mesh(file)
    except Exception as error:  # each of trimesh's readers has exceptions of its own
        raise InputError(f"collider file {file!r}: not readable ({error}); give OBJ, PLY or STL") from error
    vertices, faces = _arrays(mesh)
    if not len(faces) or not np.isfinite(vertices).all():
        raise InputError(
            f"collider file {file!r}: {len(faces)} triangles, finite vertices: "
            f"{bool(np.isfinite(vertices).all())}; give a mesh of finite triangles"
        )
    flat = np.flatnonzero(trimesh.triangles.area(vertices[faces]) <= 0.0)
    return scale * vertices, np.delete(faces, flat, axis=0)
