"""Derivatives of barrier and friction against central differences, and what the forces mean."""

import numpy as np
import pytest

from muslin.sim.contact.system import ContactSettings

RANGE = 2e-3
STEP = 1e-8
SLIP = ContactSettings().slip


def crossing_triangles(seed: int) -> np.ndarray:
    """Two triangles of about 1 cm, (6, 3), at random to each other and closer than the range."""
    draw = np.random.default_rng(seed)
    lower = np.array([[0, 0, 0], [0.012, 0, 0], [0, 0, 0.011]]) + 1e-3 * draw.normal(size=(3, 3))
    upper = np.array([[0.002, 0, 0.003], [0.011, 0, 0.007], [-0.003, 0, 0.012]])
    upper += 1e-3 * draw.normal(size=(3, 3))
    lower[:, 1] = 1e-4 * draw.normal(size=3)
    upper[:, 1] = RANGE * draw.uniform(0.35, 0.9) + 1e-4 * draw.normal(size=3)
    return np.concatenate([lower, upper])


def near_parallel_edges(angle: float) -> np.ndarray:
    """Two triangles whose first edges lie above each other at `angle`; their other corners point away."""
    upper = np.array([[-0.005, 0, 0], [0.005, 0, 0], [0, 0.01, -0.01]])
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    upper = upper @ turn.T + [3e-4, 0.5 * RANGE, 2e-4]
    lower = np.array([[-0.005, 0, 0], [0.005, 0, 0], [0, -0.01, 0.01]])
    return np.concatenate([lower, upper])


CASES = [crossing_triangles(seed) for seed in range(6)]
CASES += [near_parallel_edges(angle) for angle in (0.0, 1e-3, 0.01, 0.02, 0.028, 0.05)]


def central_differences(soup, points, start) -> np.ndarray:
    slopes = np.zeros(3 * soup.num_cloth)
    for k in range(len(slopes)):
        move = np.zeros(points.size)
        move[k] = STEP
        move = move.reshape(points.shape)
        slopes[k] = (soup.energy(points + move, start) - soup.energy(points - move, start)) / (2 * STEP)
    return slopes


@pytest.mark.parametrize("collider", [0, 1], ids=["cloth-cloth", "cloth-body"])
@pytest.mark.parametrize("case", range(len(CASES)))
def test_gradient_of_the_barrier(make_soup, case, collider):
    points = CASES[case]
    soup = make_soup(2 - collider, collider)
    soup.search(points)
    gradient, _ = soup.derivatives(points, points)
    assert np.abs(gradient).max() > 1e-5
    slopes = central_differences(soup, points, points)
    np.testing.assert_allclose(gradient, slopes, atol=1e-6 * np.abs(gradient).max())


@pytest.mark.parametrize("collider", [0, 1], ids=["cloth-cloth", "cloth-body"])
@pytest.mark.parametrize("slip", [0.0, 0.3, 0.99, 1.5, 20.0])
@pytest.mark.parametrize("case", [0, 3, 8])
def test_gradient_of_friction(make_soup, case, slip, collider):
    """`slip`: how far the upper triangle has slid since the start, in units of the sticking distance."""
    start = CASES[case]
    soup = make_soup(2 - collider, collider, friction_body=0.4, friction_cloth=0.7)
    soup.search(start)
    soup.contact.begin_step(soup.array(start))
    assert soup.contact.num_friction > 0
    points = start.copy()
    points[:3] += slip * SLIP * np.array([0.6, 0.1, -0.8])
    gradient, _ = soup.derivatives(points, start)
    frozen, soup.contact.num_friction = soup.contact.num_friction, 0
    barrier, _ = soup.derivatives(points, start)
    soup.contact.num_friction = frozen
    slopes = central_differences(soup, points, start)
    np.testing.assert_allclose(gradient, slopes, atol=1e-6 * np.abs(gradient).max())
    assert (np.abs(gradient - barrier).max() > 1e-6) == (slip > 0)


@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("case", range(len(CASES)))
def test_hessian_is_symmetric_and_positive_semidefinite(make_soup, case, friction):
    points = CASES[case]
    soup = make_soup(2, 0)
    soup.search(points)
    if friction:
        soup.contact.begin_step(soup.array(points))
    _, hessian = soup.derivatives(points + 1e-5, points)
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-12 * np.abs(hessian).max())
    eigenvalues = np.linalg.eigvalsh(hessian)
    assert eigenvalues[-1] > 0
    assert eigenvalues[0] >= -1e-10 * eigenvalues[-1]


def point_over_triangle(height: float) -> np.ndarray:
    """A triangle of cloth, one corner of it at `height` above the middle of a triangle of the collider."""
    cloth = np.array([[0.01, height, 0.01], [0.012, height + 0.02, 0.01], [0.01, height + 0.02, 0.012]])
    return np.concatenate([cloth, [[0, 0, 0], [0, 0, 0.04], [0.04, 0, 0]]])


def test_hessian_along_the_normal_is_the_second_derivative(make_soup):
    """There the distance is linear, so nothing is left out of the Hessian."""
    points = point_over_triangle(1e-3)
    soup = make_soup(1, 1)
    soup.search(points)
    up = np.zeros((6, 3))
    up[:3, 1] = 1e-7
    ahead, behind = (soup.derivatives(points + sign * up, points)[0] for sign in (1, -1))
    gradient, hessian = soup.derivatives(points, points)
    np.testing.assert_allclose(hessian @ up[:3].ravel(), (ahead - behind) / 2, rtol=1e-5, atol=1e-14)
    assert gradient[1] < 0, "the barrier pushes up: its energy falls with the height"


def test_a_collider_that_is_still_to_come_pushes_ahead(make_soup):
    """To first order the gradient foretells what it will be when the collider has come."""
    points = point_over_triangle(1e-3)
    soup = make_soup(1, 1)
    soup.search(points)
    rise = np.zeros((6, 3))
    rise[3:, 1] = 1e-8
    now, _ = soup.derivatives(points, points)
    foretold, _ = soup.derivatives(points, points, rise)
    then, _ = soup.derivatives(points + rise, points + rise)
    np.testing.assert_allclose(foretold - now, then - now, rtol=1e-4, atol=1e-15)
    assert np.abs(then - now).max() > 0


def test_barrier_has_its_closed_form_and_ends_smoothly_at_the_range(make_soup):
    """One vertex above a triangle: kappa A B(s), A half the area of the vertex."""
    soup = make_soup(1, 1, stiffness=3.0)
    area = 0.5 * soup.cloth.vertex_area[0]
    for share in (0.05, 0.3, 0.7, 0.999):
        points = point_over_triangle(share * RANGE)
        soup.search(points)
        energy = 3.0 * area * (1 - share) ** 3 / share
        np.testing.assert_allclose(soup.energy(points, points), energy, rtol=1e-10)
    points = point_over_triangle(RANGE)
    soup.search(points)
    gradient, hessian = soup.derivatives(points, points)
    assert soup.energy(points, points) == 0.0
    assert not gradient.any()
    assert not hessian.any()


@pytest.mark.parametrize("direction", [0, 2])
def test_friction_sticks_linearly_and_saturates_at_coulombs_bound(make_soup, direction):
    points = point_over_triangle(1e-3)
    soup = make_soup(1, 1, friction_body=0.4)
    soup.search(points)
    normal_force = -soup.derivatives(points, points)[0][1]
    soup.contact.begin_step(soup.array(points))
    eps = SLIP
    for share in (0.01, 0.5, 1.0, 30.0):
        moved = points.copy()
        moved[:3, direction] += share * eps
        force = soup.derivatives(moved, points)[0].reshape(-1, 3)
        bound = 0.4 * normal_force * (1.0 if share >= 1 else 2 * share - share**2)
        np.testing.assert_allclose(force[0, direction], bound, rtol=1e-6)
        np.testing.assert_allclose(force[1:], 0, atol=1e-15)


def test_friction_hessian_bounds_the_second_derivative_from_above(make_soup):
    points = point_over_triangle(1e-3)
    soup = make_soup(1, 1)
    soup.search(points)
    soup.contact.begin_step(soup.array(points))
    for share in (1e-6, 0.5, 3.0):
        moved = points.copy()
        moved[:3] += share * SLIP * np.array([0.6, 0.0, 0.8])
        _, hessian = soup.derivatives(moved, points)
        exact = np.zeros((3, 3))
        for axis in range(3):
            nudge = np.zeros((6, 3))
            nudge[0, axis] = 1e-9
            ahead, behind = (soup.derivatives(moved + sign * nudge, points)[0][:3] for sign in (1, -1))
            exact[:, axis] = (ahead - behind) / 2e-9
        tangent = np.ix_([0, 2], [0, 2])
        excess = (hessian[:3, :3] - exact)[tangent]
        largest = np.abs(hessian[:3, :3][tangent]).max()
        assert np.linalg.eigvalsh(0.5 * (excess + excess.T)).min() >= -1e-4 * largest
        if share < 1e-3:
            np.testing.assert_allclose(excess, 0, atol=1e-4 * largest)


def test_friction_slows_cloth_on_a_moving_collider(make_soup):
    """The slip is relative: cloth carried along with the collider feels none."""
    start = point_over_triangle(1e-3)
    soup = make_soup(1, 1)
    soup.search(start)
    soup.contact.begin_step(soup.array(start))
    together = start + np.array([1e-3, 0, 0])
    collider_alone = start.copy()
    collider_alone[3:, 0] += 1e-3
    assert abs(soup.derivatives(together, start)[0][0]) < 1e-12
    assert soup.derivatives(collider_alone, start)[0][0] < -1e-6, "drags the cloth along"


def test_what_friction_holds_is_remembered_and_no_more_than_it_can_hold(make_soup):
    """A patch that has slid by much keeps a displacement of `slip`, one that has by little all of it."""
    for slide, kept in ((0.4 * SLIP, 0.4 * SLIP), (50.0 * SLIP, SLIP)):
        start = point_over_triangle(1e-3)
        soup = make_soup(1, 1)
        soup.search(start)
        soup.contact.begin_step(soup.array(start))
        end = start.copy()
        end[:3, 0] += slide
        soup.contact.end_step(soup.array(end), soup.array(start))
        bristles = soup.contact.friction.bristle.numpy()
        touching = np.linalg.norm(bristles, axis=1) > 0.0
        assert touching.any()
        np.testing.assert_allclose(
            bristles[touching], np.tile([kept, 0, 0], (touching.sum(), 1)), atol=1e-3 * kept
        )
        soup.contact.begin_step(soup.array(end))
        assert soup.derivatives(end, end)[0][0] > 1e-7, "still holds it back where it has come to"
        soup.contact.begin_step(soup.array(end), friction=False)
        soup.contact.end_step(soup.array(end), soup.array(end))
        assert not soup.contact.friction.bristle.numpy().any()
