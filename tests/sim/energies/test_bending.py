"""Bending: the table's moments on any triangulation, the plate's energy, exact forces."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.elastic import ElasticEnergy
from muslin.sim.energies.bending import (
    bend_angle,
    bend_curvature,
    bend_derivatives,
    bend_torque,
    bend_value,
    curvaturev,
)
from muslin.sim.material import Fabric, fabric_names, isotropic_fabric, load_fabric
from muslin.sim.solve.linear import LinearSystem
from tests.sim.conftest import make_flat_mesh
from tests.sim.dense import dense
from tests.sim.meshes import KINDS, Kind, sheet

Array = NDArray[np.float64]

POISSON = 0.3
ISOTROPIC = isotropic_fabric(young=2.0e6, poisson=POISSON, thickness=4.0e-4, density=0.2)
PLATE = 2.0e6 * 4.0e-4**3 / (12.0 * (1.0 - POISSON**2))
FABRICS = [*(load_fabric(name) for name in fabric_names()), ISOTROPIC]
CURVATURES = [0.0, 10.0, 20.0, 30.0, 40.0]


class Bending:
    """The bending energy alone of a small cloth."""

    def __init__(self, cloth: ClothModel) -> None:
        self.cloth = cloth
        elastic = ElasticEnergy(cloth, "cpu")
        self.model, self.state = elastic.bend, elastic.bend_state
        self.previous = wp.zeros(len(cloth.faces), dtype=curvaturev)
        self.linear = LinearSystem(cloth, "cpu")

    def energy(self, x: Array, damping: float = 0.0) -> float:
        out = wp.zeros(1, dtype=wp.float64)
        self._fold(x)
        inputs = [self.model, self.state, self.previous, damping, out]
        wp.launch(bend_value, len(self.cloth.faces), inputs)
        return float(out.numpy()[0])

    def angles(self, x: Array) -> Array:
        self._fold(x)
        return self.state.angle.numpy().copy()

    def curvature(self, x: Array) -> Array:
        """(F, 3)"""
        out = wp.zeros(len(self.cloth.faces), dtype=curvaturev)
        self._fold(x)
        wp.launch(bend_curvature, len(out), [self.model, self.state, out])
        return out.numpy()

    def derivatives(self, x: Array, damping: float = 0.0) -> tuple[Array, Array]:
        """Gradient (V, 3) and dense Hessian (3 V, 3 V)."""
        gradient = wp.zeros(self.cloth.num_vertices, dtype=wp.vec3d)
        self.linear.clear()
        self._fold(x)
        wp.launch(bend_torque, len(self.cloth.faces), [self.model, self.state, self.previous, damping])
        inputs = [wp.array(x, dtype=wp.vec3d), self.model, self.state, gradient]
        wp.launch(bend_derivatives, len(self.cloth.hinges), [*inputs, self.linear.matrix])
        return gradient.numpy(), dense(self.linear.matrix)

    def gradient_by_differences(self, x: Array, damping: float = 0.0, h: float = 1e-8) -> Array:
        steps = h * np.eye(x.size).reshape(x.size, *x.shape)
        differences = [self.energy(x + s, damping) - self.energy(x - s, damping) for s in steps]
        return np.array(differences).reshape(x.shape) / (2 * h)

    def _fold(self, x: Array) -> None:
        inputs = [wp.array(x, dtype=wp.vec3d), self.model, self.state]
        wp.launch(bend_angle, len(self.cloth.hinges), inputs)


def rolled(panel: Array, curvature: float, degrees: float) -> Array:
    """A panel (V, 2) on a cylinder that bends it in the direction `degrees` from the weft (+x)."""
    turn = np.radians(degrees)
    along = panel @ np.array([np.cos(turn), np.sin(turn)])
    across = panel @ np.array([-np.sin(turn), np.cos(turn)])
    return np.stack([np.sin(curvature * along) / curvature, across, np.cos(curvature * along) / curvature], 1)


def cylinder_energy(fabric: Fabric, curvature: float, degrees: float) -> float:
    """Work int D k dk of the moment about the axis, J/m^2, from the rigidities of the fabric."""
    s, c = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    # warp is +y: K11 = k s^2, K22 = k c^2, K12 = k s c
    form = np.array([s**4, 2.0 * s**2 * c**2, c**4, 4.0 * s**2 * c**2])
    rigidity = fabric.rigidity @ form
    points = [k for k in CURVATURES if 0.0 < k < curvature]
    return quad(lambda k: np.interp(k, CURVATURES, rigidity) * k, 0.0, curvature, points=points or None)[0]


@pytest.fixture(params=FABRICS, ids=lambda fabric: fabric.name)
def fabric(request: pytest.FixtureRequest) -> Fabric:
    return request.param


@pytest.fixture
def patch(fabric: Fabric) -> Bending:
    """Some twenty irregular triangles."""
    return Bending(build_cloth(sheet("irregular", 0.06, 0.05, 0.02, 5), fabric))


def crumpled(bending: Bending, size: float, seed: int = 0) -> Array:
    """The patch with its vertices off the plane, and off their places in it, by about `size` times 2 cm."""
    mesh = sheet("irregular", 0.06, 0.05, 0.02, 5)
    flat = np.concatenate([mesh.panel_vertices, np.zeros((mesh.num_vertices, 1))], axis=1)
    noise = np.random.default_rng(seed).normal(size=flat.shape) * [0.2, 0.2, 1.0]
    assert bending.cloth.num_vertices == mesh.num_vertices
    return flat + 0.02 * size * noise


SIZES = (1e-3, 0.02, 0.1, 0.3, 0.7)


def test_the_sizes_reach_all_of_the_table(patch: Bending) -> None:
    norms = [np.sqrt((patch.curvature(crumpled(patch, size)) ** 2) @ [1.0, 1.0, 2.0]).max() for size in SIZES]
    assert norms[0] < 1.0
    assert norms[-1] > 40.0
    assert norms[-1] > 100.0 * norms[0]


def test_angle_is_signed_and_blind_to_strain() -> None:
    rest = 0.04 * np.array([(0.0, 0.0), (0.6, 0.8), (-0.5, 0.9), (1.0, 0.1)])
    hinge = Bending(build_cloth(make_flat_mesh(rest, [(0, 1, 2), (1, 0, 3)]), ISOTROPIC))

    def folded(angle: float, strain: Array | None = None) -> Array:
        flat = rest if strain is None else rest @ (np.eye(2) + strain).T
        x = np.concatenate([flat, np.zeros((4, 1))], axis=1)
        axis = (x[1] - x[0]) / np.linalg.norm(x[1] - x[0])
        x[3] = x[0] + Rotation.from_rotvec(angle * axis).apply(x[3] - x[0])
        return x

    sheared = np.array([[0.1, 0.15], [-0.05, -0.2]])
    for angle in (-2.9, -1.7, -0.3, -0.02, 0.0, 0.05, 1.1, 3.0):
        found = hinge.angles(folded(angle))[0]
        assert abs(found) == pytest.approx(abs(angle), abs=1e-12)
        assert hinge.angles(folded(angle, sheared))[0] == pytest.approx(found, abs=1e-12)
        assert hinge.angles(folded(-angle))[0] == pytest.approx(-found, abs=1e-12)
        if abs(angle) > 1e-3:
            assert hinge.energy(folded(angle)) > 0.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0, 90.0, 130.0])
def test_cylinders_cost_what_the_table_says_on_any_triangulation(kind: Kind, degrees: float) -> None:
    mesh = sheet(kind, 0.2, 0.15, 0.01, 1)
    for fabric in (load_fabric("11oz-black-denim"), load_fabric("gray-interlock"), ISOTROPIC):
        bending = Bending(build_cloth(mesh, fabric))
        for curvature in (3.0, 14.0):
            expected = cylinder_energy(fabric, curvature, degrees) * bending.cloth.rest_area.sum()
            found = bending.energy(rolled(mesh.panel_vertices, curvature, degrees))
            assert found == pytest.approx(expected, rel=0.005)


@pytest.mark.parametrize("kind", KINDS)
def test_cylinders_converge_with_the_square_of_the_side(kind: Kind) -> None:
    errors = []
    for side in (0.02, 0.01):
        mesh = sheet(kind, 0.2, 0.16, side, 1)
        bending = Bending(build_cloth(mesh, ISOTROPIC))
        expected = cylinder_energy(ISOTROPIC, 12.0, 30.0) * bending.cloth.rest_area.sum()
        errors.append(abs(bending.energy(rolled(mesh.panel_vertices, 12.0, 30.0)) / expected - 1.0))
    assert errors[0] < 0.01
    assert errors[1] < 0.45 * errors[0]


def test_rolled_along_the_measured_directions_the_table_is_reproduced(fabric: Fabric) -> None:
    """k(kappa / 2) / 4 of hinges along the axis: row 0 about the warp, 1 at 45 degrees, 2 about the weft."""
    mesh = sheet("structured", 0.05, 0.05, 0.0025)
    bending = Bending(build_cloth(mesh, fabric))
    for row, degrees in enumerate([0.0, 45.0, 90.0]):
        for curvature in (4.0, 20.0, 35.0, 50.0):
            h = 0.02
            ends = [
                bending.energy(rolled(mesh.panel_vertices, k, degrees))
                for k in (curvature - h, curvature + h)
            ]
            moment = (ends[1] - ends[0]) / (2.0 * h) / bending.cloth.rest_area.sum()
            table = np.interp(curvature / 2.0, [0.0, 5.0, 10.0, 15.0, 20.0], fabric.bend[row]) / 4.0
            assert moment / curvature == pytest.approx(table, rel=0.005)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "tensor", [(1.0, 0.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.8, -0.3, 0.5)]
)
def test_isotropic_sheet_is_the_plate(kind: Kind, tensor: tuple[float, float, float]) -> None:
    """B / 2 (tr(K)^2 - 2 (1 - nu) det K): cylinder, saddle, cap, twist and a mixture."""
    mesh = sheet(kind, 0.2, 0.15, 0.02, 2)
    bending = Bending(build_cloth(mesh, ISOTROPIC))
    k11, k22, k12 = 0.05 * np.array(tensor)
    x, y = mesh.panel_vertices[:, 1], mesh.panel_vertices[:, 0]
    z = 0.5 * k11 * x**2 + 0.5 * k22 * y**2 + k12 * x * y
    plate = 0.5 * PLATE * ((k11 + k22) ** 2 - 2.0 * (1.0 - POISSON) * (k11 * k22 - k12**2))
    found = bending.energy(np.column_stack([mesh.panel_vertices, z]))
    assert found == pytest.approx(plate * bending.cloth.rest_area.sum(), rel=1e-3)


def test_force_is_the_gradient(patch: Bending) -> None:
    for size in SIZES:
        x = crumpled(patch, size)
        gradient, _ = patch.derivatives(x)
        h = 1e-8 if size > 0.01 else 1e-7
        expected = patch.gradient_by_differences(x, h=h)
        np.testing.assert_allclose(gradient, expected, atol=1e-6 * np.abs(gradient).max())


def test_force_is_the_gradient_across_the_steps_of_the_table(fabric: Fabric) -> None:
    mesh = sheet("structured", 0.02, 0.02, 0.01)
    bending = Bending(build_cloth(mesh, fabric))
    for curvature in CURVATURES[1:]:
        x = rolled(mesh.panel_vertices, curvature, 90.0)
        gradient, _ = bending.derivatives(x)
        # The force has a kink here, which differences see in proportion to their width.
        expected = bending.gradient_by_differences(x, h=1e-9)
        np.testing.assert_allclose(gradient, expected, atol=1e-6 * np.abs(gradient).max())


def test_energy_is_even_and_force_odd_in_the_side_of_the_fold(patch: Bending) -> None:
    mirror = np.array([1.0, 1.0, -1.0])
    for size in SIZES:
        x = crumpled(patch, size)
        assert patch.energy(x * mirror) == pytest.approx(patch.energy(x), rel=1e-12)
        gradient, mirrored = patch.derivatives(x)[0], patch.derivatives(x * mirror)[0]
        np.testing.assert_allclose(mirrored, gradient * mirror, atol=1e-12 * np.abs(gradient).max())


def test_frame_does_not_matter_and_forces_balance(patch: Bending) -> None:
    rotation, shift = Rotation.from_euler("xyz", [1.0, -0.4, 2.2]), np.array([-0.3, 0.7, 0.2])
    for size in SIZES:
        x = crumpled(patch, size)
        gradient, _ = patch.derivatives(x)
        turned = rotation.apply(x) + shift
        scale = np.abs(gradient).max()
        assert patch.energy(turned) == pytest.approx(patch.energy(x), rel=1e-9)
        np.testing.assert_allclose(patch.derivatives(turned)[0], rotation.apply(gradient), atol=1e-9 * scale)
        np.testing.assert_allclose(gradient.sum(axis=0), 0.0, atol=1e-12 * scale)
        np.testing.assert_allclose(np.cross(x, gradient).sum(axis=0), 0.0, atol=1e-12 * scale)


def test_hessian_is_symmetric_and_positive_semi_definite(patch: Bending) -> None:
    for size in SIZES:
        _, hessian = patch.derivatives(crumpled(patch, size), damping=0.3)
        scale = np.abs(hessian).max()
        np.testing.assert_allclose(hessian, hessian.T, atol=1e-13 * scale)
        assert np.linalg.eigvalsh(hessian)[0] >= -1e-12 * scale


@pytest.mark.parametrize("kind", KINDS)
def test_hessian_is_near_enough_for_newton_to_converge_where_flat(kind: Kind) -> None:
    """Newton with H' in place of H converges where all eigenvalues of H against H' are below 2."""
    mesh = sheet(kind, 0.08, 0.06, 0.01, 4)
    bending = Bending(build_cloth(mesh, ISOTROPIC))
    x = np.column_stack([mesh.panel_vertices, np.zeros(mesh.num_vertices)])
    normal = 3 * np.arange(len(x)) + 2
    _, hessian = bending.derivatives(x)
    h = 1e-7
    true = np.stack([bending.derivatives(x + step)[0][:, 2] for step in h * _lifts(len(x))]) / h
    used = hessian[np.ix_(normal, normal)]
    np.testing.assert_allclose(true, true.T, atol=1e-5 * np.abs(true).max())
    # Clear of the three rigid motions, which neither resists.
    ridge = 1e-7 * np.abs(used).max() * np.eye(len(x))
    ratio = eigh(0.5 * (true + true.T) + ridge, used + ridge, eigvals_only=True)
    assert ratio.min() > 0.02
    assert ratio.max() < 1.8


def _lifts(count: int) -> Array:
    """(count, count, 3): each vertex in turn lifted by one."""
    lifts = np.zeros((count, count, 3))
    lifts[np.arange(count), np.arange(count), 2] = 1.0
    return lifts


def test_damping_is_a_gradient_that_opposes_bending(patch: Bending) -> None:
    start = crumpled(patch, 0.1)
    patch.previous.assign(patch.curvature(start))
    for factor in (0.6, 1.0, 1.4):
        x = start * [1.0, 1.0, factor]
        elastic, damped = patch.derivatives(x)[0], patch.derivatives(x, 0.4)[0]
        expected = patch.gradient_by_differences(x, 0.4)
        np.testing.assert_allclose(damped, expected, atol=3e-6 * np.abs(damped).max())
        power = ((damped - elastic) * (start * [0.0, 0.0, 1.0])).sum() * (factor - 1.0)
        assert power > 0.0 if factor != 1.0 else abs(power) < 1e-18


def test_damping_is_the_plates_in_the_change_of_curvature() -> None:
    mesh = sheet("irregular", 0.2, 0.15, 0.02, 2)
    bending = Bending(build_cloth(mesh, ISOTROPIC))
    x = rolled(mesh.panel_vertices, 1.0, 20.0)
    bending.previous.assign(bending.curvature(rolled(mesh.panel_vertices, 0.4, 20.0)))
    added = bending.energy(x, damping=0.5) - bending.energy(x)
    expected = 0.5 * (0.5 * PLATE * 0.6**2) * bending.cloth.rest_area.sum()
    assert added == pytest.approx(expected, rel=1e-3)
