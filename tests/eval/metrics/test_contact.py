"""Contact of a cloth with a body: closed forms, and the slow way to the same figures."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from muslin.eval.metrics.contact import body_contact, self_contact
from muslin.eval.metrics.contact_summary import (
    ContactAccumulator,
    summarise_body_contact,
    summarise_self_contact,
)
from muslin.eval.metrics.penetration import PSEUDONORMAL, WINDING_NUMBER, signed_distances
from muslin.eval.metrics.triangle_samples import centroid_weights, triangle_samples
from muslin.eval.metrics.vertex import triangle_areas
from muslin.eval.metrics.winding import winding_numbers
from muslin.garments.errors import InputError
from tests.eval.metrics.shapes import lifted, sheet, sphere, turned

BALL, BALL_FACES = sphere(4, 1.0)
HEIGHT = 0.3123


def slice_area(v: np.ndarray, f: np.ndarray, height: float) -> float:
    """Area in which the plane z = height cuts a convex body."""
    a, b = v[f].reshape(-1, 3), np.roll(v[f], -1, axis=1).reshape(-1, 3)
    t = (height - a[:, 2]) / np.where(a[:, 2] == b[:, 2], np.inf, b[:, 2] - a[:, 2])
    cut = (t > 0) & (t < 1)
    return float(ConvexHull((a + t[:, None] * (b - a))[cut, :2]).volume)


@pytest.mark.parametrize("parts", [1, 7, 31])
def test_plane_through_a_sphere(parts):
    uv, f = sheet(3.0, 3.0, parts, parts)
    v = lifted(uv - np.array([1.51, 1.49]), HEIGHT)
    exact = slice_area(BALL, BALL_FACES, HEIGHT)
    for cloth, body in ((v, BALL), (turned(v), turned(BALL)), (v[:, [1, 0, 2]] * [1, 1, -1], BALL)):
        found = body_contact(cloth, f, body, BALL_FACES, spacing=0.1)
        assert found.method == WINDING_NUMBER
        assert found.area_sampled == 0.0
        assert found.area_inside == pytest.approx(exact, rel=1e-12)
        assert found.area == pytest.approx(9.0)
        assert found.contour == pytest.approx(2 * np.pi * np.sqrt(1 - HEIGHT**2), rel=2e-3)
    a = np.sqrt(1 - HEIGHT**2)
    assert exact == pytest.approx(np.pi * a**2, rel=3e-3)


def test_volume_and_depth_of_a_plane_through_a_sphere():
    # The depth at (r, h) is 1 - sqrt(r^2 + h^2); over the disc it adds up to pi a^2 - 2 pi / 3 (1 - h^3).
    uv, f = sheet(3.0, 3.0, 30, 30)
    found = body_contact(lifted(uv - 1.5, HEIGHT), f, BALL, BALL_FACES, spacing=0.02)
    volume = np.pi * (1 - HEIGHT**2) - 2 * np.pi / 3 * (1 - HEIGHT**3)
    assert found.volume == pytest.approx(volume, rel=5e-3)
    assert found.surface_depth == pytest.approx(1 - HEIGHT, abs=5e-3)
    assert found.depth_max <= found.surface_depth
    assert found.depths.max() == found.depth_max


def test_volume_scales_with_the_cube_and_the_rest_accordingly():
    uv, f = sheet(3.0, 3.0, 12, 12)
    v = lifted(uv - 1.5, HEIGHT)
    one = body_contact(v, f, BALL, BALL_FACES, spacing=0.1)
    eight = body_contact(8 * v, f, 8 * BALL, BALL_FACES, spacing=0.8)
    assert eight.volume == pytest.approx(512 * one.volume, rel=1e-9)
    assert eight.area_inside == pytest.approx(64 * one.area_inside, rel=1e-9)
    assert eight.contour == pytest.approx(8 * one.contour, rel=1e-9)
    assert eight.depth_sum == pytest.approx(8 * one.depth_sum, rel=1e-9)
    assert (eight.inside, eight.pairs) == (one.inside, one.pairs)


@pytest.mark.parametrize("seed", range(3))
def test_vertices_as_the_slow_way_has_them(seed):
    # Three overlapping balls, and a crumpled cloth through them.
    rng = np.random.default_rng(seed)
    v, f = sphere(3, 1.0)
    body = np.concatenate([v, v + np.array([1.1, 0, 0.2]), v + np.array([0.6, 0.9, 0])])
    body_faces = np.concatenate([f, f + len(v), f + 2 * len(v)])
    uv, faces = sheet(4.0, 3.0, 25, 20)
    cloth = lifted(uv - [1.4, 1.2]) + 0.1 * rng.normal(size=(len(uv), 3))
    found = body_contact(cloth, faces, body, body_faces)
    distance = signed_distances(cloth, body, body_faces)
    assert found.depths.tolist() == np.maximum(-distance, 0.0).tolist()
    assert found.inside == (distance < 0).sum() > 50
    # The area inside against many samples; where sheets of the body overlap it is sampled itself.
    samples = triangle_samples(cloth, faces, np.arange(len(faces)), 0.001)
    inside = winding_numbers(samples.points, body, body_faces) > 0
    assert 0.0 < found.area_sampled < 0.2 * found.area
    assert found.area_inside == pytest.approx(float(samples.areas[inside].sum()), rel=2e-3)


def test_winding_numbers_few_and_many():
    body = np.concatenate([BALL, BALL + np.array([0.5, 0, 0]), 0.2 * BALL])
    faces = np.concatenate([BALL_FACES, BALL_FACES + len(BALL), BALL_FACES[:, ::-1] + 2 * len(BALL)])
    points = np.random.default_rng(0).uniform(-1.5, 2.0, size=(150, 3))
    points[:3] = [[0, 0, 1.0], [0.25, 0, 0.9], [0.0, 0.0, 0.0]]  # above a vertex: a ray meets several edges

    def within(centre, radius):
        return (np.linalg.norm(points - centre, axis=1) < radius).astype(int)

    expected = within([0, 0, 0], 0.997) + within([0.5, 0, 0], 0.997) - within([0, 0, 0], 0.1994)
    assert expected.max() == 2
    assert expected[2] == 1
    clear = np.ones(len(points), dtype=bool)
    for centre, radius in (([0, 0, 0], 1.0), ([0.5, 0, 0], 1.0), ([0, 0, 0], 0.2)):
        clear &= abs(np.linalg.norm(points - centre, axis=1) - radius) > 0.005
    many = winding_numbers(points, body, faces)
    few = np.concatenate([winding_numbers(part, body, faces) for part in np.array_split(points, 10)])
    assert clear.sum() > 100
    assert (many == few).all()
    assert (many == expected)[clear].all()


def test_cloth_wholly_inside_and_outside():
    uv, f = sheet(0.4, 0.4, 4, 4)
    inside = body_contact(lifted(uv - 0.2), f, BALL, BALL_FACES, spacing=0.05)
    assert inside.inside == inside.vertices == len(uv)
    assert inside.area_inside == pytest.approx(inside.area) == pytest.approx(0.16)
    assert inside.pairs == 0
    outside = body_contact(lifted(uv - 0.2, 1.01), f, BALL, BALL_FACES)
    assert (outside.inside, outside.area_inside, outside.volume, outside.depth_max) == (0, 0, 0, 0)


def test_a_large_triangle_between_its_vertices():
    # No vertex is inside, a good part of the surface is.
    corners = np.array([[-3.0, -2.0, HEIGHT], [3.0, -2.0, HEIGHT], [0.0, 4.0, HEIGHT]])
    found = body_contact(corners, np.array([[0, 1, 2]]), BALL, BALL_FACES, spacing=0.1)
    assert found.inside == 0
    assert found.depth_max == 0.0
    assert found.area_inside == pytest.approx(slice_area(BALL, BALL_FACES, HEIGHT), rel=1e-12)
    assert found.surface_depth == pytest.approx(1 - HEIGHT, abs=0.1)


@pytest.mark.parametrize("parts", [4, 6, 8])
def test_cloth_with_edges_in_the_faces_of_a_box(parts):
    # Lines of the sheet lie in the box's sides, or all of it in the top: the figures are sampled, and say so.
    box = trimesh.creation.box(extents=(2, 2, 2))
    v, f = np.array(box.vertices), np.array(box.faces)
    uv, faces = sheet(4.0, 4.0, parts, parts)
    through = body_contact(lifted(uv - 2.0, 0.25), faces, v, f, spacing=0.1)
    assert through.area_inside == pytest.approx(4.0)
    assert through.contour == pytest.approx(8.0)
    # The depth is 3/4 or the distance to the nearest side: a pyramid's frustum of height 3/4.
    assert through.volume == pytest.approx(4 / 3 * (1 - 0.25**3), rel=5e-3)
    on_top = body_contact(lifted(uv - 2.0, 1.0), faces, v, f, spacing=0.1)
    assert on_top.area_inside == pytest.approx(0.0)
    assert on_top.coplanar > 0
    assert on_top.area_sampled >= 4.0


def test_masked_faces_do_not_count_but_bound():
    uv, f = sheet(3.0, 3.0, 9, 9)
    v = lifted(uv - 1.5, HEIGHT)
    whole = body_contact(v, f, BALL, BALL_FACES, spacing=0.2)
    left = np.flatnonzero(BALL[BALL_FACES][:, :, 0].mean(axis=1) < 0)
    part = body_contact(v, f, BALL, BALL_FACES, masked=left, spacing=0.2)
    assert part.contour == pytest.approx(0.5 * whole.contour, rel=0.02)
    assert 0 < part.pairs < whole.pairs
    assert (part.area_inside, part.inside) == (whole.area_inside, whole.inside)


def test_open_body_says_so():
    open_faces = BALL_FACES[BALL[BALL_FACES][:, :, 2].max(axis=1) < 0.95]
    uv, f = sheet(3.0, 3.0, 30, 30)
    v = lifted(uv - 1.5, HEIGHT)
    found, closed = (body_contact(v, f, BALL, faces, spacing=0.05) for faces in (open_faces, BALL_FACES))
    assert found.method == PSEUDONORMAL
    assert (found.inside, found.pairs, found.contour) == (closed.inside, closed.pairs, closed.contour)
    assert found.area_sampled > 0
    assert found.area_inside == pytest.approx(closed.area_inside, rel=0.01)


def test_self_contact_of_crossing_sheets():
    uv, f = sheet(1.0, 1.0, 5, 5)
    up = np.column_stack([uv[:, 0], np.full(len(uv), 0.37), uv[:, 1] - 0.41])
    v, both = np.concatenate([lifted(uv), up]), np.concatenate([f, f + len(uv)])
    found = self_contact(v, both)
    assert found.contour == pytest.approx(1.0)
    assert found.pairs > 5
    assert self_contact(lifted(uv), f) == self_contact(turned(lifted(uv)), f)
    assert self_contact(lifted(uv), f).pairs == 0


def test_summaries_of_frames():
    uv, f = sheet(3.0, 3.0, 9, 9)
    heights = (0.2, 0.6, 1.5)
    accumulator = ContactAccumulator()
    for z in heights:
        v = lifted(uv - 1.5, z)
        accumulator.update(body_contact(v, f, BALL, BALL_FACES, spacing=0.1), self_contact(v, f))
    frames, result, own = accumulator.body, accumulator.body_result(), accumulator.self_result()
    assert result is not None
    assert own is not None
    assert (result.frames, result.touched, own.touched) == (3, 2, 0)
    assert result.vertex_ratio == pytest.approx(sum(x.inside for x in frames) / (3 * len(uv)))
    assert result.area_ratio == pytest.approx(sum(x.area_inside for x in frames) / 27.0)
    assert result.depth_max == frames[0].depth_max
    deep = np.concatenate([x.depths[x.depths > 0] for x in frames])
    assert result.depth_mean == pytest.approx(deep.mean())
    assert result.pairs_max == frames[0].pairs
    assert result.contour_mean == pytest.approx((frames[0].contour + frames[1].contour) / 3)
    assert result.method == WINDING_NUMBER
    assert ContactAccumulator().body_result() is None
    assert ContactAccumulator().self_result() is None
    for summarise in (summarise_body_contact, summarise_self_contact):
        with pytest.raises(InputError, match="no frames"):
            summarise([])


def test_samples_are_centroids_of_equal_parts():
    for n in (1, 2, 5):
        weights = centroid_weights(n)
        assert weights.sum(axis=1) == pytest.approx(np.ones(n * n))
        assert weights.mean(axis=0) == pytest.approx(np.full(3, 1 / 3))
        assert len({tuple(np.round(3 * n * row).astype(int)) for row in weights}) == n * n
    rng = np.random.default_rng(0)
    v, f = rng.normal(size=(9, 3)), np.arange(9).reshape(3, 3)
    samples = triangle_samples(v, f, np.array([0, 2]), 0.3)
    total = np.bincount(samples.faces, weights=samples.areas, minlength=3)
    assert total == pytest.approx(triangle_areas(v, f) * [1, 0, 1])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v, f: (np.where(v == v[3], np.nan, v), f), "cloth.*NaN"),
        (lambda v, f: (v, f[:0]), "cloth: faces of shape"),
        (lambda v, f: (v[:0], f), "cloth: points of shape"),
        (lambda v, f: (v[None], f), "cloth.*one frame"),
        (lambda v, f: (v, f + 1), "cloth: faces name vertices 1 to 9; allowed: 0 to 8"),
        (lambda v, f: (v, f.astype(float)), "cloth: faces of type float64"),
    ],
)
def test_bad_input_is_named(change, message):
    uv, f = sheet(1.0, 1.0, 2, 2)
    v, f = change(lifted(uv), f)
    for measure in (lambda: body_contact(v, f, BALL, BALL_FACES), lambda: self_contact(v, f)):
        with pytest.raises(InputError, match=message):
            measure()


def test_bad_body_is_named():
    uv, f = sheet(1.0, 1.0, 2, 2)
    with pytest.raises(InputError, match="body: faces of shape"):
        body_contact(lifted(uv), f, np.array(trimesh.creation.box().vertices), np.zeros((0, 3), int))
