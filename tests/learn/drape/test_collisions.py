import igl
import numpy as np
import pytest
import torch

from muslin.garments.errors import InputError
from muslin.learn.drape.body_surface import BodySurface
from muslin.learn.drape.collisions import MARGIN, collision_loss
from muslin.learn.drape.world import World
from muslin.sim.body.load import load_body
from muslin.sim.wear import a_pose

BETA = torch.tensor([1.2])


@pytest.fixture(scope="module")
def body() -> BodySurface:
    model = load_body("female")
    return BodySurface(World("tee", "female", model.digest, a_pose().tolist(), ("gray-interlock",)))


@pytest.fixture(scope="module")
def cloud(body: BodySurface) -> torch.Tensor:
    """Points around the skin of the torso, within 2 cm of it."""
    vertices = body.vertices(BETA)
    draw = np.random.default_rng(0)
    torso = vertices[np.abs(vertices[:, 0]) < 0.15]
    chosen = torso[draw.choice(len(torso), 400, replace=False)]
    return torch.tensor(chosen + draw.normal(0.0, 0.007, chosen.shape))


def test_the_body_is_affine_in_its_shape(body: BodySurface) -> None:
    beta = np.random.default_rng(1).uniform(-3.0, 3.0, body.model.num_betas)
    np.testing.assert_allclose(body.vertices(beta), body.model.vertices(beta, a_pose()), atol=1e-12)
    np.testing.assert_allclose(body.vertices([0.7]), body.model.vertices([0.7], a_pose()), atol=1e-12)


def test_nearest_points_and_signs_are_those_of_libigl(body: BodySurface, cloud: torch.Tensor) -> None:
    distances, found, _ = body.nearest(cloud.numpy(), BETA)
    signs = np.sign(distances)
    vertices, faces = body.vertices(BETA), body.model.faces.astype(np.int64)
    squared, *_ = igl.point_mesh_squared_distance(cloud.numpy(), vertices, faces)
    np.testing.assert_allclose(np.linalg.norm(found - cloud.numpy(), axis=1), np.sqrt(squared), atol=1e-6)
    winding = igl.fast_winding_number(vertices, faces, cloud.numpy())
    clear = squared > 1e-8
    assert (signs[clear] == np.where(winding[clear] > 0.5, -1.0, 1.0)).all()
    assert 100 < (signs < 0.0).sum() < 300


def test_far_points_are_outside(body: BodySurface) -> None:
    distances, found, _ = body.nearest(np.array([[3.0, 0.0, 0.0]]), BETA)
    assert distances[0] > 2.0
    vertices = body.vertices(BETA)
    hand = vertices[vertices[:, 0].argmax()]
    assert np.linalg.norm(found[0] - hand) < 0.1


@pytest.mark.parametrize("kind", ["distance", "nearest-vertex"])
def test_loss_along_a_normal(kind: str, body: BodySurface) -> None:
    vertices = body.vertices(BETA)
    normals = igl.per_vertex_normals(vertices, body.model.faces)
    chest = int(np.argmin(np.linalg.norm(vertices - [0.05, 0.2, 0.15], axis=1)))
    for offset in (-0.006, -0.003, 0.001, 0.004):
        point = torch.tensor(vertices[chest] + offset * normals[chest])[None]
        expected = max(MARGIN - offset, 0.0) ** 2 / MARGIN**2
        assert float(collision_loss(point, BETA, body, kind)) == pytest.approx(expected, rel=0.05, abs=1e-6)


def test_gradient_is_that_of_the_loss(body: BodySurface, cloud: torch.Tensor) -> None:
    points = cloud.clone().requires_grad_(True)
    loss = collision_loss(points, BETA, body)
    (gradient,) = torch.autograd.grad(loss, points)
    # In the sum over many points, edges of the body even out.
    direction = gradient / gradient.norm()
    step = 2e-4
    ahead, behind = (collision_loss(cloud + s * step * direction, BETA, body) for s in (1.0, -1.0))
    assert float(ahead - behind) / (2.0 * step) == pytest.approx(float(gradient.norm()), rel=0.01)


def test_descent_takes_points_out(body: BodySurface, cloud: torch.Tensor) -> None:
    points = cloud.clone().requires_grad_(True)
    for _ in range(100):
        (gradient,) = torch.autograd.grad(collision_loss(points, BETA, body), points)
        # Newton's step of a point that the others do not touch.
        points = (points - gradient * len(cloud) * MARGIN**2 / 2.0).detach().requires_grad_(True)
    distances, *_ = body.nearest(points.detach().numpy(), BETA)
    assert (distances < 0.0).mean() < 0.01


def test_another_kind_is_told(body: BodySurface, cloud: torch.Tensor) -> None:
    with pytest.raises(InputError, match="nearest-vertex"):
        collision_loss(cloud, BETA, body, "volume")  # type: ignore[arg-type]
