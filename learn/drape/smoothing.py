"""The smooth part of a drape: what is left of it without short waves."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh

LENGTH = 0.025
"""Metres: waves of 2 pi LENGTH, 16 cm, are halved."""


class Smoother:
    """Implicit Laplacian smoothing of second order in panel space, for one mesh:

        (M + l^4 K M^-1 K) y = M x,

    M the lumped mass and K the cotangent stiffness matrix of the panels, sewn, with natural boundaries. A
    wave of length w keeps 1 / (1 + (2 pi l / w)^4) of its height on any triangulation. The second order is
    steeper than the first, (M + l^2 K) y = M x, which draws a sleeve of radius r in to
    r / (1 + (l / r)^2).
    """

    def __init__(self, mesh: GarmentMesh, length: float = LENGTH) -> None:
        """length: l, metres. Raises InputError unless it is positive."""
        if not length > 0.0:
            raise InputError(f"length = {length:g} m; it must be positive")
        mass, stiffness = sewn_operators(mesh)
        self._mass = mass
        self._factors = splu(smoothing_matrix(mass, stiffness, length))

    def __call__(self, x: NDArray[np.floating]) -> NDArray[np.float64]:
        """y (V, C) of values x (V, C) at sewn vertices."""
        y: NDArray[np.float64] = self._factors.solve(self._mass[:, None] * np.asarray(x, dtype=np.float64))
        return y


def smoothing_matrix(mass: NDArray[np.float64], stiffness: csr_array, length: float) -> csc_array:
    """M + l^4 K M^-1 K (V, V) of lumped mass M (V,) and stiffness K; length: l, metres."""
    return csc_array(diags_array(mass) + length**4 * (stiffness @ diags_array(1.0 / mass) @ stiffness))


def sewn_operators(mesh: GarmentMesh) -> tuple[NDArray[np.float64], csr_array]:
    """Lumped mass (V,), m^2, and cotangent stiffness K (V, V) >= 0 of the panels in panel space, sewn."""
    flat = np.pad(np.asarray(mesh.panel_vertices, dtype=np.float64), ((0, 0), (0, 1)))
    cotangents = csr_array(igl.cotmatrix(flat, np.ascontiguousarray(mesh.panel_faces, dtype=np.int64)))
    count = len(mesh.panel_vertices)
    ones = np.ones(count)
    sewing = csr_array((ones, (mesh.panel_to_vertex, np.arange(count))), shape=(mesh.num_vertices, count))
    return mesh.vertex_areas, csr_array(-(sewing @ cotangents @ sewing.T))
