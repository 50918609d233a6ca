"""Pictures: projection and framing in closed form, rays against geometry, light against solid angles."""

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image

from muslin.garments.errors import InputError
from muslin.garments.merge import merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.camera import FIELD_OF_VIEW, Camera, frame_camera
from muslin.sim.view.heatmap import BAR_SPACE, colours, with_bar
from muslin.sim.view.layer import Layer, seam_edges, vertex_normals
from muslin.sim.view.lighting import Lights, Quality, key_directions, received
from muslin.sim.view.movie import frame_choice, gif_bytes, write_movie
from muslin.sim.view.picture import garment_colours, picture, rotation_matrix, sample_cameras, sample_layers
from muslin.sim.view.rays import cast, lit_share
from muslin.sim.view.render import render
from muslin.sim.view.sheet import CAPTION_HEIGHT, GAP, contact_sheet
from muslin.sim.view.window import paint, require_display

BALL = trimesh.creation.icosphere(4)
BALL_V, BALL_F = np.array(BALL.vertices), np.array(BALL.faces)
COARSE = Quality(ambient_rays=8, key_rays=2, pixel_samples=1, ground_cells=12)
UP = np.array([0.0, 1.0, 0.0])


def sheet(n: int = 12, side: float = 1.0) -> GarmentMesh:
    x = np.linspace(0, side, n)
    X, Y = np.meshgrid(x, x, indexing="ij")
    grid = np.stack([X.ravel(), Y.ravel()], axis=1)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.c_[i, i + n, i + n + 1], np.c_[i, i + n + 1, i + 1]]).astype(np.int32)
    return GarmentMesh(
        faces=faces,
        panel_faces=faces,
        panel_vertices=grid,
        panel_to_vertex=np.arange(n * n, dtype=np.int32),
        face_panel=np.zeros(len(faces), dtype=np.int32),
        panel_names=("cloth",),
        uv=grid / side,
        name="sheet",
        parameters={},
    )


def sample(frames: int) -> Sample:
    garment = sheet()
    flat = np.c_[garment.panel_vertices[:, 0] - 0.5, np.full(144, 0.4), 0.5 - garment.panel_vertices[:, 1]]
    return Sample(
        id="s",
        kind="sequence" if frames > 1 else "drape",
        garment=garment,
        positions=np.stack([flat + np.array([0, 0.1 * t, 0]) for t in range(frames)]).astype(np.float32),
        certificate=Certificate(),
        fps=30.0 if frames > 1 else None,
        obstacle_vertices=0.3 * BALL_V[None].astype(np.float32),
        obstacle_faces=BALL_F.astype(np.int32),
    ).validate()


def test_projection_inverts_directions():
    camera = Camera(eye=np.array([1.0, 2.0, 5.0]), target=np.array([0.2, 1.0, 0.0]))
    assert camera.axes @ camera.axes.T == pytest.approx(np.eye(3))
    x, y = np.array([10.0, 200.5, 320.0]), np.array([7.0, 100.0, 399.0])
    points = camera.eye + camera.directions(x, y, 320, 400) * np.array([[2.0], [5.0], [9.0]])
    assert camera.project(points, 320, 400) == pytest.approx(np.stack([x, y], axis=1))
    assert camera.project(camera.target[None], 320, 400) == pytest.approx(np.array([[160.0, 200.0]]))


@pytest.mark.parametrize("size", [(300, 400), (400, 300)])
@pytest.mark.parametrize("azimuth", [0.0, 2.0, 4.5])
def test_framing_touches_opposite_borders_and_holds_everything(size, azimuth):
    points = np.random.default_rng(0).normal(size=(500, 3)) * [0.4, 0.9, 0.2] + [3, 1, -2]
    p = frame_camera(points, *size, azimuth, 0.2).project(points, *size)
    margins = np.stack([p.min(axis=0), np.array(size) - p.max(axis=0)])
    assert (margins > 0).all()
    tight = margins / np.array(size)
    axis = tight.min(axis=0).argmin()
    assert tight[0, axis] == pytest.approx(tight[1, axis], abs=1e-9)
    assert tight.min() == pytest.approx(0.5 * (1 - 1 / 1.08), rel=1e-6)


def test_rays_hit_the_sphere_where_they_should():
    rng = np.random.default_rng(1)
    origins = np.c_[rng.uniform(-1.3, 1.3, size=(2000, 2)), np.full(2000, 6.0)]
    hits = cast(origins, np.broadcast_to([0.0, 0, -1], origins.shape), BALL_V, BALL_F)
    radius = np.linalg.norm(origins[:, :2], axis=1)
    assert (hits.face[radius > 1] == -1).all()
    assert (hits.face[radius < 0.99] >= 0).all()
    hit = hits.face >= 0
    where = np.einsum("nk,nkd->nd", hits.weights[hit], BALL_V[BALL_F[hits.face[hit]]])
    assert where[:, :2] == pytest.approx(origins[hit, :2], abs=2e-5)
    assert (where[:, 2] > -1e-5).all()


def test_shadow_of_a_sphere_is_its_disc():
    x = np.linspace(-1.5, 1.5, 61)
    points = np.stack([*np.meshgrid(x, [-2.0], x, indexing="ij")], axis=-1).reshape(-1, 3)
    lit = lit_share(points, UP[None], BALL_V, BALL_F, 1e-3)
    radius = np.hypot(points[:, 0], points[:, 2])
    assert (lit[radius > 1.0] == 1).all()
    assert (lit[radius < 0.99] == 0).all()
    # the sphere shades its own lower half
    own = lit_share(1.001 * BALL_V, UP[None], BALL_V, BALL_F, 4e-3)
    assert (own[BALL_V[:, 1] > 0.1] == 1).all()
    assert (own[BALL_V[:, 1] < -0.1] == 0).all()


def test_sky_seen_below_a_sphere():
    # share of the hemisphere's solid angle that a unit sphere hides whose centre is d straight above
    lights = Lights(UP, UP, UP)
    for d in (1.5, 2.0, 4.0):
        ground = np.array([[0.0, -d, 0.0]])
        light = received(ground, UP[None], BALL_V, BALL_F, lights, Quality(ambient_rays=20_000, key_rays=1))
        assert 1.0 - light[0, 0] == pytest.approx(1 - np.sqrt(1 - 1 / d**2), abs=0.01)


def test_key_light_is_a_disc_around_its_direction():
    d = key_directions(UP, 200)
    assert np.linalg.norm(d, axis=1) == pytest.approx(np.ones(200))
    assert d.mean(axis=0) == pytest.approx([0, 1, 0], abs=0.01)


def test_picture_covers_the_projected_disc():
    layer = Layer(BALL_V, BALL_F, np.array([1.0, 0.0, 0.0]))
    camera = Camera(eye=np.array([0.0, 0, 10]), target=np.zeros(3))
    image = render([layer], camera, (200, 200), COARSE).astype(int)
    red = image[..., 0] - image[..., 1] > 60
    radius = 100 / np.tan(FIELD_OF_VIEW / 2) / np.sqrt(10**2 - 1)  # of the silhouette, pixels
    assert red.sum() == pytest.approx(np.pi * radius**2, rel=0.01)
    assert red[100, 100]
    assert not red[2, 2]


def test_picture_of_a_sample_is_repeatable_and_framed():
    image = picture(sample(1), size=(120, 160), quality=COARSE)
    assert image.shape == (160, 120, 3)
    assert image.dtype == np.uint8
    assert image.std() > 10
    same = picture(sample(1), size=(120, 160), quality=COARSE)
    assert np.abs(image.astype(int) - same).mean() < 4.0  # ambient light is by random rays


def test_nan_and_nothing_are_refused():
    camera = Camera(eye=np.array([0.0, 0, 10]), target=np.zeros(3))
    bad = np.where(np.arange(len(BALL_V))[:, None] == 0, np.nan, BALL_V)
    with pytest.raises(InputError, match="NaN"):
        render([Layer(bad, BALL_F, np.ones(3))], camera)
    with pytest.raises(InputError, match="no triangle"):
        render([Layer(BALL_V, BALL_F[:0], np.ones(3))], camera)


def test_normals_of_a_sphere_and_seams_of_a_cut():
    assert vertex_normals(BALL_V, BALL_F) == pytest.approx(BALL_V, abs=1e-2)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    whole = seam_edges(faces, faces)
    assert whole.tolist() == [[True, True, False], [False, True, True]]
    assert seam_edges(faces, np.array([[0, 1, 2], [3, 4, 5]])).all()


def test_rotation_about_the_vertical():
    R = rotation_matrix(np.array([0.0, 0.7, 0.0]))
    assert pytest.approx([np.sin(0.7), 0, np.cos(0.7)]) == R @ [0, 0, 1]
    assert rotation_matrix(np.zeros(3)) == pytest.approx(np.eye(3))


def test_heat_map_is_monotone_and_clamped():
    c = colours(np.linspace(-1, 2, 50), 0.0, 1.0)
    luminance = c @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) >= -1e-12).all()
    assert c[0] == pytest.approx(colours(np.zeros(1), 0, 1)[0])
    assert c[-1] == pytest.approx(colours(np.ones(1), 0, 1)[0])
    assert with_bar(np.zeros((200, 100, 3), np.uint8), 0, 5, "mm").shape == (200, 100 + BAR_SPACE, 3)
    for low, high in ((0, 0), (0, np.nan)):
        with pytest.raises(InputError):
            colours(np.zeros(3), low, high)


def test_contact_sheet_places_pictures_in_rows():
    pictures = [np.full((10, 8, 3), i, np.uint8) for i in range(5)]
    grid = contact_sheet(pictures, 3)
    assert grid.shape == (20 + GAP, 24 + 2 * GAP, 3)
    assert grid[5, 4, 0] == 0
    assert grid[15 + GAP, 12 + GAP, 0] == 4
    titled = contact_sheet(pictures, 5, ["a"] * 5)
    assert titled.shape == (10 + CAPTION_HEIGHT, 40 + 4 * GAP, 3)
    assert (titled[CAPTION_HEIGHT:, :8] == 0).all()
    with pytest.raises(InputError):
        contact_sheet([], 2)


def test_movies_keep_time(tmp_path):
    assert frame_choice(sample(7), most=3) == ([0, 3, 6], 10.0)
    assert frame_choice(sample(7), fps=15.0) == ([0, 2, 4, 6], 15.0)
    pictures = [np.full((20, 16, 3), 40 * i, np.uint8) for i in range(6)]
    image = Image.open(io.BytesIO(gif_bytes(pictures, 30.0)))
    total = 0
    for i in range(image.n_frames):
        image.seek(i)
        total += image.info["duration"]
    assert (image.n_frames, total) == (6, 200)
    write_movie(tmp_path / "m.mp4", pictures, 12.0)
    assert (tmp_path / "m.mp4").stat().st_size > 500
    with pytest.raises(InputError, match=r"\.gif or \.mp4"):
        write_movie(tmp_path / "m.avi", pictures, 12.0)


def test_camera_walks_with_the_figure():
    still = sample(1)
    walking = replace(
        still,
        kind="sequence",
        fps=30.0,
        positions=np.concatenate([still.positions + np.float32([0.1 * t, 0, 0]) for t in range(60)]),
        obstacle_vertices=np.concatenate(
            [still.obstacle_vertices + np.float32([0.1 * t, 0, 0]) for t in range(60)]
        ),
    ).validate()
    cameras, ground = sample_cameras(walking, range(60), (120, 160))
    middle = np.diff([camera.eye for camera in cameras], axis=0)[15:-15]
    assert middle == pytest.approx(np.broadcast_to([0.1, 0, 0], middle.shape), abs=1e-6)
    assert ground == pytest.approx(-0.3, abs=1e-6)
    for t in (0, 30, 59):
        p = cameras[t].project(walking.positions[t].astype(float), 120, 160)
        assert (p > 0).all()
        assert (p < [120, 160]).all()


def test_every_garment_of_a_merged_mesh_has_a_colour_of_its_own():
    one = sample(1)
    n = one.garment.num_vertices
    both = replace(
        one,
        garment=merge_meshes(["under", "over"], [one.garment, one.garment]),
        positions=np.concatenate([one.positions, one.positions + np.float32([0, 1, 0])], axis=1),
    )
    assert garment_colours(one).shape == (3,)
    found = garment_colours(both)
    assert (found[:n] == garment_colours(one)).all()
    assert (found[n:] == found[n]).all()
    assert (found[n] != found[0]).any()
    single, merged = (paint(sample_layers(s)[-1]) for s in (one, both))
    assert single.keys() == {"color"}
    assert merged["rgb"] is True
    assert merged["scalars"].dtype == np.uint8
    np.testing.assert_allclose(merged["scalars"] / 255.0, found, atol=0.5 / 255.0)


def test_window_without_display_says_what_to_do(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match="muslin render"):
        require_display()
