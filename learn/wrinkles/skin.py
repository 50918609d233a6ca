"""The skin of a garment: how its vertices would move with the body, loose parts smoothly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from muslin.garments.correspondence import Correspondence
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.learn.drape.smoothing import sewn_operators
from muslin.sim.body.model import BodyModel
from muslin.sim.body.rotation import rotation_matrices
from muslin.sim.body.skinning import SMALLEST_DETERMINANT, bind

Floats = NDArray[np.float64]

CLOSE, LOOSE = 0.06, 1.0
"""The length l(d) over which skin data is smoothed at distance d from the body: CLOSE metres + LOOSE d."""


@dataclass(frozen=True, eq=False)
class GarmentSkin:
    """Linear blend skinning of a garment, with skin data of the body:

        y = M (x + S beta + P vec(R(theta) - I)) + t,   [M t] = sum_j w_j G_j(beta, theta)

    x the garment on the mean body in T-pose, and, a vertex of it,

    weights  (V, 24) w, not negative, of sum one
    shape    (V, 3, B) S, metres for one standard deviation
    pose     (V, 3, 207) P, see `BodyModel`
    """

    model: BodyModel
    weights: Floats
    shape: Floats
    pose: Floats

    def posed(
        self, points: NDArray[np.floating], beta: ArrayLike, theta: ArrayLike, translation: ArrayLike = 0.0
    ) -> Floats:
        """y (T, V, 3) of points x (T, V, 3), or (V, 3) in all frames; beta (n,), theta (T, 24, 3),
        translation (T, 3); metres, radians."""
        linear, shift, offsets = self.motion(beta, theta, translation)
        return _times(linear, points + offsets) + shift

    def unposed(
        self, points: NDArray[np.floating], beta: ArrayLike, theta: ArrayLike, translation: ArrayLike = 0.0
    ) -> Floats:
        """The inverse: x (T, V, 3) of points y (T, V, 3).

        Raises InputError where it has none: joints turned against each other by nearly half a turn.
        """
        linear, shift, offsets = self.motion(beta, theta, translation)
        least = np.linalg.det(linear)
        if least.min() < SMALLEST_DETERMINANT:
            frame, vertex = np.unravel_index(int(least.argmin()), least.shape)
            raise InputError(
                f"vertex {vertex} of frame {frame} cannot be unposed: its blended transform has determinant "
                f"{least.min():.2g}, allowed is at least {SMALLEST_DETERMINANT}; leave such frames out"
            )
        return _times(np.linalg.inv(linear), np.asarray(points, dtype=np.float64) - shift) - offsets

    def carried(self, place: Correspondence) -> GarmentSkin:
        """That of another triangulation; place: where on this one its vertices lie."""
        return GarmentSkin(
            self.model, place.carry(self.weights), place.carry(self.shape), place.carry(self.pose)
        )

    def motion(
        self, beta: ArrayLike, theta: ArrayLike, translation: ArrayLike = 0.0
    ) -> tuple[Floats, Floats, Floats]:
        """M (T, V, 3, 3), t (T, V, 3), and what is added to x (T, V, 3)."""
        theta = np.asarray(theta, dtype=np.float64)
        transforms = self.model.transforms(beta, theta, translation)[:, :, :3]
        blended = np.matmul(self.weights, transforms.reshape(*transforms.shape[:2], 12))
        blended = blended.reshape(len(theta), -1, 3, 4)
        shape = np.asarray(beta, dtype=np.float64)
        features = (rotation_matrices(theta[:, 1:]) - np.eye(3)).reshape(len(theta), -1)
        bent = features @ self.pose.reshape(-1, self.pose.shape[2]).T
        offsets = self.shape[..., : len(shape)] @ shape + bent.reshape(len(theta), -1, 3)
        return blended[..., :3], blended[..., 3], offsets


def garment_skin(mesh: GarmentMesh, positions: NDArray[np.floating], model: BodyModel) -> GarmentSkin:
    """The skin of a garment that lies at `positions` (V, 3), metres, around the mean body in T-pose.

    Values w_0 of the body's nearest points are smoothed over the cloth, the more the further it is off:

        (A + K) w = A w_0,   A = diag(m_i / l(d_i)^2),   l(d) = CLOSE + LOOSE d

    with masses m and the stiffness K of `sewn_operators`, negative cotangent weights left out. So A + K is an
    M-matrix with A + K and A of equal row sums: weights stay not negative and of sum one, and a skirt's
    change from one leg to the other over the width of the gap, not from one vertex to the next.
    """
    points = np.asarray(positions, dtype=np.float64)
    binding = bind(points, model)
    values = np.concatenate(
        [
            binding.weights,
            *(binding.interpolate(own).reshape(len(points), -1) for own in (model.shapedirs, model.posedirs)),
        ],
        axis=1,
    )
    mass, stiffness = sewn_operators(mesh)
    held = mass / (CLOSE + LOOSE * binding.distances) ** 2
    factors = splu(csc_array(diags_array(held) + _positive_weights(stiffness)))
    smooth = factors.solve(held[:, None] * values)
    joints, betas = model.weights.shape[1], model.num_betas
    weights, shape, pose = np.split(smooth, [joints, joints + 3 * betas], axis=1)
    weights = np.clip(weights, 0.0, None)
    return GarmentSkin(
        model,
        weights / weights.sum(axis=1, keepdims=True),
        shape.reshape(len(points), 3, betas),
        pose.reshape(len(points), 3, -1),
    )


def _positive_weights(stiffness: csr_array) -> csr_array:
    """The stiffness with edges of negative weight left out; rows sum to zero."""
    edges = stiffness.tocoo()
    kept = (edges.row != edges.col) & (edges.data < 0.0)
    apart = csr_array((edges.data[kept], (edges.row[kept], edges.col[kept])), shape=stiffness.shape)
    return csr_array(apart - diags_array(np.asarray(apart.sum(axis=1)).ravel()))


def _times(matrices: NDArray[np.floating], points: NDArray[np.floating]) -> Floats:
    return np.einsum("tvij,...vj->tvi" if points.ndim == 2 else "tvij,tvj->tvi", matrices, points)
