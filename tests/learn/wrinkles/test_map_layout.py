import numpy as np
import pytest
from scipy.ndimage import label
from scipy.spatial import cKDTree

from muslin.garments import catalogue
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.garments.triangulate import triangulate
from muslin.learn.wrinkles.layout import REACH, map_layout

DESIGNS = {
    **catalogue.get("tee").presets,
    "least": {"sleeve_length": 0.10, "garment_length": 0.48},
    "most": {"sleeve_length": 0.62, "garment_length": 1.30},
}
SIZES = (16, 64, 128)


@pytest.fixture(scope="module", params=DESIGNS)
def cut(request: pytest.FixtureRequest) -> GarmentMesh:
    """A member of the family cut anew: its uv is not that of the template, but found for it."""
    return triangulate(catalogue.get("tee").pattern(**DESIGNS[request.param]), 0.03)


@pytest.fixture(scope="module")
def inside() -> tuple[np.ndarray, np.ndarray]:
    """Points (Q, 2) all over the layout, not 3 mm apart, and the panel of each."""
    mesh = template("tee")
    weights = np.random.default_rng(0).dirichlet([0.5, 0.5, 0.5], (30, len(mesh.panel_faces)))
    inner = np.einsum("nfk,fkj->nfj", weights, mesh.uv[mesh.panel_faces]).reshape(-1, 2)
    panel = np.concatenate([mesh.panel_vertex_panel, np.tile(mesh.face_panel, 30)])
    return np.concatenate([mesh.uv, inner]), panel


def centres(size: int) -> np.ndarray:
    """(size, size, 2) uv of the centres of texels, by row and column."""
    rows, columns = np.indices((size, size))
    return np.stack([(columns + 0.5) / size, (rows + 0.5) / size], axis=-1)


def read_by(points: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (Q, 4) of the four texels whose centres are around each point, in the square."""
    low = np.floor(points * size - 0.5).astype(int)
    columns, rows = (low[:, k, None] + np.array(step) for k, step in ((0, (0, 1, 0, 1)), (1, (0, 0, 1, 1))))
    return np.clip(rows, 0, size - 1), np.clip(columns, 0, size - 1)


@pytest.mark.parametrize("size", SIZES)
def test_the_mask_has_every_texel_that_a_point_of_a_panel_reads(size: int, inside) -> None:
    assert map_layout("tee", size).mask[read_by(inside[0], size)].all()


@pytest.mark.parametrize("size", [64, 128])
def test_a_point_reads_texels_of_its_own_panel_alone(size: int, inside) -> None:
    """On smaller maps the 5 cm between panels are less than the three texels that this takes."""
    points, panel = inside
    assert (map_layout("tee", size).islands[read_by(points, size)] == panel[:, None]).all()


def test_vertices_of_every_member_of_the_family_read_so_too(cut: GarmentMesh) -> None:
    for size in SIZES:
        own = map_layout("tee", size).islands[read_by(cut.uv, size)]
        assert (own >= 0).all()
        assert size == 16 or (own == cut.panel_vertex_panel[:, None]).all()


@pytest.mark.parametrize("size", SIZES)
def test_the_mask_ends_at_the_reach(size: int, inside) -> None:
    apart = cKDTree(inside[0]).query(centres(size))[0] * size
    mask = map_layout("tee", size).mask
    assert apart[~mask].min() > REACH
    # How far the nearest point of the sample may be from the nearest point of the layout.
    assert apart[mask].max() < REACH + 0.0015 * size


@pytest.mark.parametrize("size", [64, 128])
def test_every_panel_has_one_island_in_one_piece(size: int) -> None:
    islands = map_layout("tee", size).islands
    assert set(np.unique(islands)) == {-1, 0, 1, 2, 3}
    for panel in range(4):
        assert label(islands == panel)[1] == 1


@pytest.mark.parametrize("size", [64, 128])
def test_affine_functions_are_read_exactly(size: int, inside) -> None:
    points, _ = inside
    layout = map_layout("tee", size)
    slopes, offset = np.array([[3.0, -1.0], [0.5, 2.0]]), np.array([0.2, -0.7])
    at_texels = centres(size)[layout.mask] @ slopes + offset
    np.testing.assert_allclose(layout.bilinear(points) @ at_texels, points @ slopes + offset, atol=1e-12)


@pytest.mark.parametrize("size", SIZES)
def test_weights_are_those_of_four_texels_not_negative_and_of_sum_one(size: int, inside) -> None:
    matrix = map_layout("tee", size).bilinear(inside[0])
    assert matrix.data.min() >= 0.0
    assert np.diff(matrix.indptr).max() <= 4
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, atol=1e-12)


def test_a_texel_is_read_at_its_own_centre() -> None:
    layout = map_layout("tee", 16)
    matrix = layout.bilinear(centres(16)[layout.mask])
    np.testing.assert_allclose(matrix.toarray(), np.eye(layout.count), atol=1e-9)


def test_what_texels_outside_would_say_goes_to_the_others() -> None:
    layout = map_layout("tee", 64)
    row = int(np.flatnonzero(layout.mask.any(axis=1))[0])
    column = int(np.flatnonzero(layout.mask[row])[0])
    # A quarter of a texel before the first one of the first row: the three others are outside.
    matrix = layout.bilinear((centres(64)[row, column] - 0.25 / 64)[None])
    assert matrix.indices.tolist() == [0]
    assert matrix.data == pytest.approx(1.0)


def test_a_point_outside_is_told() -> None:
    layout = map_layout("tee", 64)
    far = cKDTree(centres(64)[layout.mask]).query(centres(64).reshape(-1, 2))[0]
    point = centres(64).reshape(-1, 2)[np.argmax(far)]
    with pytest.raises(InputError, match=r"uv\[1\].*outside of the layout of design 'tee'"):
        layout.bilinear(np.stack([centres(64)[layout.mask][0], point]))


def test_an_image_has_values_at_the_mask_and_gives_them_back() -> None:
    layout = map_layout("tee", 64)
    values = np.random.default_rng(0).standard_normal((2, 5, layout.count, 3)).astype(np.float32)
    image = layout.image(values)
    assert image.shape == (2, 5, 3, 64, 64)
    assert np.array_equal(layout.values(image), values)
    assert (image[..., ~layout.mask] == 0.0).all()
    rows, columns = np.nonzero(layout.mask)
    assert np.array_equal(layout.number()[rows, columns], np.arange(layout.count))
    assert np.array_equal(image[1, 4, :, rows[700], columns[700]], values[1, 4, 700])


@pytest.mark.parametrize(("size", "says"), [(65, "65"), (14, "14"), (1026, "1026"), (0, "0")])
def test_sizes_that_cannot_be_are_told(size: int, says: str) -> None:
    with pytest.raises(InputError, match=f"map size {says}: must be even, from 16 to 1024"):
        map_layout("tee", size)


def test_an_unknown_design_is_told() -> None:
    with pytest.raises(InputError, match="'cape'"):
        map_layout("cape", 64)
