import numpy as np
import pytest
import torch

from muslin.garments.errors import InputError
from muslin.learn.graph.batch import batch_pyramids
from muslin.learn.graph.pyramid import build_pyramid
from muslin.learn.graph.unet import GraphUNet
from tests.learn.graph.meshes import renumbered, sheet

LEVELS = 3


def network(seed: int = 0) -> GraphUNet:
    torch.manual_seed(seed)
    made = GraphUNet(5, 3, (8, 12, 16))
    torch.nn.init.normal_(made.last.weight)
    return made.eval()


@pytest.fixture(scope="module")
def pyramids():
    return [build_pyramid(*sheet(*size), LEVELS) for size in ((9, 12), (7, 10), (11, 8))]


def test_meshes_in_a_batch_know_nothing_of_each_other(pyramids):
    net = network()
    xs = [torch.randn(pyramid.counts[0], 5) for pyramid in pyramids]
    together = net(torch.cat(xs), batch_pyramids(pyramids))
    apart = [net(x, batch_pyramids([pyramid])) for x, pyramid in zip(xs, pyramids, strict=True)]
    torch.testing.assert_close(together, torch.cat(apart), atol=1e-5, rtol=1e-5)


def test_batch_tells_the_mesh_of_each_vertex(pyramids):
    graph = batch_pyramids(pyramids).graph
    for level, of_vertex in enumerate(graph):
        assert of_vertex.bincount().tolist() == [pyramid.counts[level] for pyramid in pyramids]


def test_numbering_of_vertices_makes_no_difference():
    x, faces = sheet()
    y, turned, order = renumbered(x, faces)
    net = network()
    features = torch.randn(len(x), 5)
    first = net(features, batch_pyramids([build_pyramid(x, faces, LEVELS)]))
    second = net(features[torch.from_numpy(order)], batch_pyramids([build_pyramid(y, turned, LEVELS)]))
    torch.testing.assert_close(second, first[torch.from_numpy(order)], atol=2e-5, rtol=1e-4)


def test_an_untrained_network_says_zero(pyramids):
    out = GraphUNet(5, 3, (8, 12, 16))(torch.randn(108, 5), batch_pyramids(pyramids[:1]))
    assert out.abs().max() == 0.0


def test_mixed_precision_says_nearly_the_same(pyramids):
    net, x = network(), torch.randn(108, 5)
    exact = net(x, batch_pyramids(pyramids[:1]))
    with torch.autocast("cpu", torch.bfloat16):
        mixed = net(x, batch_pyramids(pyramids[:1]))
    assert (mixed - exact).norm() < 0.03 * exact.norm()


def test_every_weight_learns(pyramids):
    net = network()
    net(torch.randn(108, 5), batch_pyramids(pyramids[:1])).square().sum().backward()
    for name, weight in net.named_parameters():
        assert weight.grad is not None, name
        assert weight.grad.abs().max() > 0.0, name


def test_learns_a_smooth_function_on_two_topologies_and_knows_it_on_a_third():
    """Height above the sheet's edge, from places alone: nothing about one mesh helps on another one."""
    meshes = [sheet(9, 12, 0), sheet(11, 9, 1), sheet(10, 10, 2)]
    batches = [batch_pyramids([build_pyramid(x, faces, LEVELS)]) for x, faces in meshes]
    inputs = [torch.tensor(np.column_stack([x, x[:, :2] ** 2]), dtype=torch.float32) for x, _ in meshes]
    wanted = [torch.stack([torch.sin(3.0 * x[:, 0]), x[:, 1] * x[:, 0], x[:, 2]], dim=1) for x in inputs]
    net = network(3)
    optimizer = torch.optim.AdamW(net.parameters(), lr=3e-3)
    for step in range(300):
        k = step % 2
        loss = (net(inputs[k], batches[k]) - wanted[k]).square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    with torch.no_grad():
        unseen = (net(inputs[2], batches[2]) - wanted[2]).square().mean()
    assert unseen < 0.02 * wanted[2].var()


def test_other_numbers_of_levels_are_told(pyramids):
    with pytest.raises(InputError, match="3 levels for a network of 2"):
        GraphUNet(5, 3, (8, 12))(torch.randn(108, 5), batch_pyramids(pyramids[:1]))
    with pytest.raises(InputError, match="two levels at least"):
        GraphUNet(5, 3, (8,))
    with pytest.raises(InputError, match="no levels"):
        batch_pyramids([])
