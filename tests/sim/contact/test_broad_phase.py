"""Every pair that comes within range is listed, once: against all pairs of random triangle soups."""

import numpy as np
import pytest
import warp as wp

from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings, ContactSystem
from muslin.sim.material import load_fabric

RANGE, MARGIN = ContactSettings().range, ContactSettings().margin


def random_soup(count: int, seed: int, size: float = 0.02, box: float = 0.05) -> np.ndarray:
    """(3 count, 3): triangles of about `size` with their centres in a box."""
    draw = np.random.default_rng(seed)
    corners = size * draw.normal(size=(count, 3, 3))
    return (corners + box * draw.uniform(-1, 1, size=(count, 1, 3))).reshape(-1, 3)


def all_pairs(soup, is_edge_edge: bool) -> np.ndarray:
    """(K, 4): every pair of primitives of two triangles at least one of which is cloth."""
    faces = np.arange(3 * soup.num_triangles).reshape(-1, 3)
    first, second = np.meshgrid(np.arange(len(faces)), np.arange(len(faces)), indexing="ij")
    cloth = soup.num_cloth // 3
    keep = (first != second) & ((first < cloth) | (second < cloth))
    if is_edge_edge:
        keep &= first < second
    a, b = faces[first[keep]], faces[second[keep]]
    if not is_edge_edge:
        return np.concatenate([np.column_stack([a[:, k], b]) for k in range(3)])
    edges = [(0, 1), (1, 2), (2, 0)]
    return np.concatenate([np.column_stack([a[:, e], b[:, f]]) for e in edges for f in edges])


def keys(pairs: np.ndarray, is_edge_edge: bool) -> list[tuple]:
    """The same key for the same two primitives, however their vertices are ordered."""
    if is_edge_edge:
        return [tuple(sorted([tuple(sorted(pair[:2])), tuple(sorted(pair[2:]))])) for pair in pairs.tolist()]
    return [(pair[0], *sorted(pair[1:])) for pair in pairs.tolist()]


def near(closest, soup, paths, is_edge_edge: bool, distance: float) -> set[tuple]:
    """Pairs that are closer than `distance` in any of the configurations."""
    pairs = all_pairs(soup, is_edge_edge)
    hit = np.zeros(len(pairs), bool)
    for points in paths:
        hit |= closest(points[pairs], is_edge_edge)[1] < distance
    return set(keys(pairs[hit], is_edge_edge))


@pytest.mark.parametrize("is_edge_edge", [False, True], ids=["vertex-face", "edge-edge"])
@pytest.mark.parametrize(("cloth", "collider"), [(40, 0), (15, 25), (3, 150), (30, 1)])
@pytest.mark.parametrize("speed", [0.0, 0.003, 0.05])
def test_all_near_pairs_are_listed_once(make_soup, closest, cloth, collider, speed, is_edge_edge):
    soup = make_soup(cloth, collider)
    points = random_soup(cloth + collider, seed=cloth, box=0.02)
    move = speed * np.random.default_rng(9).normal(size=points.shape)
    soup.search(points, move)
    listed = keys(soup.pairs(is_edge_edge), is_edge_edge)
    path = [points + t * move for t in np.linspace(0, 1, 9)]
    wanted = near(closest, soup, path, is_edge_edge, RANGE + MARGIN)
    assert wanted
    assert wanted <= set(listed)
    assert len(set(listed)) == len(listed)
    assert set(listed) <= set(keys(all_pairs(soup, is_edge_edge), is_edge_edge))


@pytest.mark.parametrize("is_edge_edge", [False, True], ids=["vertex-face", "edge-edge"])
def test_far_pairs_are_left_out(make_soup, closest, is_edge_edge):
    soup = make_soup(20, 20)
    points = random_soup(40, seed=1, size=0.005, box=0.2)
    soup.search(points)
    listed = len(soup.pairs(is_edge_edge))
    assert listed < 0.05 * len(all_pairs(soup, is_edge_edge))


def test_a_list_longer_than_its_room_grows(make_soup):
    soup = make_soup(60, 0)
    points = random_soup(60, seed=5, size=0.002, box=0.0005)
    room = [len(pairs.pairs) for pairs in soup.contact.lists]
    soup.search(points)
    for pairs, before in zip(soup.contact.lists, room, strict=True):
        assert before < pairs.length <= len(pairs.pairs)
    assert set(keys(soup.pairs(True), True)) <= set(keys(all_pairs(soup, True), True))


@pytest.mark.parametrize("is_edge_edge", [False, True], ids=["vertex-face", "edge-edge"])
def test_small_moves_need_no_search_and_miss_nothing(make_soup, closest, is_edge_edge):
    soup = make_soup(20, 20)
    points = random_soup(40, seed=2)
    soup.search(points)
    draw = np.random.default_rng(4)
    for _ in range(4):
        move = draw.normal(size=points.shape)
        move *= 0.12 * MARGIN / np.linalg.norm(move, axis=1, keepdims=True)
        assert soup.cover(points, move) == 0
        soup.contact.search.spend()
        points = points + move
        wanted = near(closest, soup, [points], is_edge_edge, RANGE)
        assert wanted <= set(keys(soup.pairs(is_edge_edge), is_edge_edge))
    assert soup.cover(points, 0.12 * MARGIN * np.sign(draw.normal(size=points.shape))) > 0


def test_a_move_that_is_covered_but_not_made_costs_nothing(make_soup):
    soup = make_soup(20, 20)
    points = random_soup(40, seed=2)
    soup.search(points)
    move = np.random.default_rng(4).normal(size=points.shape)
    move *= 0.3 * MARGIN / np.linalg.norm(move, axis=1, keepdims=True)
    for _ in range(5):
        assert soup.cover(points, move) == 0


@pytest.mark.parametrize("is_edge_edge", [False, True], ids=["vertex-face", "edge-edge"])
@pytest.mark.parametrize("speed", [0.001, 0.01])
def test_on_a_long_way_nothing_is_missing_or_listed_twice(make_soup, closest, is_edge_edge, speed):
    """Everything turns and shifts as one, some triangles wander besides, and a collider flies by."""
    soup = make_soup(40, 10)
    points = random_soup(50, seed=12, box=0.02)
    soup.search(points)
    draw = np.random.default_rng(5)
    listings = 0
    for round_ in range(8):
        move = np.cross([0.1, -0.2, 0.1], points) + np.array([0.03, 0.0, -0.01])
        move += 0.02 * MARGIN * draw.normal(size=move.shape)
        move[9 * round_ : 9 * round_ + 9] += speed * draw.normal(size=3)
        move[-15:] += 3.0 * speed * draw.normal(size=3)
        listings += soup.cover(points, move)
        path = [points + t * move for t in np.linspace(0, 1, 5)]
        listed = keys(soup.pairs(is_edge_edge), is_edge_edge)
        wanted = near(closest, soup, path, is_edge_edge, RANGE)
        assert wanted
        assert wanted <= set(listed)
        assert len(set(listed)) == len(listed)
        soup.contact.search.spend()
        points = points + draw.choice([0.3, 1.0]) * move
    assert listings > 0


@pytest.mark.parametrize("is_edge_edge", [False, True], ids=["vertex-face", "edge-edge"])
def test_a_shortened_move_is_covered_where_it_has_changed(make_soup, closest, is_edge_edge):
    """Of a motion that all share, some vertices make a part only: they meet others that they never met."""
    soup = make_soup(30, 10)
    points = random_soup(40, seed=6, box=0.02)
    move = np.tile([0.05, 0.0, 0.02], (len(points), 1))
    soup.search(points, move)
    fraction = np.ones(len(points))
    fraction[12:30] = 0.4
    looked = soup.cover(points, move * fraction[:, None], fraction)
    path = [points + t * fraction[:, None] * move for t in np.linspace(0, 1, 9)]
    wanted = near(closest, soup, path, is_edge_edge, RANGE)
    listed = keys(soup.pairs(is_edge_edge), is_edge_edge)
    assert looked > 0
    assert wanted
    assert wanted <= set(listed)
    assert len(set(listed)) == len(listed)


@pytest.mark.parametrize("is_edge_edge", [False, True], ids=["vertex-face", "edge-edge"])
def test_at_rest_exactly_the_near_pairs_are_listed(make_soup, closest, is_edge_edge):
    soup = make_soup(20, 20)
    points = random_soup(40, seed=3)
    soup.search(points)
    wanted = near(closest, soup, [points], is_edge_edge, RANGE + MARGIN)
    assert set(keys(soup.pairs(is_edge_edge), is_edge_edge)) == wanted


def test_neighbours_are_no_pairs(grid_mesh):
    """Primitives that share a vertex touch by construction."""
    mesh = grid_mesh(3, 3, 1e-3)
    cloth = build_cloth(mesh, load_fabric("gray-interlock"))
    flat = np.insert(mesh.panel_vertices, 2, 0.0, axis=1)
    contact = ContactSystem(cloth, np.zeros((0, 3), np.int32), flat, ContactSettings(), "cpu")
    contact.search.renew(wp.array(flat, dtype=wp.vec3d, device="cpu"))
    for pairs in contact.lists:
        listed = pairs.pairs.numpy()[: pairs.length]
        assert len(listed) > 50
        assert all(len(set(pair)) == 4 for pair in listed.tolist())
