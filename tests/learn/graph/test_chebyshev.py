import numpy as np
import pytest
import torch
from torch_geometric.nn import ChebConv

from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges
from muslin.learn.graph.batch import Operator
from muslin.learn.graph.chebyshev import ChebyshevConvolution
from muslin.learn.graph.laplacian import scaled_laplacian
from tests.learn.graph.meshes import sheet


@pytest.fixture(scope="module")
def faces():
    return sheet()[1]


@pytest.fixture(scope="module")
def laplacian(faces):
    return scaled_laplacian(faces, 108)


def test_laplacian_is_symmetric_with_eigenvalues_in_reach_of_the_polynomials(laplacian):
    dense = laplacian.toarray()
    assert np.array_equal(dense, dense.T)
    values = np.linalg.eigvalsh(dense)
    # -1 is the constant function, times the root of the degree.
    assert values[0] == pytest.approx(-1.0, abs=1e-6)
    assert values[-1] < 1.0


def test_laplacian_of_a_triangle():
    dense = scaled_laplacian(np.array([[0, 1, 2]]), 3).toarray()
    np.testing.assert_allclose(dense, -0.5 * (1.0 - np.eye(3)))


@pytest.mark.parametrize("order", [1, 2, 3, 6])
def test_equals_dense_filtering_of_the_spectrum(laplacian, order):
    torch.manual_seed(0)
    layer = ChebyshevConvolution(4, 5, order)
    x = torch.randn(108, 4)
    values, modes = np.linalg.eigh(laplacian.toarray().astype(np.float64))
    spectrum = modes.T @ x.numpy()
    theta = layer.linear.weight.detach().numpy().reshape(5, order, 4)
    # T_k(cos a) = cos k a
    filtered = [np.cos(k * np.arccos(np.clip(values, -1, 1)))[:, None] * spectrum for k in range(order)]
    expected = modes @ sum(f @ theta[:, k].T for k, f in enumerate(filtered))
    expected += layer.linear.bias.detach().numpy()
    np.testing.assert_allclose(layer(x, Operator(laplacian)).detach(), expected, atol=2e-5)


@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_equals_the_layer_of_torch_geometric(faces, laplacian, order):
    torch.manual_seed(1)
    ours, theirs = ChebyshevConvolution(4, 5, order), ChebConv(4, 5, K=order)
    with torch.no_grad():
        for k, linear in enumerate(theirs.lins):
            linear.weight.copy_(ours.linear.weight[:, 4 * k : 4 * k + 4])
        theirs.bias.copy_(ours.linear.bias)
    x = torch.randn(108, 4)
    edges = np.unique(np.concatenate([half_edges(faces), half_edges(faces)[:, ::-1]]), axis=0)
    expected = theirs(x, torch.from_numpy(edges.T.astype(np.int64)))
    torch.testing.assert_close(ours(x, Operator(laplacian)), expected, atol=1e-5, rtol=1e-5)


def test_reaches_as_far_as_its_order(laplacian):
    layer = ChebyshevConvolution(1, 1, 3, bias=False)
    x = torch.zeros(108, 1)
    x[50] = 1.0
    reached = np.flatnonzero(layer(x, Operator(laplacian)).detach().numpy())
    adjacency = (np.abs(laplacian.toarray()) > 0) + np.eye(108)
    assert set(reached) == set(np.flatnonzero((adjacency @ adjacency)[50]))


def test_the_gradient_is_that_of_the_dense_product(laplacian):
    lopsided = laplacian[:40]
    dense = torch.from_numpy(lopsided.toarray())
    x = torch.randn(108, 3, requires_grad=True)
    weight = torch.randn(40, 3)
    (given,) = torch.autograd.grad(((Operator(lopsided) @ x) * weight).sum(), x)
    (expected,) = torch.autograd.grad(((dense @ x) * weight).sum(), x)
    torch.testing.assert_close(given, expected)


def test_an_order_below_one_is_told():
    with pytest.raises(InputError, match="K = 0"):
        ChebyshevConvolution(3, 3, 0)
