"""Small contact systems: separate triangles of cloth and of a collider, and slow ways to look at them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import warp as wp

from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.contact.distance import pair_difference, pair_weights
from muslin.sim.contact.system import ContactSettings, ContactSystem
from muslin.sim.material import load_fabric
from muslin.sim.solve.linear import LinearSystem
from tests.sim.dense import dense


@wp.kernel
def weights_and_distance(
    x: wp.array2d(dtype=wp.vec3d),
    is_edge_edge: bool,
    weights: wp.array(dtype=wp.vec4d),
    distance: wp.array(dtype=wp.float64),
):
    k = wp.tid()
    w = pair_weights(is_edge_edge, x[k, 0], x[k, 1], x[k, 2], x[k, 3])
    weights[k] = w
    distance[k] = wp.length(pair_difference(w, x[k, 0], x[k, 1], x[k, 2], x[k, 3]))


def closest_points(points, is_edge_edge: bool) -> tuple[np.ndarray, np.ndarray]:
    """Weights (K, 4) and distances (K,) of quadruples (K, 4, 3)."""
    points = np.asarray(points, dtype=np.float64).reshape(-1, 4, 3)
    weights = wp.zeros(len(points), dtype=wp.vec4d, device="cpu")
    distance = wp.zeros(len(points), dtype=wp.float64, device="cpu")
    x = wp.array(points, dtype=wp.vec3d, device="cpu")
    wp.launch(weights_and_distance, len(points), [x, is_edge_edge, weights, distance], device="cpu")
    return weights.numpy(), distance.numpy()


@dataclass
class Soup:
    """Separate triangles of cloth, then of a collider; vertices 3 k to 3 k + 2 are triangle k."""

    cloth: ClothModel
    contact: ContactSystem
    linear: LinearSystem
    num_triangles: int

    @property
    def num_cloth(self) -> int:
        return self.cloth.num_vertices

    def array(self, points) -> wp.array:
        return wp.array(np.asarray(points, dtype=np.float64).reshape(-1, 3), dtype=wp.vec3d, device="cpu")

    def search(self, points, move=None) -> None:
        """List the pairs on the way by `move`, as if nothing had been known before."""
        self.contact.search.renew(self.array(points))
        if move is not None:
            self.cover(points, move)

    def cover(self, points, move, fraction=None) -> int:
        """List the pairs on the way by `move`; the number of pairs of groups that were looked at for it."""
        if fraction is not None:
            fraction = wp.array(fraction, dtype=wp.float64, device="cpu")
        return self.contact.search.cover(self.array(points), self.array(move), fraction)

    def pairs(self, is_edge_edge: bool) -> np.ndarray:
        """(K, 4) vertices of the listed pairs."""
        found = self.contact.lists[int(is_edge_edge)]
        return found.pairs.numpy()[: found.length]

    def energy(self, points, start) -> float:
        """Of barrier and friction, joules."""
        total = wp.zeros(1, dtype=wp.float64, device="cpu")
        for pairs in self.contact.lists:
            pairs.distance.zero_()
        self.contact.add_value(self.array(points), 0.0, self.array(start), total)
        return float(total.numpy()[0])

    def derivatives(self, points, start, remaining=None) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (3 V,) and Hessian (3 V, 3 V) with respect to the V vertices of the cloth."""
        remaining = np.zeros_like(points) if remaining is None else remaining
        gradient = wp.zeros(self.num_cloth, dtype=wp.vec3d, device="cpu")
        while True:
            self.linear.clear()
            gradient.zero_()
            arrays = [self.array(values) for values in (points, start, remaining)]
            self.contact.add_derivatives(*arrays, gradient, self.linear.matrix)
            if self.linear.extras_fit():
                return gradient.numpy().ravel(), dense(self.linear.matrix)


@pytest.fixture
def closest() -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    return closest_points


@pytest.fixture
def make_soup(flat_mesh) -> Callable[..., Soup]:
    """make_soup(cloth, collider, **settings): so many triangles; those of cloth have legs of 1 cm at rest."""

    def make(cloth: int, collider: int, **settings) -> Soup:
        corners = np.array([[0.0, 0.0], [0.01, 0.0], [0.0, 0.01]])
        places = 0.02 * np.stack([np.arange(cloth), np.zeros(cloth)], axis=1)
        panel = (corners + places[:, None]).reshape(-1, 2)
        mesh = flat_mesh(panel, np.arange(3 * cloth).reshape(-1, 3))
        model = build_cloth(mesh, load_fabric("gray-interlock"))
        faces = np.arange(3 * collider, dtype=np.int32).reshape(-1, 3)
        # All in one place: patches of the sheets that the tests lay elsewhere.
        points = np.zeros((3 * (cloth + collider), 3))
        contact = ContactSystem(model, faces, points, ContactSettings(**settings), "cpu")
        return Soup(model, contact, LinearSystem(model, "cpu"), cloth + collider)

    return make
