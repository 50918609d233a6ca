from functools import lru_cache

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.garments.triangulate import triangulate
from muslin.learn.wrinkles.codec import BENDING, MapCodec, second_differences
from muslin.learn.wrinkles.layout import map_layout
from muslin.sim.remesh.topology import remesh
from tests.learn.wrinkles.worn import waves

DRESS = {"garment_length": 0.9}


@lru_cache(maxsize=8)
def codec(size: int, resolution: int = 403) -> MapCodec:
    return MapCodec(map_layout("tee", size), template("tee", DRESS, resolution))


def rms(apart: np.ndarray) -> float:
    """Root mean square of the lengths of vectors (V, 3), mm."""
    return 1000.0 * float(np.sqrt(np.square(apart).sum(axis=1).mean()))


def random_map(own: MapCodec, spread: float, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, spread, (own.layout.count, 3))


# Of waves 1 cm high. There are more vertices than texels in the last case alone: there some is lost.
@pytest.mark.parametrize(
    ("resolution", "length", "at_64", "at_128"),
    [(403, 0.1, 0.15, 0.04), (403, 0.2, 0.03, 0.008), (1400, 0.2, 0.02, 0.004), (4000, 0.2, 0.2, None)],
)
def test_waves_come_back_the_better_the_larger_the_map(resolution, length, at_64, at_128) -> None:
    found = []
    for size, allowed in ((64, at_64), (128, at_128)):
        if allowed is not None:
            own = codec(size, resolution)
            values = waves(own.mesh, length)
            found.append(rms(own.decode(own.encode(values)) - values))
            assert found[-1] < allowed
    assert len(found) == 1 or found[1] < 0.4 * found[0]


@pytest.mark.parametrize("kind", ["finer", "coarser", "cut", "remeshed"])
def test_a_map_says_the_same_on_another_triangulation(kind: str) -> None:
    own = codec(128, 1400)
    values = own.encode(waves(own.mesh, 0.2))
    other: GarmentMesh
    if kind == "cut":
        other = triangulate(catalogue.get("tee").pattern(**DRESS), 0.025)
    elif kind == "remeshed":
        other = remesh(own.mesh, np.zeros((own.mesh.num_vertices, 3)), 3e-4, seed=1).mesh
    else:
        other = template("tee", DRESS, {"finer": 4000, "coarser": 403}[kind])
    expected = waves(other, 0.2)
    apart = MapCodec(own.layout, other).decode(values) - expected
    # Edges are an eighth of the waves: between their vertices, a thin plate errs by some 1 %.
    assert rms(apart) < 0.15
    assert np.linalg.norm(apart, axis=1).max() < 0.001
    assert rms(expected) > 5.0


def test_encoding_is_linear_and_takes_frames_one_by_one() -> None:
    own = codec(64)
    x, y = np.random.default_rng(0).standard_normal((2, own.mesh.num_vertices, 3))
    both = own.encode(np.stack([x, y, 2.0 * x - 3.0 * y]))
    np.testing.assert_allclose(both[2], 2.0 * both[0] - 3.0 * both[1], atol=1e-9)
    np.testing.assert_allclose(both[1], own.encode(y), atol=1e-9)
    np.testing.assert_allclose(own.decode(both[None])[0, 0], own.decode(both[0]), atol=1e-12)


@pytest.mark.parametrize("size", [64, 128])
def test_constants_are_the_same_constants_in_every_texel(size: int) -> None:
    own = codec(size)
    value = np.array([0.3, -2.0])
    # Up to the hair, 1e-9, by which all values are drawn to zero: most of all where no vertex is near.
    np.testing.assert_allclose(
        own.encode(np.tile(value, (own.mesh.num_vertices, 1))),
        value[None].repeat(own.layout.count, 0),
        rtol=3e-5,
    )


def test_without_seams_affine_functions_go_on_straight_beyond_the_rim() -> None:
    mesh = template("sheet", {}, 403)
    layout = map_layout("sheet", 32)
    slopes, offset = np.array([[1.0, 2.0], [3.0, -1.0]]), np.array([0.5, 0.0])
    values = np.zeros((mesh.num_vertices, 2))
    values[mesh.panel_to_vertex] = mesh.uv @ slopes + offset
    rows, columns = np.nonzero(layout.mask)
    centres = (np.stack([columns, rows], axis=1) + 0.5) / 32
    np.testing.assert_allclose(MapCodec(layout, mesh).encode(values), centres @ slopes + offset, atol=1e-5)


def test_the_map_is_the_smoothest_of_those_that_say_nearly_the_same() -> None:
    own = codec(32)
    values = waves(own.mesh, 0.3, height=1.0)
    read, bent = own.layout.bilinear(own.mesh.uv), second_differences(own.layout)

    def energy(m: np.ndarray) -> float:
        wrong = read @ m - values[own.mesh.panel_to_vertex]
        return float(np.square(wrong).sum() + BENDING * np.square(bent @ m).sum())

    found = own.encode(values)
    least = energy(found)
    for seed in range(4):
        way = random_map(own, 1.0, seed)
        # A parabola with its lowest point there: as much more on both sides.
        more, less = energy(found + 1e-2 * way) - least, energy(found - 1e-2 * way) - least
        assert more > 0.0
        assert more == pytest.approx(less, rel=1e-3)


def test_a_sewn_vertex_has_the_mean_of_what_the_map_says_at_its_panel_vertices() -> None:
    own = codec(64)
    values = random_map(own, 0.01)
    said = own.layout.bilinear(own.mesh.uv) @ values
    decoded = own.decode(values)
    sides = np.bincount(own.mesh.panel_to_vertex)
    assert set(sides) >= {1, 2, 3}
    for vertex in [*np.flatnonzero(sides == 3), *np.flatnonzero(sides == 2)[:10], int(np.argmin(sides))]:
        own_sides = said[own.mesh.panel_to_vertex == vertex]
        np.testing.assert_allclose(decoded[vertex], own_sides.mean(axis=0), atol=1e-12)


@pytest.mark.parametrize("resolution", [403, 1400])
def test_both_sides_of_a_seam_say_the_same_in_an_encoded_map_and_not_in_any_other(resolution: int) -> None:
    own = codec(64, resolution)
    sewn = (np.bincount(own.mesh.panel_to_vertex) > 1)[own.mesh.panel_to_vertex]
    gaps = own.gaps(own.encode(waves(own.mesh, 0.1)))
    assert gaps.shape == (len(own.mesh.uv),)
    assert gaps.max() < 1e-4
    noise = own.gaps(random_map(own, 0.01))
    assert noise[~sewn].max() < 1e-12
    # Half the distance of two values of 1 cm spread, each a mean of some texels.
    assert 0.003 < noise[sewn].mean() < 0.02


def test_second_differences_see_no_slope_and_only_one_island() -> None:
    layout = map_layout("tee", 64)
    bent = second_differences(layout)
    island = layout.islands[layout.mask]
    rows, columns = np.nonzero(layout.mask)
    draw = np.random.default_rng(0).standard_normal((4, 3))
    affine = draw[island, 0] + draw[island, 1] * rows + draw[island, 2] * columns
    np.testing.assert_allclose(bent @ affine, 0.0, atol=1e-11)
    for row in range(bent.shape[0]):
        assert len(set(island[bent.indices[bent.indptr[row] : bent.indptr[row + 1]]])) == 1
    # Each texel is seen; a step from one island to the next is not.
    assert set(bent.indices) == set(range(layout.count))
    assert np.abs(bent @ island.astype(float)).max() == 0.0


def test_second_differences_measure_bending_in_all_directions_alike() -> None:
    layout = map_layout("sheet", 128)
    rows, columns = np.nonzero(layout.mask)
    x, y = rows - 64.0, columns - 64.0
    bent = second_differences(layout)
    # Of f: f_xx^2 + 2 f_xy^2 + f_yy^2, which is 8 for a saddle either way, and for a bowl.
    for f in (x**2 - y**2, 2.0 * x * y, x**2 + y**2):
        # Three stencils have a few texels less at the rim than there are.
        assert np.square(bent @ f).sum() / layout.count == pytest.approx(8.0, rel=0.03)


def test_a_mesh_of_another_family_is_told() -> None:
    with pytest.raises(InputError, match="design 'sheet' on maps of design 'tee'"):
        MapCodec(map_layout("tee", 64), template("sheet", {}, 403))
