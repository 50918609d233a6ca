"""Bending: the table's torque, exact forces, and the energy of a rolled sheet."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.elastic import ElasticEnergy
from muslin.sim.energies.bending import bend_angle, bend_derivatives, bend_value
from muslin.sim.material import fabric_names, isotropic_fabric, load_fabric
from muslin.sim.solve.linear import LinearSystem

Array = NDArray[np.float64]

ISOTROPIC = isotropic_fabric(young=2.0e6, poisson=0.3, thickness=4.0e-4, density=0.2)
FABRICS = [*(load_fabric(name) for name in fabric_names()), ISOTROPIC]

REST = 0.04 * np.array([(0.0, 0.0), (0.6, 0.8), (-0.5, 0.9), (1.0, 0.1)])
"""Panel positions of a hinge on the edge (0, 1), oblique to the grain."""


class Bending:
    """The bending energy alone of a small cloth."""

    def __init__(self, cloth: ClothModel) -> None:
        self.cloth = cloth
        elastic = ElasticEnergy(cloth, "cpu")
        self.model = elastic.bend
        self.previous = wp.zeros(len(cloth.hinges), dtype=wp.float64)
        self.linear = LinearSystem(cloth, "cpu")
        self.scale = cloth.hinge_length / (2.0 * cloth.hinge_area)

    def energy(self, x: Array, damping: float = 0.0) -> float:
        out = wp.zeros(1, dtype=wp.float64)
        inputs = [wp.array(x, dtype=wp.vec3d), self.model, self.previous, damping, out]
        wp.launch(bend_value, len(self.cloth.hinges), inputs)
        return float(out.numpy()[0])

    def angles(self, x: Array) -> Array:
        out = wp.zeros(len(self.cloth.hinges), dtype=wp.float64)
        wp.launch(bend_angle, len(out), [wp.array(x, dtype=wp.vec3d), self.model, out])
        return out.numpy()

    def derivatives(self, x: Array, damping: float = 0.0) -> tuple[Array, Array]:
        """Gradient (V, 3) and dense Hessian (3 V, 3 V)."""
        n = self.cloth.num_vertices
        gradient = wp.zeros(n, dtype=wp.vec3d)
        self.linear.clear()
        inputs = [wp.array(x, dtype=wp.vec3d), self.model, self.previous, damping, gradient]
        wp.launch(bend_derivatives, len(self.cloth.hinges), [*inputs, self.linear.matrix.values])
        offsets, columns = self.cloth.pattern
        dense = np.zeros((n, n, 3, 3))
        dense[np.repeat(np.arange(n), np.diff(offsets)), columns] = self.linear.matrix.values.numpy()
        return gradient.numpy(), dense.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)

    def gradient_by_differences(self, x: Array, damping: float = 0.0, h: float = 1e-8) -> Array:
        steps = h * np.eye(x.size).reshape(x.size, *x.shape)
        differences = [self.energy(x + s, damping) - self.energy(x - s, damping) for s in steps]
        return np.array(differences).reshape(x.shape) / (2 * h)


@pytest.fixture(params=FABRICS, ids=lambda fabric: fabric.name)
def hinge(request: pytest.FixtureRequest, flat_mesh: Callable[..., GarmentMesh]) -> Bending:
    return Bending(build_cloth(flat_mesh(REST, [(0, 1, 2), (1, 0, 3)]), request.param))


@pytest.fixture
def isotropic_hinge(flat_mesh: Callable[..., GarmentMesh]) -> Bending:
    return Bending(build_cloth(flat_mesh(REST, [(0, 1, 2), (1, 0, 3)]), ISOTROPIC))


def folded(angle: float, strain: Array | None = None) -> Array:
    """The hinge with its second face turned about the edge by `angle`, after a strain in the plane (2, 2)."""
    flat = REST if strain is None else REST @ (np.eye(2) + strain).T
    x = np.concatenate([flat, np.zeros((4, 1))], axis=1)
    axis = (x[1] - x[0]) / np.linalg.norm(x[1] - x[0])
    x[3] = x[0] + Rotation.from_rotvec(angle * axis).apply(x[3] - x[0])
    return x


SHEARED = np.array([[0.1, 0.15], [-0.05, -0.2]])
ANGLES = np.array([-2.9, -1.7, -0.8, -0.3, -0.02, 0.0, 0.05, 0.4, 1.1, 2.2, 3.0])


def switches(hinge: Bending) -> Array:
    """Angles at the curvatures of the table."""
    return np.array([5.0, 10.0, 15.0, 20.0]) / hinge.scale[0]


def stiffness(hinge: Bending, curvature: float) -> float:
    """k(alpha) in N m, linear between the measured curvatures and constant beyond."""
    return float(np.interp(curvature, [0.0, 5.0, 10.0, 15.0, 20.0], hinge.cloth.hinge_stiffness[0]))


def test_the_table_is_reached(isotropic_hinge: Bending) -> None:
    assert switches(isotropic_hinge)[0] < 0.5
    assert switches(isotropic_hinge)[-1] < 3.0


def test_angle_is_signed_and_blind_to_strain(isotropic_hinge: Bending) -> None:
    for angle in ANGLES:
        found = isotropic_hinge.angles(folded(angle))[0]
        assert abs(found) == pytest.approx(abs(angle), abs=1e-12)
        assert isotropic_hinge.angles(folded(angle, SHEARED))[0] == pytest.approx(found, abs=1e-12)
        assert isotropic_hinge.angles(folded(-angle))[0] == pytest.approx(-found, abs=1e-12)


def test_force_is_the_gradient(hinge: Bending) -> None:
    for angle in np.concatenate([ANGLES, switches(hinge), -switches(hinge)]):
        for strain in (None, SHEARED):
            x = folded(angle, strain)
            gradient, _ = hinge.derivatives(x)
            scale = max(np.abs(gradient).max(), 1e-3 * hinge.cloth.hinge_stiffness.max() / 0.04)
            np.testing.assert_allclose(gradient, hinge.gradient_by_differences(x), atol=3e-6 * scale)


def test_energy_is_even_and_force_odd_in_the_angle(hinge: Bending) -> None:
    mirror = np.array([1.0, 1.0, -1.0])
    for angle in np.concatenate([ANGLES, switches(hinge)]):
        x = folded(angle)
        assert hinge.energy(x * mirror) == pytest.approx(hinge.energy(x), rel=1e-12, abs=1e-24)
        gradient, mirrored = hinge.derivatives(x)[0], hinge.derivatives(x * mirror)[0]
        np.testing.assert_allclose(mirrored, gradient * mirror, atol=1e-12 * np.abs(gradient).max() + 1e-18)


def test_torque_is_the_tables(hinge: Bending) -> None:
    """dE/dtheta = (l / 2) k(alpha) alpha, by the energy and by the force on the turning vertex."""
    length, scale = hinge.cloth.hinge_length[0], hinge.scale[0]
    height = 2.0 * hinge.cloth.rest_area[1] / length
    for angle in np.concatenate([[0.02, 0.1, 0.7, 1.3, 2.4, 3.0], switches(hinge)]):
        torque = 0.5 * length * stiffness(hinge, angle * scale) * angle * scale
        h = 1e-6
        measured = (hinge.energy(folded(angle + h)) - hinge.energy(folded(angle - h))) / (2 * h)
        assert measured == pytest.approx(torque, rel=1e-5)
        gradient, _ = hinge.derivatives(folded(angle))
        assert np.linalg.norm(gradient[3]) * height == pytest.approx(torque, rel=1e-10)


def test_energy_is_the_work_of_the_torque(hinge: Bending) -> None:
    length, scale = hinge.cloth.hinge_length[0], hinge.scale[0]

    def torque(theta: float) -> float:
        return 0.5 * length * stiffness(hinge, theta * scale) * theta * scale

    for angle in np.concatenate([[0.1, 0.7, 2.9], switches(hinge)]):
        points = [s for s in switches(hinge) if s < angle]
        work = quad(torque, 0.0, angle, points=points or None, epsrel=1e-11)[0]
        assert hinge.energy(folded(angle)) == pytest.approx(work, rel=1e-10)


def test_constant_stiffness_gives_the_quadratic_hinge(isotropic_hinge: Bending) -> None:
    k, length = ISOTROPIC.bend[0, 0], isotropic_hinge.cloth.hinge_length[0]
    area = isotropic_hinge.cloth.hinge_area[0]
    for angle in ANGLES:
        expected = 0.25 * k * length**2 / (2.0 * area) * angle**2
        assert isotropic_hinge.energy(folded(angle)) == pytest.approx(expected, rel=1e-12, abs=1e-30)


def test_hessian_is_symmetric_positive_semi_definite_and_of_rank_one(hinge: Bending) -> None:
    for angle in np.concatenate([ANGLES, switches(hinge)]):
        _, hessian = hinge.derivatives(folded(angle, SHEARED))
        eigenvalues = np.linalg.eigvalsh(hessian)
        np.testing.assert_allclose(hessian, hessian.T, atol=1e-13 * np.abs(hessian).max())
        np.testing.assert_allclose(eigenvalues[:-1], 0.0, atol=1e-12 * np.abs(hessian).max() + 1e-18)
        assert eigenvalues[-1] >= 0.0


def test_hessian_is_exact_where_flat(hinge: Bending) -> None:
    x = folded(0.0)
    _, hessian = hinge.derivatives(x)
    h = 1e-8
    steps = h * np.eye(12).reshape(12, 4, 3)
    differences = [hinge.derivatives(x + s)[0] - hinge.derivatives(x - s)[0] for s in steps]
    found = np.array(differences).reshape(12, 12) / (2 * h)
    np.testing.assert_allclose(found, hessian, atol=1e-5 * np.abs(hessian).max())


def test_curvature_of_the_energy_is_that_of_the_table_or_zero(hinge: Bending) -> None:
    """The Hessian along the turning motion is d2E/dtheta2 where that is positive."""
    length, scale = hinge.cloth.hinge_length[0], hinge.scale[0]
    for angle in (0.05, 0.6, 1.2, 1.9, 2.9):
        x, h = folded(angle), 1e-4
        turn = (folded(angle + 1e-6) - folded(angle - 1e-6)).ravel() / 2e-6
        _, hessian = hinge.derivatives(x)
        torque = [0.5 * length * stiffness(hinge, t * scale) * t * scale for t in (angle - h, angle + h)]
        expected = max((torque[1] - torque[0]) / (2 * h), 0.0)
        assert turn @ hessian @ turn == pytest.approx(expected, rel=1e-6, abs=1e-14)


def test_frame_does_not_matter_and_forces_balance(hinge: Bending) -> None:
    rotation, shift = Rotation.from_euler("xyz", [1.0, -0.4, 2.2]), np.array([-0.3, 0.7, 0.2])
    for angle in ANGLES:
        x = folded(angle, SHEARED)
        gradient, _ = hinge.derivatives(x)
        turned = rotation.apply(x) + shift
        # Flat, only rounding of the angle is left: compare with the force of a milliradian.
        scale = max(np.abs(gradient).max(), 1e-3 * hinge.cloth.hinge_stiffness.min() / 0.04)
        assert hinge.energy(turned) == pytest.approx(hinge.energy(x), rel=1e-9, abs=1e-20)
        np.testing.assert_allclose(hinge.derivatives(turned)[0], rotation.apply(gradient), atol=1e-9 * scale)
        np.testing.assert_allclose(gradient.sum(axis=0), 0.0, atol=1e-12 * scale)
        np.testing.assert_allclose(np.cross(x, gradient).sum(axis=0), 0.0, atol=1e-12 * scale)


def test_damping_is_a_gradient_that_opposes_turning(hinge: Bending) -> None:
    hinge.previous.assign(hinge.angles(folded(0.5)))
    for angle in (0.2, 0.5, 0.9):
        x = folded(angle, SHEARED)
        elastic, damped = hinge.derivatives(x)[0], hinge.derivatives(x, 0.4)[0]
        expected = hinge.gradient_by_differences(x, 0.4)
        np.testing.assert_allclose(damped, expected, atol=3e-6 * np.abs(damped).max())
        turn = (folded(angle + 1e-6, SHEARED) - folded(angle - 1e-6, SHEARED)) / 2e-6
        power = ((damped - elastic) * turn).sum() * (angle - 0.5)
        assert power > 0.0 if angle != 0.5 else abs(power) < 1e-18


@pytest.mark.parametrize("direction", [0.0, 20.0, 45.0, 90.0])
def test_rolled_sheet_has_the_energy_of_the_plate(
    flat_mesh: Callable[..., GarmentMesh], direction: float
) -> None:
    """A regular sheet on a cylinder of curvature kappa: B kappa^2 / 2 an area, whatever way it is rolled.

    Equilateral triangles are isotropic for hinges; `isotropic_fabric` takes k = 4 B for them.
    """
    side, n, kappa = 0.01, 40, 4.0
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    panel = side * np.stack([i + 0.5 * j, np.sqrt(0.75) * j], axis=1)
    corner = np.arange(n * n).reshape(n, n)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = np.concatenate([np.stack([p.ravel() for p in t], 1) for t in ((a, b, d), (b, c, d))])
    bending = Bending(build_cloth(flat_mesh(panel, faces), ISOTROPIC))
    turn = np.radians(direction)
    along = panel @ np.array([np.cos(turn), np.sin(turn)])
    across = panel @ np.array([-np.sin(turn), np.cos(turn)])
    x = np.stack([np.sin(kappa * along) / kappa, across, np.cos(kappa * along) / kappa], axis=1)
    # Each hinge stands for a third of its two faces: what the rim lacks is left out of the area.
    area = bending.cloth.hinge_area.sum() / 3.0
    rigidity = 2.0e6 * 4.0e-4**3 / (12.0 * (1.0 - 0.3**2))
    assert bending.energy(x) == pytest.approx(0.5 * rigidity * kappa**2 * area, rel=0.03)
