import numpy as np
import pytest
import torch

from muslin.garments.errors import InputError
from muslin.garments.template import template
from muslin.learn.drape.mean import MeanDrape
from tests.learn.drape.test_smoothing import strip

NAMES = ("sleeve_length", "garment_length")


def linear() -> MeanDrape:
    """x = m + A q: every vertex of the 403 template moves down as the garment gets longer."""
    network = MeanDrape("tee", NAMES)
    count = len(network.mean)
    with torch.no_grad():
        network.mean.copy_(torch.linspace(0.0, 1.0, 3 * count).unflatten(0, (count, 3)))
        network.linear.weight.unflatten(0, (count, 3))[:, 1, 1] = -1.0
    return network


def test_a_new_network_says_the_mean_of_what_it_was_given() -> None:
    network = MeanDrape("tee", NAMES)
    drapes = torch.randn(5, len(network.mean), 3)
    network.normalise(torch.rand(5, 2), drapes)
    torch.testing.assert_close(network(torch.rand(3, 2)), drapes.mean(0).expand(3, -1, -1))


def test_the_linear_part_goes_by_the_parameters() -> None:
    network = linear()
    short, long = network(torch.tensor([[0.2, 0.6], [0.2, 0.9]]))
    torch.testing.assert_close(long[:, 1], short[:, 1] - 0.3)
    torch.testing.assert_close(long[:, 0], short[:, 0])


def test_a_triangulation_gets_the_template_at_the_same_places() -> None:
    network = linear()
    parameters = {"sleeve_length": 0.2, "garment_length": 0.7}
    own, fine = (template("tee", parameters, resolution) for resolution in (403, 1400))
    at_own, at_fine = network.at(own), network.at(fine)
    np.testing.assert_allclose(
        at_own, network(network.parameters_of(own.parameters)[None])[0].detach(), atol=1e-6
    )
    assert at_fine.shape == (fine.num_vertices, 3)
    assert at_fine.min() >= at_own.min() - 1e-9
    assert at_fine.max() <= at_own.max() + 1e-9


def test_what_it_does_not_know_is_told() -> None:
    network = linear()
    with pytest.raises(InputError, match="'strip'"):
        network.at(strip(11, 5))
    with pytest.raises(InputError, match="garment_length"):
        network.parameters_of({"sleeve_length": 0.2})
    with pytest.raises(InputError, match="resolution = 5"):
        MeanDrape("tee", NAMES, 5)
