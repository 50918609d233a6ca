import numpy as np
import pytest
import torch

from muslin.garments.errors import InputError
from muslin.garments.template import template
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.wrinkles.fields import FIELDS, motion_fields
from muslin.learn.wrinkles.garment import GarmentCache, UnposedGarment
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.body.load import load_body
from tests.learn.wrinkles.worn import FPS, around_body, swinging, waves

SIZE, PLACES = 128, 64


@pytest.fixture(scope="module")
def garments() -> GarmentCache:
    """Of a mean drape that is the same for all designs: how the usual tee is laid around the body."""
    templates = MeanDrape("tee", ("garment_length",), 403)
    with torch.no_grad():
        templates.mean.copy_(torch.from_numpy(around_body(template("tee", {}, 403))))
    world = SequenceWorld("tee", "female", load_body("female").digest, ("gray-interlock",), FPS)
    return GarmentCache(templates, world, SIZE, PLACES)


@pytest.fixture(scope="module")
def garment(garments: GarmentCache) -> UnposedGarment:
    return garments.of(template("tee", {}, 1400))


def test_without_a_displacement_it_is_the_template_on_the_skin(garment: UnposedGarment) -> None:
    moving = swinging(3)
    found = garment.positions(np.zeros((3, garment.codec.layout.count, 3)), moving)
    expected = garment.skin.posed(garment.template, moving.beta, moving.poses, moving.translations)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_displacements_come_back_from_positions_in_any_pose(garment: UnposedGarment) -> None:
    moving = swinging(3, 2)
    values = waves(garment.mesh, 0.2)
    maps = garment.codec.encode(np.stack([values, -values, 0.0 * values])).astype(np.float32)
    positions = garment.positions(maps, moving)
    again = garment.maps(positions, moving)
    # The smoothest map of what a map says is nearly that map, which was the smoothest of something.
    np.testing.assert_allclose(garment.codec.decode(again), garment.codec.decode(maps), atol=2e-5)
    np.testing.assert_allclose(garment.positions(again, moving), positions, atol=3e-5)
    assert np.abs(maps).max() > 0.009


def test_a_displacement_turns_with_the_body(garment: UnposedGarment) -> None:
    """Ahead of the chest is ahead of it whichever way it faces."""
    moving = swinging(1)
    moving.poses[:] = 0.0
    moving.poses[0, 0, 1] = 0.5 * np.pi
    ahead = np.zeros((2, garment.codec.layout.count, 3))
    ahead[1, :, 2] = 0.02
    still, moved = (garment.positions(own[None], moving)[0] for own in ahead)
    np.testing.assert_allclose(moved - still, np.tile([0.02, 0.0, 0.0], (len(still), 1)), atol=1e-5)


def test_fields_are_images_of_what_the_vertices_are_told(garment: UnposedGarment) -> None:
    moving = swinging(4)
    images = garment.fields(moving, FPS)
    assert images.shape == (4, FIELDS, PLACES, PLACES)
    layout = garment.places.layout
    assert (images[..., ~layout.mask] == 0.0).all()
    told = motion_fields(garment.skin, garment.template, moving, FPS)
    wrong = garment.places.decode(layout.values(images)) - told
    # They vary over centimetres, and gaps more, where the nearest point jumps from limb to limb.
    assert np.sqrt(np.square(wrong[..., :9]).mean()) < 0.01 * np.sqrt(np.square(told[..., :9]).mean())
    assert np.sqrt(np.square(wrong[..., 9:]).mean()) < 0.1 * np.sqrt(np.square(told[..., 9:]).mean())


def test_all_triangulations_follow_the_body_alike(garments: GarmentCache, garment: UnposedGarment) -> None:
    coarse = garments.of(template("tee", {}, 403))
    moving = swinging(3)
    maps = garment.codec.encode(waves(garment.mesh, 0.3)).astype(np.float32)
    fine, few = (own.positions(maps[None].repeat(3, 0), moving) for own in (garment, coarse))
    # Vertices of the one that lie on vertices of the other: corners of panels at least.
    apart = np.linalg.norm(garment.mesh.panel_vertices[:, None] - coarse.mesh.panel_vertices[None], axis=2)
    apart[garment.mesh.panel_vertex_panel[:, None] != coarse.mesh.panel_vertex_panel[None]] = np.inf
    one, other = np.nonzero(apart < 1e-6)
    assert len(one) > 20
    one, other = garment.mesh.panel_to_vertex[one], coarse.mesh.panel_to_vertex[other]
    np.testing.assert_allclose(fine[:, one], few[:, other], atol=1e-5)


def test_each_triangulation_is_made_once(garments: GarmentCache, garment: UnposedGarment) -> None:
    assert garments.of(template("tee", {}, 1400)) is garment
    assert garments.of(template("tee", {"garment_length": 0.8}, 1400)) is not garment


def test_a_garment_of_another_family_is_told(garments: GarmentCache) -> None:
    with pytest.raises(InputError, match="'sheet'"):
        garments.of(template("sheet", {}, 403))
