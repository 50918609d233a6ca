"""Pictures, films and the window of a cloth whose mesh is replaced while it moves."""

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.merge import merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.garments.triangulate import triangulate
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.remeshed import sample_of_frames
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.lighting import Quality
from muslin.sim.view.movie import movie_frames
from muslin.sim.view.picture import garment_colours, picture, sample_layers
from muslin.sim.view.window import draw

COARSE = Quality(ambient_rays=8, key_rays=2, pixel_samples=1, ground_cells=12)
SIZE = (120, 160)
SHEET = catalogue.get("sheet").pattern()


def level(mesh: GarmentMesh) -> np.ndarray:
    """(V, 3): the mesh lying flat; x = u, z = -v."""
    points = np.zeros((mesh.num_vertices, 3))
    points[mesh.panel_to_vertex] = np.insert(mesh.panel_vertices * [1.0, -1.0], 1, 0.4, axis=1)
    return points


def still_sheet(meshes: list[GarmentMesh]) -> Sample:
    """The same flat sheet in every frame, on these meshes."""
    sample = sample_of_frames(
        meshes,
        [level(mesh) for mesh in meshes],
        id="sheet",
        kind="sequence",
        certificate=Certificate(),
        fps=30.0,
    )
    return sample.validate()


@pytest.fixture(scope="module")
def sample() -> Sample:
    coarse, fine = triangulate(SHEET, 0.25), triangulate(SHEET, 0.1)
    return still_sheet([coarse, coarse, fine, coarse])


def test_a_layer_is_the_mesh_of_its_frame(sample: Sample) -> None:
    for frame in range(sample.num_frames):
        layer = sample_layers(sample, frame)[-1]
        mesh = sample.frame_garment(frame)
        np.testing.assert_array_equal(layer.faces, mesh.faces)
        np.testing.assert_array_equal(layer.vertices, sample.frame_positions(frame))
        assert layer.seams is not None
        # all that is cut of a sheet is its border
        assert layer.seams.sum() == len(mesh.boundary_edges)


def test_one_surface_looks_the_same_on_every_mesh(sample: Sample) -> None:
    frames = movie_frames(sample, range(sample.num_frames), SIZE, COARSE)
    assert frames[0].shape == (SIZE[1], SIZE[0], 3)
    blue = [(f[..., 2].astype(int) - f[..., 0] > 25) for f in frames]  # the cloth, on a grey ground
    assert blue[0].sum() > 500
    for other in blue[1:]:
        assert (blue[0] != other).sum() < 0.01 * blue[0].sum()
    alone = picture(sample, 2, SIZE, quality=COARSE)
    assert np.abs(alone.astype(int) - frames[2]).mean() < 20


def test_colours_of_several_garments_follow_the_topology() -> None:
    meshes = [
        merge_meshes(["under", "over"], [triangulate(SHEET, length), triangulate(SHEET, 0.3)])
        for length in (0.3, 0.15)
    ]
    both = still_sheet(meshes)
    for frame, mesh in enumerate(meshes):
        colours = garment_colours(both, frame)
        assert colours.shape == (mesh.num_vertices, 3)
        over = triangulate(SHEET, 0.3).num_vertices
        assert (colours[:-over] == colours[0]).all()
        assert (colours[-over:] == colours[-1]).all()
        assert (colours[0] != colours[-1]).any()


def test_the_window_takes_the_mesh_of_each_frame(sample: Sample) -> None:
    import pyvista

    plotter = pyvista.Plotter(off_screen=True)
    for frame in range(sample.num_frames):
        draw(plotter, sample, frame)
        (actor,) = plotter.actors.values()
        assert actor.mapper.dataset.n_cells == len(sample.frame_garment(frame).faces)
