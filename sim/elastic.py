"""Elastic energies of one cloth on a device: value, gradient and Hessian of stretch and bending together."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import ClothModel
from muslin.sim.energies.bending import (
    BendModel,
    BendState,
    bend_angle,
    bend_curvature,
    bend_derivatives,
    bend_torque,
    bend_value,
    curvaturev,
)
from muslin.sim.energies.stretch import (
    StretchModel,
    strainv,
    stretch_derivatives,
    stretch_strain,
    stretch_value,
)
from muslin.sim.material import BEND_CURVATURE_STEP, bend_moments
from muslin.sim.solve.block_matrix import BlockMatrix


class ElasticEnergy:
    """Stretch and bending of a `ClothModel`; `damping` in seconds scales stiffness into viscosity."""

    def __init__(self, cloth: ClothModel, device: str, damping: float = 0.0) -> None:
        self.device = device
        self.damping = damping
        self.num_faces = len(cloth.faces)
        self.num_hinges = len(cloth.hinges)
        f64 = {"dtype": wp.float64, "device": device}

        stretch = StretchModel()
        faces, inverse_rest = _ascending(cloth)
        stretch.faces = wp.array(faces, dtype=wp.vec3i, device=device)
        stretch.inverse_rest = wp.array(inverse_rest, dtype=wp.mat22d, device=device)
        stretch.rest_area = wp.array(cloth.rest_area, **f64)
        stretch.fabric = wp.array(cloth.face_fabric, dtype=wp.int32, device=device)
        stretch.rest = wp.array(np.stack([f.stretch_rest for f in cloth.fabrics]), **f64)
        stretch.strained = wp.array(np.stack([f.stretch_strained for f in cloth.fabrics]), **f64)
        stretch.slots = wp.array(cloth.slots(cloth.faces), dtype=wp.int32, device=device)
        self.stretch = stretch

        rigidity = [fabric.rigidity for fabric in cloth.fabrics]
        bend = BendModel()
        bend.hinges = wp.array(cloth.hinges, dtype=wp.vec4i, device=device)
        bend.rest_area = stretch.rest_area
        bend.offsets = wp.array(cloth.curvature_offsets, dtype=wp.int32, device=device)
        bend.member = wp.array(cloth.curvature_hinges, dtype=wp.int32, device=device)
        bend.weight = wp.array(cloth.curvature_weights, dtype=curvaturev, device=device)
        bend.fabric = stretch.fabric
        bend.rigidity = wp.array(np.stack(rigidity), dtype=wp.vec4d, device=device)
        moments = [bend_moments(d) for d in rigidity]
        bend.moment = wp.array(np.stack(moments), dtype=wp.vec4d, device=device)
        # A cylinder of curvature k folds the table's hinges by half of it.
        bend.spacing = 2.0 * BEND_CURVATURE_STEP
        bend.order = wp.array(np.argsort(cloth.hinges, axis=1), dtype=wp.vec4i, device=device)
        bend.slots = wp.array(cloth.slots(cloth.hinges), dtype=wp.int32, device=device)
        self.bend = bend
        state = BendState()
        for name in ("angle", "torque", "stiffness"):
            setattr(state, name, wp.zeros(self.num_hinges, **f64))
        self.bend_state = state

        self._strain = wp.zeros(self.num_faces, dtype=strainv, device=device)
        self._curvature = wp.zeros(self.num_faces, dtype=curvaturev, device=device)

    def begin_step(self, x: wp.array) -> None:
        """Remember strain and curvature at `x`, which damping is relative to."""
        wp.launch(stretch_strain, self.num_faces, [x, self.stretch, self._strain], device=self.device)
        self._fold(x)
        bend = [self.bend, self.bend_state, self._curvature]
        wp.launch(bend_curvature, self.num_faces, bend, device=self.device)

    def add_value(self, x: wp.array, inverse_dt: float, energy: wp.array) -> None:
        self.add_stretch_value(x, inverse_dt, energy)
        self.add_bend_value(x, inverse_dt, energy)

    def add_stretch_value(self, x: wp.array, inverse_dt: float, energy: wp.array) -> None:
        rate = self.damping * inverse_dt
        stretch = [x, self.stretch, self._strain, rate, energy]
        wp.launch(stretch_value, self.num_faces, stretch, device=self.device)

    def add_bend_value(self, x: wp.array, inverse_dt: float, energy: wp.array) -> None:
        rate = self.damping * inverse_dt
        self._fold(x)
        bend = [self.bend, self.bend_state, self._curvature, rate]
        wp.launch(bend_value, self.num_faces, [*bend, energy], device=self.device)

    def add_derivatives(
        self, x: wp.array, inverse_dt: float, gradient: wp.array, matrix: BlockMatrix
    ) -> None:
        rate = self.damping * inverse_dt
        stretch = [x, self.stretch, self._strain, rate, gradient, matrix]
        wp.launch(stretch_derivatives, self.num_faces, stretch, device=self.device)
        self._fold(x)
        bend = [self.bend, self.bend_state, self._curvature, rate]
        wp.launch(bend_torque, self.num_faces, bend, device=self.device)
        hinges = [x, self.bend, self.bend_state, gradient, matrix]
        wp.launch(bend_derivatives, self.num_hinges, hinges, device=self.device)

    def _fold(self, x: wp.array) -> None:
        wp.launch(bend_angle, self.num_hinges, [x, self.bend, self.bend_state], device=self.device)


def _ascending(cloth: ClothModel) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Faces (F, 3) with their vertices in ascending order, and `inverse_rest` (F, 2, 2) to match."""
    b = cloth.inverse_rest
    shape_gradients = np.concatenate([-b.sum(axis=1, keepdims=True), b], axis=1)
    order = np.argsort(cloth.faces, axis=1)
    faces = np.take_along_axis(cloth.faces, order, axis=1)
    return faces, np.take_along_axis(shape_gradients, order[:, :, None], axis=1)[:, 1:]


def principal_stretches(mesh: GarmentMesh, positions: np.ndarray) -> np.ndarray:
    """Principal stretches (F, 2), larger first: singular values of the deformation gradient dx/du, u in panel
    space. positions (V, 3), metres."""
    world, rest = (
        np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
        for corners in (positions[mesh.faces], mesh.panel_vertices[mesh.panel_faces])
    )
    return np.linalg.svd(world @ np.linalg.inv(rest), compute_uv=False)
