"""Maps over the uv layout: which texels, how vertices read them, and what is lost on the way."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.learn.wrinkles.codec import MapCodec, second_differences
from muslin.learn.wrinkles.layout import MapLayout, map_layout

LONG = {"garment_length": 1.05, "sleeve_length": 0.4}


@pytest.fixture(scope="module")
def mesh() -> GarmentMesh:
    return template("tee", LONG, 1400)


def waves(mesh: GarmentMesh, length: float, height: float) -> np.ndarray:
    """(V, 3) of waves along the axes of panels, metres."""
    uv = np.zeros((mesh.num_vertices, 2))
    uv[mesh.panel_to_vertex] = np.asarray(mesh.panel_vertices)
    phase = 2.0 * np.pi / length * uv
    return height * np.stack([np.sin(phase[:, 0]), np.sin(phase[:, 1]), np.cos(phase.sum(1))], axis=1)


@pytest.mark.parametrize("size", [16, 64, 128])
@pytest.mark.parametrize("parameters", [{}, {"garment_length": 0.5}, LONG])
def test_points_of_panels_read_texels_of_the_mask_alone(size: int, parameters: dict[str, float]) -> None:
    layout = map_layout("tee", size)
    uv = template("tee", parameters, 1400).uv
    place = np.clip(uv * size - 0.5, 0.0, size - 1.0)
    low = np.minimum(place.astype(int), size - 2)
    for di in (0, 1):
        for dj in (0, 1):
            assert layout.mask[low[:, 1] + di, low[:, 0] + dj].all()
    matrix = layout.bilinear(uv)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0)
    assert matrix.data.min() >= 0.0


def test_reading_is_exact_for_affine_functions(mesh: GarmentMesh) -> None:
    layout = map_layout("tee", 64)
    centres = (np.arange(64) + 0.5) / 64
    u, v = np.meshgrid(centres, centres)
    values = layout.values((3.0 * u - 2.0 * v + 0.5)[None])
    inner = (mesh.uv > 1.0 / 64).all(1) & (mesh.uv < 1.0 - 1.0 / 64).all(1)
    read = (layout.bilinear(mesh.uv) @ values)[:, 0]
    np.testing.assert_allclose(read[inner], (mesh.uv @ [3.0, -2.0] + 0.5)[inner], atol=1e-12)


def test_images_and_values_are_each_other_s_inverse() -> None:
    layout = map_layout("tee", 32)
    values = np.random.default_rng(0).normal(size=(2, layout.count, 3)).astype(np.float32)
    images = layout.image(values)
    assert images.shape == (2, 3, 32, 32)
    assert not images[..., ~layout.mask].any()
    assert np.array_equal(layout.values(images), values)


@pytest.mark.parametrize(("size", "why"), [(65, "must be even"), (8, "from 16"), (2048, "to 1024")])
def test_sizes_that_are_none(size: int, why: str) -> None:
    with pytest.raises(InputError, match=why):
        map_layout("tee", size)


def test_points_outside_of_the_layout_are_refused() -> None:
    layout = map_layout("tee", 64)
    row, column = np.argwhere(~layout.mask)[0]
    far = (np.array([[column, row]]) + 0.5) / 64
    alone = MapLayout("tee", 64, np.where(np.indices((64, 64)).sum(0) > 100, layout.islands, -1))
    with pytest.raises(InputError, match="lies outside"):
        alone.bilinear(far)


def test_second_differences_see_no_affine_function_and_no_other_island() -> None:
    layout = map_layout("tee", 32)
    matrix = second_differences(layout)
    i, j = np.nonzero(layout.mask)
    own = layout.islands[layout.mask]
    # Another affine function on every island: only a stencil across two would see it.
    values = 10.0 * own + (1.0 + own) * i - (2.0 + own) * j
    assert np.abs(matrix @ values).max() < 1e-9
    assert np.abs(matrix @ (i * i)).max() > 1.0


def test_a_constant_is_a_constant_everywhere(mesh: GarmentMesh) -> None:
    codec = MapCodec(map_layout("tee", 64), mesh)
    values = np.tile([0.01, -0.02, 0.03], (mesh.num_vertices, 1))
    maps = codec.encode(values)
    # But for the hair of a ridge, on islands of any number of texels.
    np.testing.assert_allclose(maps, np.tile(values[0], (codec.layout.count, 1)), atol=1e-5)
    np.testing.assert_allclose(codec.decode(maps), values, atol=1e-7)


def test_encoding_is_linear(mesh: GarmentMesh) -> None:
    codec = MapCodec(map_layout("tee", 32), mesh)
    a, b = np.random.default_rng(0).normal(size=(2, mesh.num_vertices, 3))
    both = codec.encode(np.stack([a, b, 2.0 * a - b]))
    np.testing.assert_allclose(both[2], 2.0 * both[0] - both[1], atol=1e-9)


def test_less_is_lost_in_larger_maps(mesh: GarmentMesh) -> None:
    """Waves of 20 cm and 1 cm height: some hundredths of a millimetre at 128."""
    values = waves(mesh, 0.2, 0.01)
    lost = []
    for size in (32, 64, 128):
        codec = MapCodec(map_layout("tee", size), mesh)
        lost.append(np.linalg.norm(codec.decode(codec.encode(values)) - values, axis=1).mean())
    assert lost[0] > 2.0 * lost[1] > 4.0 * lost[2]
    assert lost[2] < 1e-4


def test_the_sides_of_a_seam_agree(mesh: GarmentMesh) -> None:
    """In the map of a garment both sides say the same, and whatever it says it is welded."""
    codec = MapCodec(map_layout("tee", 128), mesh)
    values = waves(mesh, 0.3, 0.02)
    seam = np.bincount(mesh.panel_to_vertex)[mesh.panel_to_vertex] > 1
    noise = np.random.default_rng(2).normal(scale=0.02, size=(codec.layout.count, 3))
    assert codec.gaps(codec.encode(values))[seam].mean() < 1e-4
    assert codec.gaps(noise)[seam].mean() > 1e-2
    assert codec.gaps(noise)[~seam].max() < 1e-15
    assert codec.decode(noise).shape == (mesh.num_vertices, 3)


def test_a_map_is_of_a_design_not_of_a_triangulation(mesh: GarmentMesh) -> None:
    layout = map_layout("tee", 128)
    other = template("tee", LONG, 4000)
    maps = MapCodec(layout, mesh).encode(smooth(mesh))
    read = MapCodec(layout, other).decode(maps)
    # Of 1 cm; but for the seams, across which these waves jump.
    assert np.median(np.linalg.norm(read - smooth(other), axis=1)) < 5e-5


def smooth(mesh: GarmentMesh) -> np.ndarray:
    """(V, 3) waves of 0.4 of the layout, of all sides of a seam the mean."""
    phase = 2.0 * np.pi / 0.4 * mesh.uv
    panel = 0.01 * np.stack([np.sin(phase[:, 0]), np.cos(phase[:, 1]), np.sin(phase.sum(1))], axis=1)
    return np.array([panel[mesh.panel_to_vertex == v].mean(0) for v in range(mesh.num_vertices)])


def test_a_garment_of_another_family_is_refused(mesh: GarmentMesh) -> None:
    layout = map_layout("tee", 16)
    with pytest.raises(InputError, match="on maps of design 'sheet'"):
        MapCodec(MapLayout("sheet", 16, layout.islands), mesh)
