import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.learn.drape.smoothing import Smoother, sewn_operators

LENGTH = 0.025


def strip(columns: int, rows: int, seed: int = 0) -> GarmentMesh:
    """A strip of 2 m by 0.4 m; inner vertices at random places."""
    u, v = np.meshgrid(np.linspace(0.0, 2.0, columns), np.linspace(0.0, 0.4, rows))
    flat = np.stack([u.ravel(), v.ravel()], axis=1)
    inner = np.zeros((rows, columns), bool)
    inner[1:-1, 1:-1] = True
    size = 2.0 / columns
    flat[inner.ravel()] += np.random.default_rng(seed).uniform(-0.2 * size, 0.2 * size, (inner.sum(), 2))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below = np.stack([corner, corner + 1, corner + columns + 1], axis=1)
    above = np.stack([corner, corner + columns + 1, corner + columns], axis=1)
    faces = np.concatenate([below, above]).astype(np.int32)
    return GarmentMesh(
        faces=faces,
        panel_faces=faces,
        panel_vertices=flat,
        panel_to_vertex=np.arange(len(flat), dtype=np.int32),
        face_panel=np.zeros(len(faces), np.int32),
        panel_names=("strip",),
        uv=flat / 2.0,
        name="strip",
        parameters={},
    )


def test_constants_stay_and_the_centre_of_mass_too() -> None:
    mesh = template("tee", resolution=1400)
    smooth = Smoother(mesh, LENGTH)
    np.testing.assert_allclose(smooth(np.full((mesh.num_vertices, 2), 0.7)), 0.7, atol=1e-9)
    x = np.random.default_rng(0).standard_normal((mesh.num_vertices, 3))
    np.testing.assert_allclose(mesh.vertex_areas @ smooth(x), mesh.vertex_areas @ x, atol=1e-9)


@pytest.mark.parametrize("wavelength", [0.1, 2.0 * np.pi * LENGTH, 0.3])
@pytest.mark.parametrize("columns", [161, 241])
def test_a_wave_keeps_its_share_on_any_triangulation(wavelength: float, columns: int) -> None:
    mesh = strip(columns, columns // 5)
    u = mesh.panel_vertices[:, 0]
    wave = np.cos(2.0 * np.pi * u / wavelength)
    kept = Smoother(mesh, LENGTH)(wave[:, None])[:, 0]
    inside = np.abs(u - 1.0) < 0.5
    share = (kept[inside] @ wave[inside]) / (wave[inside] @ wave[inside])
    expected = 1.0 / (1.0 + (2.0 * np.pi * LENGTH / wavelength) ** 4)
    # Eight edges a wave, or more.
    assert share == pytest.approx(expected, abs=0.02)


def test_it_is_symmetric_in_the_mass() -> None:
    mesh = template("tee", resolution=403)
    mass, stiffness = sewn_operators(mesh)
    assert abs(stiffness - stiffness.T).max() < 1e-12
    smooth = Smoother(mesh, LENGTH)(np.eye(mesh.num_vertices))
    weighted = mass[:, None] * smooth
    np.testing.assert_allclose(weighted, weighted.T, atol=1e-12)


def test_a_length_that_is_none_is_told() -> None:
    with pytest.raises(InputError, match="positive"):
        Smoother(template("tee", resolution=403), 0.0)
