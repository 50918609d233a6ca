"""The body of any shape in the one pose of a world: its vertices, and how far points are from it."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from muslin.learn.drape.world import World

wp.set_module_options({"enable_backward": False})

FAR = 1.0
"""Metres beyond which nothing is looked for."""


class BodySurface:
    """Posed vertices are affine in the shape, for joints are, and the pose is fixed:

    v(beta) = v_0 + sum_k beta_k v_k.
    """

    def __init__(self, world: World) -> None:
        """Raises InputError if the world's body is not there."""
        self.model = world.load_body()
        self.theta = np.array(world.theta)
        self.base = self.model.vertices(None, self.theta)
        units = np.eye(self.model.num_betas)
        self.directions = np.stack(
            [self.model.vertices(unit, self.theta) - self.base for unit in units], axis=-1
        )

    def vertices(self, beta: ArrayLike) -> NDArray[np.float64]:
        """(N, 3) metres, of shape beta (n,)."""
        given = np.asarray(beta, dtype=np.float64)
        return self.base + self.directions[..., : len(given)] @ given

    def nearest(
        self, points: NDArray[np.floating], beta: ArrayLike
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Of points (P, 3) the nearest points of the body (P, 3), metres, and signs (P,): -1 inside.

        Points farther than FAR are their own nearest points, outside.
        """
        self._mesh.points.assign(self.vertices(beta).astype(np.float32))
        self._mesh.refit()
        found = wp.empty(len(points), dtype=wp.vec3, device="cpu")
        signs = wp.empty(len(points), dtype=wp.float32, device="cpu")
        asked = wp.array(np.ascontiguousarray(points, dtype=np.float32), dtype=wp.vec3, device="cpu")
        wp.launch(
            _nearest,
            dim=len(points),
            inputs=[self._mesh.id, asked, FAR],
            outputs=[found, signs],
            device="cpu",
        )
        return found.numpy(), signs.numpy()

    @cached_property
    def _mesh(self) -> Any:
        points = wp.array(self.base.astype(np.float32), dtype=wp.vec3, device="cpu")
        faces = wp.array(self.model.faces.ravel().astype(np.int32), device="cpu")
        return wp.Mesh(points, faces)


@wp.kernel
def _nearest(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    far: float,
    found: wp.array(dtype=wp.vec3),
    signs: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    query = wp.mesh_query_point_sign_normal(mesh, points[i], far)
    found[i] = points[i]
    signs[i] = 1.0
    if query.result:
        found[i] = wp.mesh_eval_position(mesh, query.face, query.u, query.v)
        signs[i] = query.sign
