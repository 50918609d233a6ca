"""In-plane energy: the table's stress along every fixed direction, exact forces, admissible Hessians."""

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
from muslin.sim.energies.stretch import blend_moment, respond, strainv
from muslin.sim.material import Fabric, fabric_names, isotropic_fabric, load_fabric
from muslin.sim.solve.linear import LinearSystem
from tests.sim.dense import dense

Array = NDArray[np.float64]

ISOTROPIC = isotropic_fabric(young=2.0e6, poisson=0.3, thickness=4.0e-4, density=0.2)
FABRICS = [*(load_fabric(name) for name in fabric_names()), ISOTROPIC]
EIGHTH = np.pi / 8.0


@pytest.fixture(params=FABRICS, ids=lambda fabric: fabric.name)
def fabric(request: pytest.FixtureRequest) -> Fabric:
    return request.param


@wp.kernel(enable_backward=False)
def respond_all(
    strain: wp.array(dtype=strainv),
    rest: wp.array2d(dtype=wp.float64),
    strained: wp.array3d(dtype=wp.float64),
    energy: wp.array(dtype=wp.float64),
    stress: wp.array(dtype=strainv),
    tangent: wp.array(dtype=wp.vec4d),
):
    i = wp.tid()
    response = respond(strain[i], 0, rest, strained)
    energy[i] = response.energy
    stress[i] = response.stress
    tangent[i] = response.tangent


@wp.kernel(enable_backward=False)
def moments(g: wp.array(dtype=wp.float64), out: wp.array(dtype=wp.float64)):
    i = wp.tid()
    out[i] = blend_moment(g[i])


def response_of(fabric: Fabric, strain: Array) -> tuple[Array, Array, Array]:
    """Energy density (N,), stress (N, 3) and tangent (N, 4) at Green strains (N, 3) = (G11, G22, G12)."""
    n = len(strain)
    energy, stress = wp.zeros(n, dtype=wp.float64), wp.zeros(n, dtype=strainv)
    tangent = wp.zeros(n, dtype=wp.vec4d)
    rest = wp.array(fabric.stretch_rest[None], dtype=wp.float64)
    strained = wp.array(fabric.stretch_strained[None], dtype=wp.float64)
    inputs = [wp.array(strain, dtype=strainv), rest, strained, energy, stress, tangent]
    wp.launch(respond_all, n, inputs, device="cpu")
    return energy.numpy(), stress.numpy(), tangent.numpy()


def green(larger: Array, smaller: Array, angle: Array) -> Array:
    """Green strain (N, 3) with principal stretches `larger`, `smaller`, the first at `angle` to the warp."""
    g1, g2 = 0.5 * (larger**2 - 1.0), 0.5 * (smaller**2 - 1.0)
    mean, half = 0.5 * (g1 + g2), 0.5 * (g1 - g2)
    c, s = np.cos(2 * angle), np.sin(2 * angle)
    return np.stack([mean + half * c, mean - half * c, half * s], axis=-1)


def strain_grid(angles: Array) -> Array:
    """Principal stretches from 0.7 to 1.3 in all the `angles`."""
    stretches = np.array([0.7, 0.83, 0.95, 0.99, 1.004, 1.03, 1.1, 7.0 / 6.0, 1.19, 1.3])
    larger, smaller, angle = (a.ravel() for a in np.meshgrid(stretches, stretches, angles, indexing="ij"))
    ordered = larger > smaller
    return green(larger[ordered], smaller[ordered], angle[ordered])


def smooth(u: float) -> float:
    """The smoothest cubic from 0 to 1."""
    return u * u * (3.0 - 2.0 * u)


def table_stress(fabric: Fabric, strain: Array) -> Array:
    """The measured law, written out: s = c(g, theta) : G for strains (N, 3)."""
    out = np.zeros_like(strain)
    for i, (g11, g22, g12) in enumerate(strain):
        values, vectors = np.linalg.eigh([[g11, g12], [g12, g22]])
        larger = values[1]
        c = fabric.stretch_rest
        if larger > 0.0:
            theta = np.arctan2(abs(vectors[1, 1]), abs(vectors[0, 1])) / EIGHTH
            row = min(int(theta), 3)
            low, high = fabric.stretch_strained[row : row + 2]
            at_angle = low + smooth(theta - row) * (high - low)
            mean = np.trapezoid(fabric.stretch_strained, dx=0.25, axis=0)
            share = smooth(min(1.0, (larger - values[0]) / larger))
            t = min(1.0, 6.0 * (np.sqrt(1.0 + 2.0 * larger) - 1.0))
            tension = smooth(min(1.0, 2.0 * larger / (larger - min(values[0], 0.0))))
            c = c + t * tension * (mean + share * (at_angle - mean) - c)
        out[i] = 2 * (c[0] * g11 + c[1] * g22), 2 * (c[1] * g11 + c[2] * g22), c[3] * g12
    return out


def work(stress: Array, strain: Array) -> Array:
    """s : G of symmetric (.., 3) tensors."""
    return (stress * strain) @ np.array([1.0, 1.0, 2.0])


def test_work_along_a_fixed_direction_of_strain_is_the_tables(fabric: Fabric) -> None:
    """d/dtau W(tau G) = s(tau G) : G, by both the energy's differences and the stress itself."""
    direction = strain_grid(np.linspace(-np.pi / 2, np.pi / 2, 17))
    for tau in (0.01, 0.3, 0.7, 1.0):
        expected = work(table_stress(fabric, tau * direction), direction)
        _, stress, _ = response_of(fabric, tau * direction)
        scale = 2.0 * fabric.stretch_strained.max() * np.abs(direction).max(axis=1) ** 2
        h = 1e-6 * tau
        up, down = (response_of(fabric, (tau + s * h) * direction)[0] for s in (1, -1))
        np.testing.assert_allclose(work(stress, direction) / scale, expected / scale, atol=1e-9)
        np.testing.assert_allclose((up - down) / (2 * h) / scale, expected / scale, atol=1e-6)


@pytest.mark.parametrize("stretch", [0.8, 1.05, 7.0 / 6.0, 1.3])
def test_pulling_along_warp_or_weft_gives_the_measured_force(fabric: Fabric, stretch: float) -> None:
    g = 0.5 * (stretch**2 - 1.0)
    t = np.clip(6.0 * (stretch - 1.0), 0.0, 1.0)
    _, stress, _ = response_of(fabric, np.array([[g, 0.0, 0.0], [0.0, g, 0.0]]))
    along_warp = (1 - t) * fabric.stretch_rest + t * fabric.stretch_strained[0]
    along_weft = (1 - t) * fabric.stretch_rest + t * fabric.stretch_strained[4]
    assert stress[0, 0] == pytest.approx(2.0 * along_warp[0] * g, rel=1e-10)
    assert stress[1, 1] == pytest.approx(2.0 * along_weft[2] * g, rel=1e-10)


def test_stress_is_the_gradient_of_the_energy(fabric: Fabric) -> None:
    """In all directions, on the rows of the table and between them."""
    strain = strain_grid(np.concatenate([EIGHTH * (np.arange(-4, 5) + d) for d in (0.0, 0.13, 0.5, 0.9)]))
    check_gradient(fabric, strain)


def test_stress_is_the_gradient_where_tables_switch(fabric: Fabric) -> None:
    """At full blend, in uniaxial strain, and at both of these along a row."""
    angles = np.concatenate([EIGHTH * np.arange(-4, 5), [0.2, 1.0, -0.7]])
    n = len(angles)
    borders = [(7 / 6, 0.9), (1.2, 1.0), (7 / 6, 1.0), (1.02, 1.0)]
    check_gradient(fabric, np.concatenate([green(np.full(n, a), np.full(n, b), angles) for a, b in borders]))


def check_gradient(fabric: Fabric, strain: Array) -> None:
    _, stress, _ = response_of(fabric, strain)
    h = 1e-7
    scale = fabric.stretch_strained.max()
    for k, factor in enumerate((1.0, 1.0, 2.0)):
        step = h * np.eye(3)[k]
        up, down = response_of(fabric, strain + step)[0], response_of(fabric, strain - step)[0]
        np.testing.assert_allclose((up - down) / (2 * h) / scale, factor * stress[:, k] / scale, atol=2e-6)


def test_stress_and_its_slope_are_continuous_on_the_border_of_compression(fabric: Fabric) -> None:
    """One principal strain is -c and the other passes zero: the law turns nonlinear, without a kink in W."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 17)

    def stress(g: float, compression: float) -> Array:
        larger, smaller = (np.full(17, np.sqrt(1.0 + 2.0 * e)) for e in (g, -compression))
        return response_of(fabric, green(larger, smaller, angles))[1]

    scale = fabric.stretch_strained.max()
    for compression in (0.1, 0.01, 0.001):
        h = 1e-5 * compression
        at_zero = stress(0.0, compression)
        above, below = (stress(sign * h, compression) - at_zero for sign in (1.0, -1.0))
        assert np.abs(above).max() < 10.0 * h * scale
        assert np.abs(above + below).max() < 0.01 * h * scale


@pytest.mark.parametrize("g", [-0.1, 0.02, 0.08, 13.0 / 72.0, 0.3])
def test_equal_principal_strains_have_no_direction(fabric: Fabric, g: float) -> None:
    """At G = g I the stress does the table's work and is the mean of those around, larger strain anywhere."""
    angles = np.linspace(0.0, np.pi, 8, endpoint=False)
    at = np.array([[g, g, 0.0]])
    around = at + 1e-8 * np.stack([np.cos(2 * angles), -np.cos(2 * angles), np.sin(2 * angles)], axis=-1)
    energy, stress, _ = response_of(fabric, at)
    energies, stresses, _ = response_of(fabric, around)
    scale = fabric.stretch_strained.max()
    np.testing.assert_allclose(work(stress, at), work(table_stress(fabric, at), at), atol=1e-12 * scale)
    np.testing.assert_allclose(energies, np.tile(energy, 8), rtol=1e-6)
    np.testing.assert_allclose(stresses.mean(axis=0), stress[0], atol=1e-6 * scale)


def test_energy_is_never_negative_and_zero_only_at_rest(fabric: Fabric) -> None:
    strain = strain_grid(np.linspace(-np.pi / 2, np.pi / 2, 33))
    energy, _, _ = response_of(fabric, strain)
    assert (energy > 0.0).all()
    (at_rest,), (stress,), _ = response_of(fabric, np.zeros((1, 3)))
    assert at_rest == 0.0
    np.testing.assert_array_equal(stress, 0.0)


def test_mirrored_shear_has_the_same_energy(fabric: Fabric) -> None:
    """Warp and weft are planes of symmetry: G12 -> -G12 turns only the sign of s12."""
    strain = strain_grid(np.linspace(0.05, 1.5, 12))
    mirror = np.array([1.0, 1.0, -1.0])
    energy, stress, _ = response_of(fabric, strain)
    mirrored_energy, mirrored_stress, _ = response_of(fabric, strain * mirror)
    np.testing.assert_allclose(mirrored_energy, energy, rtol=1e-13)
    np.testing.assert_allclose(mirrored_stress, stress * mirror, rtol=1e-9, atol=1e-9)


def test_tangent_coefficients_are_positive_semi_definite(fabric: Fabric) -> None:
    _, _, c = response_of(fabric, strain_grid(np.linspace(-np.pi / 2, np.pi / 2, 33)))
    assert (c[:, [0, 2, 3]] >= 0.0).all()
    assert (np.abs(c[:, 1]) <= np.sqrt(c[:, 0] * c[:, 2]) * (1 + 1e-12)).all()


def test_isotropic_sheet_is_st_venant_kirchhoff() -> None:
    strain = strain_grid(np.linspace(-np.pi / 2, np.pi / 2, 9))
    energy, stress, tangent = response_of(ISOTROPIC, strain)
    lame = 2.0e6 * 4.0e-4 / (1.0 - 0.3**2)
    trace = strain[:, 0] + strain[:, 1]
    expected = lame * (0.7 * strain + 0.3 * trace[:, None] * np.array([1.0, 1.0, 0.0]))
    np.testing.assert_allclose(stress, expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(energy, 0.5 * work(expected, strain), rtol=1e-12)
    np.testing.assert_allclose(tangent, np.tile(ISOTROPIC.stretch_rest, (len(tangent), 1)), rtol=1e-12)


def test_blend_moment_is_its_integral_up_to_full_blend_and_beyond() -> None:
    limit = 13.0 / 72.0
    g = np.array([-0.1, 0.0, 1e-9, 1e-6, 1e-3, 0.003, 0.05, limit - 1e-9, limit, limit + 1e-9, 0.4])
    out = wp.zeros(len(g), dtype=wp.float64)
    wp.launch(moments, len(g), [wp.array(g, dtype=wp.float64), out], device="cpu")

    def integrand(s: float) -> float:
        return s * min(1.0, 12.0 * s / (np.sqrt(1.0 + 2.0 * s) + 1.0))

    expected = [quad(integrand, 0.0, max(value, 0.0), points=[limit], epsrel=1e-12)[0] for value in g]
    np.testing.assert_allclose(out.numpy(), expected, rtol=1e-11, atol=1e-40)


class Triangle:
    """One triangle of a fabric: energy, gradient (3, 3) and Hessian (9, 9) of positions (3, 3)."""

    REST = np.array([(0.0, 0.0), (0.05, 0.01), (0.012, 0.043)])

    def __init__(self, cloth: ClothModel, damping: float = 0.0) -> None:
        self.elastic = ElasticEnergy(cloth, "cpu", damping)
        self.linear = LinearSystem(cloth, "cpu")
        self.area = float(cloth.rest_area[0])

    def energy(self, x: Array, inverse_dt: float = 0.0) -> float:
        out = wp.zeros(1, dtype=wp.float64)
        self.elastic.add_value(wp.array(x, dtype=wp.vec3d), inverse_dt, out)
        return float(out.numpy()[0])

    def derivatives(self, x: Array, inverse_dt: float = 0.0) -> tuple[Array, Array]:
        gradient = wp.zeros(3, dtype=wp.vec3d)
        self.linear.clear()
        self.elastic.add_derivatives(wp.array(x, dtype=wp.vec3d), inverse_dt, gradient, self.linear.matrix)
        return gradient.numpy(), dense(self.linear.matrix)

    def gradient_by_differences(self, x: Array, inverse_dt: float = 0.0, h: float = 1e-8) -> Array:
        steps = h * np.eye(9).reshape(9, 3, 3)
        up = np.array([self.energy(x + s, inverse_dt) for s in steps])
        down = np.array([self.energy(x - s, inverse_dt) for s in steps])
        return ((up - down) / (2 * h)).reshape(3, 3)

    def hessian_by_differences(self, x: Array, h: float = 1e-7) -> Array:
        steps = h * np.eye(9).reshape(9, 3, 3)
        differences = [self.derivatives(x + s)[0] - self.derivatives(x - s)[0] for s in steps]
        return np.array(differences).reshape(9, 9) / (2 * h)


@pytest.fixture
def triangle(flat_mesh: Callable[..., GarmentMesh], fabric: Fabric) -> Triangle:
    return Triangle(build_cloth(flat_mesh(Triangle.REST, [(0, 1, 2)]), fabric))


def stretched(larger: float, smaller: float, angle: float, turn: int = 0) -> Array:
    """The triangle with these principal stretches, the larger at `angle` to the warp, turned in space."""
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, -s], [s, c]])
    warp_weft = Triangle.REST[:, ::-1] @ axes @ np.diag([larger, smaller]) @ axes.T
    flat = np.concatenate([warp_weft[:, ::-1], np.zeros((3, 1))], axis=1)
    rotation = Rotation.from_euler("xyz", [0.3 + turn, -1.1, 2.0 * turn])
    return rotation.apply(flat) + np.array([0.1, -0.2, 0.05])


def configurations(angles: Array) -> list[Array]:
    pairs = [(0.9, 0.75), (1.02, 0.97), (1.1, 1.05), (1.16, 0.9), (1.3, 1.01), (1.3, 1.2)]
    return [stretched(a, b, angle, k) for k, (a, b) in enumerate(pairs) for angle in angles]


BETWEEN_ROWS = np.array([0.1, 0.6, 1.1, 1.5, -0.3, -0.8, -1.3])
ON_ROWS = EIGHTH * np.arange(-3, 5)


def test_triangle_energy_is_area_times_density(triangle: Triangle, fabric: Fabric) -> None:
    for larger, smaller, angle in [(0.9, 0.75, 0.1), (1.2, 0.9, 1.0), (1.1, 1.05, -0.4)]:
        strain = green(np.array([larger]), np.array([smaller]), np.array([angle]))
        density = response_of(fabric, strain)[0][0]
        found = triangle.energy(stretched(larger, smaller, angle))
        assert found == pytest.approx(triangle.area * density, rel=1e-9)


def test_force_is_the_gradient(triangle: Triangle) -> None:
    for x in configurations(np.concatenate([BETWEEN_ROWS, ON_ROWS])):
        gradient, _ = triangle.derivatives(x)
        expected = triangle.gradient_by_differences(x)
        np.testing.assert_allclose(gradient, expected, atol=1e-5 * np.abs(gradient).max())


def test_hessian_is_symmetric_and_positive_semi_definite(triangle: Triangle) -> None:
    switches = [stretched(7.0 / 6.0, 1.0, angle) for angle in ON_ROWS]
    alike = [stretched(stretch, stretch, 0.0) for stretch in (0.9, 1.0, 1.1)]
    for x in configurations(np.concatenate([BETWEEN_ROWS, ON_ROWS])) + switches + alike:
        _, hessian = triangle.derivatives(x)
        eigenvalues = np.linalg.eigvalsh(hessian)
        np.testing.assert_allclose(hessian, hessian.T, atol=1e-12 * eigenvalues[-1])
        assert eigenvalues[0] >= -1e-12 * eigenvalues[-1]


def test_hessian_is_exact_at_rest(triangle: Triangle) -> None:
    x = stretched(1.0, 1.0, 0.0)
    _, hessian = triangle.derivatives(x)
    found = triangle.hessian_by_differences(x, h=1e-8)
    np.testing.assert_allclose(found, hessian, atol=1e-4 * np.abs(hessian).max())


@pytest.mark.parametrize(("larger", "smaller"), [(1.05, 1.02), (1.3, 1.1), (1.2, 0.98)])
def test_hessian_of_an_isotropic_sheet_in_tension_is_exact(
    flat_mesh: Callable[..., GarmentMesh], larger: float, smaller: float
) -> None:
    triangle = Triangle(build_cloth(flat_mesh(Triangle.REST, [(0, 1, 2)]), ISOTROPIC))
    for angle in (0.0, 0.4, EIGHTH, 1.2):
        x = stretched(larger, smaller, angle, 1)
        _, hessian = triangle.derivatives(x)
        found = triangle.hessian_by_differences(x)
        np.testing.assert_allclose(found, hessian, atol=1e-6 * np.abs(hessian).max())


def test_motion_as_a_rigid_body_costs_nothing(triangle: Triangle, fabric: Fabric) -> None:
    scale = fabric.stretch_rest.max() * triangle.area
    for turn in range(4):
        x = stretched(1.0, 1.0, 0.0, turn)
        assert triangle.energy(x) <= 1e-28 * scale
        assert np.abs(triangle.derivatives(x)[0]).max() <= 1e-12 * scale / 0.05


def test_energy_and_force_turn_with_the_frame(triangle: Triangle) -> None:
    rotation = Rotation.from_euler("xyz", [1.0, -0.4, 2.2])
    block = np.kron(np.eye(3), rotation.as_matrix())
    for x in configurations(BETWEEN_ROWS[:3]):
        turned = rotation.apply(x) + np.array([-0.3, 0.7, 0.2])
        gradient, hessian = triangle.derivatives(x)
        turned_gradient, turned_hessian = triangle.derivatives(turned)
        assert triangle.energy(turned) == pytest.approx(triangle.energy(x), rel=1e-10)
        scale = np.abs(gradient).max()
        np.testing.assert_allclose(turned_gradient, rotation.apply(gradient), atol=1e-9 * scale)
        scale = np.abs(hessian).max()
        np.testing.assert_allclose(turned_hessian, block @ hessian @ block.T, atol=1e-9 * scale)


def test_forces_balance(triangle: Triangle) -> None:
    for x in configurations(np.concatenate([BETWEEN_ROWS, ON_ROWS])):
        gradient, _ = triangle.derivatives(x)
        scale = np.abs(gradient).max()
        np.testing.assert_allclose(gradient.sum(axis=0), 0.0, atol=1e-13 * scale)
        np.testing.assert_allclose(np.cross(x, gradient).sum(axis=0), 0.0, atol=1e-13 * scale)


def test_hessian_does_not_resist_translation(triangle: Triangle) -> None:
    for x in configurations(BETWEEN_ROWS):
        _, hessian = triangle.derivatives(x)
        moved = hessian @ np.tile(np.eye(3), (3, 1))
        np.testing.assert_allclose(moved, 0.0, atol=1e-12 * np.abs(hessian).max())


@pytest.fixture
def damped_triangle(flat_mesh: Callable[..., GarmentMesh], fabric: Fabric) -> Triangle:
    return Triangle(build_cloth(flat_mesh(Triangle.REST, [(0, 1, 2)]), fabric), damping=2.0e-3)


def test_damping_force_is_a_gradient_and_opposes_the_rate_of_strain(damped_triangle: Triangle) -> None:
    before, after, inverse_dt = stretched(1.05, 0.98, 0.3), stretched(1.12, 0.95, 0.6, 1), 200.0
    damped_triangle.elastic.begin_step(wp.array(before, dtype=wp.vec3d))
    gradient, hessian = damped_triangle.derivatives(after, inverse_dt)
    expected = damped_triangle.gradient_by_differences(after, inverse_dt)
    np.testing.assert_allclose(gradient, expected, atol=2e-6 * np.abs(gradient).max())
    assert np.linalg.eigvalsh(hessian)[0] >= -1e-12 * np.abs(hessian).max()
    # What damping adds is positive, of second order in the change of strain.
    assert damped_triangle.energy(after, inverse_dt) > damped_triangle.energy(after)


def test_damping_leaves_rigid_motion_alone(damped_triangle: Triangle) -> None:
    """Strain before and after is the same, so only the elastic force is left."""
    before, after = stretched(1.1, 0.97, 0.5, 0), stretched(1.1, 0.97, 0.5, 2)
    damped_triangle.elastic.begin_step(wp.array(before, dtype=wp.vec3d))
    elastic, _ = damped_triangle.derivatives(after)
    damped, _ = damped_triangle.derivatives(after, 1.0e3)
    np.testing.assert_allclose(damped, elastic, atol=1e-10 * np.abs(elastic).max())
    energy = damped_triangle.energy(after)
    assert damped_triangle.energy(after, 1.0e3) == pytest.approx(energy, rel=1e-12)
