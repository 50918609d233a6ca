"""The body of any shape in the one pose of a world: its vertices, and how far points are from it."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.learn.drape.world import World


class BodySurface:
    """Posed vertices are affine in the shape, for joints are, and the pose is fixed:

    v(beta) = v_0 + sum_k beta_k v_k.
    """

    def __init__(self, world: World) -> None:
        """Raises InputError if the world's body is not there."""
        self.model = world.load_body()
        self.theta = np.array(world.theta)
        self.base = self.model.vertices(None, self.theta)
        self.faces = self.model.faces.astype(np.int64)
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
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Distances (P,) of points (P, 3) to the body, negative inside, metres, its nearest points (P, 3) and
        its normals there (P, 3), those of `igl.signed_distance`."""
        return nearest_on(points, self.vertices(beta), self.faces)


def nearest_on(
    points: NDArray[np.floating], vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """`BodySurface.nearest` of any surface: vertices (N, 3), metres, and faces (M, 3)."""
    distances, _, found, normals = igl.signed_distance(
        np.ascontiguousarray(points, dtype=np.float64),
        np.ascontiguousarray(vertices),
        faces,
        sign_type=igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL,
    )
    return distances, found, normals
