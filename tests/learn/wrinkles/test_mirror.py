"""Sequences in the mirror."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from muslin.garments.template import template
from muslin.learn.wrinkles.codec import MapCodec
from muslin.learn.wrinkles.garment import UnposedGarment
from muslin.learn.wrinkles.layout import map_layout
from muslin.learn.wrinkles.mirror import FLIP, mirrored_track, mirrored_uv
from muslin.learn.wrinkles.skin import garment_skin
from muslin.sim.body.load import load_body
from muslin.sim.dataset.sample import BodyTrack
from muslin.sim.dress import place
from muslin.sim.motion.skeleton import MIRRORED

BODY = load_body("female")


def moving() -> BodyTrack:
    random = np.random.default_rng(0)
    poses = np.cumsum(0.1 * random.normal(size=(3, 24, 3)), axis=0)
    return BodyTrack("female", BODY.digest, np.array([1.0]), poses, random.normal(size=(3, 3)))


def test_uv_twice_in_the_mirror_is_where_it_was() -> None:
    mesh = template("tee", {"garment_length": 0.9}, 1400)
    there = mirrored_uv(mesh)
    panel = np.asarray(mesh.panel_names)[mesh.panel_vertex_panel]
    left, right = mesh.uv[panel == "sleeve_left"], mesh.uv[panel == "sleeve_right"]
    np.testing.assert_allclose(there[panel == "sleeve_left"].mean(0), right.mean(0), atol=0.01)
    assert np.linalg.norm(left.mean(0) - right.mean(0)) > 0.3
    front = mesh.uv[panel == "front"]
    np.testing.assert_allclose(there[panel == "front"].mean(0), front.mean(0), atol=0.01)
    np.testing.assert_allclose(mirrored_uv(replace(mesh, uv=there)), mesh.uv, atol=1e-12)


def test_the_body_in_the_mirror_moves_as_its_image_does() -> None:
    track = moving()
    mirrored = mirrored_track(track, BODY)
    again = mirrored_track(mirrored, BODY)
    np.testing.assert_allclose(again.poses, track.poses)
    np.testing.assert_allclose(again.translations, track.translations, atol=1e-12)
    joints = BODY.joints(track.beta, track.poses, track.translations)
    image = BODY.joints(mirrored.beta, mirrored.poses, mirrored.translations)
    # The body is symmetric but for some millimetres.
    np.testing.assert_allclose(image[:, list(MIRRORED)] * FLIP, joints, atol=0.01)


def test_a_garment_in_the_mirror_is_its_image() -> None:
    mesh = template("tee", {"garment_length": 0.64}, 403)
    points = place(mesh, BODY, np.zeros(3), BODY.vertices(np.zeros(3)))
    layout = map_layout("tee", 64)
    codec = MapCodec(layout, mesh)
    garment = UnposedGarment(mesh, points, garment_skin(mesh, points, BODY), codec, codec)
    track = moving()
    # Moved to the wearer's left, more at the left.
    apart = np.tile([0.03, 0.01, 0.0], (3, mesh.num_vertices, 1)) * (1.0 + points[:, :1])
    worn = garment.skin.posed(points + apart, track.beta, track.poses, track.translations)
    mirrored = garment.positions(garment.mirrored_maps(worn, track), mirrored_track(track, BODY))
    partner = {"front": "front", "back": "back", "sleeve_left": "sleeve_right", "sleeve_right": "sleeve_left"}
    vertices = {name: np.unique(mesh.faces[mesh.face_panel == k]) for k, name in enumerate(mesh.panel_names)}
    for name, other in partner.items():
        image = FLIP * worn[:, vertices[other]].mean(1)
        np.testing.assert_allclose(mirrored[:, vertices[name]].mean(1), image, atol=0.012)
        assert np.linalg.norm(worn[:, vertices[name]].mean(1) - image, axis=-1).max() > 0.05
    # As far from the template of the image as it was from its own.
    unposed = garment.codec.decode(garment.mirrored_maps(worn, track)) + points
    front = vertices["front"]
    lean = FLIP * (points + apart[0])
    np.testing.assert_allclose(unposed[0, front].mean(0), lean[front].mean(0), atol=0.003)
