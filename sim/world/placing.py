"""Where flat sheets begin, and the copies that a table asks for."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.tables import RepeatTable, Vector


def copies(repeat: RepeatTable | None) -> list[NDArray[np.float64]]:
    """Shifts (3,), metres, of all copies, the original first."""
    if repeat is None:
        return [np.zeros(3)]
    cells = product(*(range(n) for n in repeat.count))
    return [np.array(cell) * np.array(repeat.step) for cell in cells]


def lay_flat(mesh: GarmentMesh, position: Vector, rotation: Vector) -> NDArray[np.float64]:
    """Positions (V, 3) of a mesh of one panel: x along +x, y along -z, turned about the panel's origin, which
    lies at `position`. InputError where a garment has several panels: sewn, they do not lie flat."""
    if len(mesh.panel_names) != 1:
        raise InputError(
            f"garment {mesh.name!r} has {len(mesh.panel_names)} panels; without a [body] goes one flat "
            'panel: use design = "sheet"'
        )
    flat = np.zeros((mesh.num_vertices, 3))
    flat[mesh.panel_to_vertex, 0] = mesh.panel_vertices[:, 0]
    flat[mesh.panel_to_vertex, 2] = -mesh.panel_vertices[:, 1]
    return Rotation.from_rotvec(rotation).apply(flat) + np.array(position)
