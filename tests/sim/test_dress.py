"""A tee put on every default body, at the ends of their shape spaces: no intersection, and really worn."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from muslin.garments import catalogue
from muslin.garments.errors import InputError
from muslin.garments.pattern import Pattern
from muslin.garments.triangulate import triangulate
from muslin.sim.body import load_body
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.dress import LEAST_GIRTH, grow_body, place, shrunk_body
from muslin.sim.material import load_fabric
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.wear import WornGarment

EDGE_LENGTH = 0.06


@pytest.fixture(scope="module")
def tee():
    design = catalogue.get("tee")
    return triangulate(design.pattern(**design.preset("tshirt")), EDGE_LENGTH)


def betas(model, first: float) -> np.ndarray:
    return np.array([first, first, *np.zeros(model.num_betas - 2)])


def weights_below(model, sim) -> np.ndarray:
    """(V, 24) skinning weights of the body's vertex nearest to each vertex of the cloth."""
    return model.weights[cKDTree(sim.collider_vertices).query(sim.positions)[1]]


@pytest.mark.parametrize(
    ("name", "first"), [("male", 0.0), ("neutral", 0.0), ("female", 2.0), ("female", -2.0)]
)
def test_dressed_without_intersections(tee, name, first):
    model = load_body(name)
    beta = betas(model, first)
    cloth = build_cloth(tee, load_fabric("gray-interlock"))
    worn = WornGarment([tee], [cloth], model, beta, ContactSettings(), SolverSettings(), "cpu")
    positions = worn.sim.positions
    live = np.ones(len(model.faces), bool)
    live[worn.masked_faces()] = False
    counts = count_intersections(positions, tee.faces, worn.body(), model.faces[live])
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)
    joints = model.joints(beta)
    left_arm, right_arm = joints[16], joints[17]
    assert positions[:, 0].max() > left_arm[0]
    assert positions[:, 0].min() < right_arm[0]
    # Around the trunk: cloth before and behind, to the left and to the right of the chest.
    chest = positions[np.abs(positions[:, 1] - joints[6][1]) < 0.08] - joints[6]
    assert (chest.max(axis=0)[[0, 2]] > 0.05).all()
    assert (chest.min(axis=0)[[0, 2]] < -0.05).all()
    assert positions[:, 1].max() < joints[15][1], "not over the head"


def test_placed_garment_encloses_the_bones_without_touching_them(tee):
    model = load_body("female")
    beta = betas(model, 0.0)
    body = model.vertices(beta, np.zeros((24, 3)))
    start = place(tee, model, beta, body)
    bones = shrunk_body(model, beta, body, LEAST_GIRTH)
    counts = count_intersections(start, tee.faces, bones, model.faces)
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)
    np.testing.assert_allclose(np.abs(start[:, 0]).max(), -start[:, 0].min(), atol=0.02)


def test_shrinking_draws_the_body_towards_its_bones():
    model = load_body("male")
    beta = betas(model, 1.0)
    body = model.vertices(beta, np.zeros((24, 3)))
    np.testing.assert_allclose(shrunk_body(model, beta, body, 1.0), body, atol=1e-12)
    centre = shrunk_body(model, beta, body, 0.0)
    np.testing.assert_allclose(shrunk_body(model, beta, body, 0.25), 0.75 * centre + 0.25 * body, atol=1e-12)
    low, high = model.joints(beta).min(axis=0) - 0.2, model.joints(beta).max(axis=0) + 0.2
    assert ((centre > low) & (centre < high)).all()


def test_growing_ends_on_the_body_itself(tee):
    model = load_body("female")
    beta = betas(model, 0.0)
    body = model.vertices(beta, np.zeros((24, 3)))
    sim = ClothSimulator(
        build_cloth(tee, load_fabric("gray-interlock")),
        place(tee, model, beta, body),
        shrunk_body(model, beta, body, LEAST_GIRTH),
        model.faces,
    )
    ticks = []
    grow_body(sim, model, beta, body, lambda: ticks.append(1))
    # The target is met but for the rounding of a move made in parts.
    np.testing.assert_allclose(sim.collider_vertices, body, atol=1e-9)
    assert len(ticks) > 10
    np.testing.assert_allclose(weights_below(model, sim)[:, [4, 5, 7, 8, 10, 11]].sum(), 0, atol=1e-6)


@pytest.mark.parametrize("edge_length", [0.02, 0.04, 0.08])
@pytest.mark.parametrize("preset", ["top", "tshirt", "sweater", "short_dress", "long_dress"])
def test_every_preset_can_be_placed_at_every_resolution(preset, edge_length):
    design = catalogue.get("tee")
    mesh = triangulate(design.pattern(**design.preset(preset)), edge_length)
    model = load_body("female")
    beta = betas(model, 0.0)
    start = place(mesh, model, beta, model.vertices(beta, np.zeros((24, 3))))
    assert np.isfinite(start).all()
    assert start.shape == (mesh.num_vertices, 3)


def test_a_garment_that_cuts_through_the_skeleton_is_refused():
    """Triangles longer than a sleeve is wide do not go around an arm."""
    design = catalogue.get("tee")
    mesh = triangulate(design.pattern(**design.preset("top")), 0.1)
    model = load_body("female")
    cloth = build_cloth(mesh, load_fabric("gray-interlock"))
    with pytest.raises(InputError, match=r"'female' it has \d+ .* smaller garment\.edge_length"):
        WornGarment([mesh], [cloth], model, betas(model, 0.0), ContactSettings(), SolverSettings(), "cpu")


def test_sleeves_without_a_front_cannot_be_worn():
    pattern = catalogue.get("tee").pattern()
    alone = Pattern("sleeve", (pattern.panel("sleeve_left"),), ())
    model = load_body("female")
    beta = betas(model, 0.0)
    with pytest.raises(InputError, match="'sleeve': sleeves are placed by the shoulder of a panel front"):
        place(triangulate(alone, EDGE_LENGTH), model, beta, model.vertices(beta, np.zeros((24, 3))))


def test_a_flat_sheet_cannot_be_worn():
    mesh = triangulate(catalogue.get("sheet").pattern(), 0.2)
    model = load_body("female")
    beta = betas(model, 0.0)
    with pytest.raises(InputError, match=r"cannot place panels .* allowed are front, back, sleeve_left"):
        place(mesh, model, beta, model.vertices(beta, np.zeros((24, 3))))
