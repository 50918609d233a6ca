"""Bootstrap intervals: how often they hold the mean, what they must not depend on, and who wins."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from muslin.eval.metrics.bootstrap import mean_interval, mean_intervals, paired
from muslin.garments.errors import InputError

numbers = st.floats(-1e3, 1e3, allow_nan=False).map(lambda x: round(x, 3))


def coverage(values: np.ndarray, mean: float, **options) -> tuple[float, float]:
    """Share of the columns whose interval holds the mean, and its standard error."""
    _, low, high = mean_intervals(values, resamples=4000, **options)
    share = float(((low <= mean) & (mean <= high)).mean())
    return share, np.sqrt(share * (1 - share) / values.shape[1])


@pytest.mark.parametrize("n", [10, 30])
def test_95_of_100_intervals_hold_the_mean_of_normal_values(n):
    # 1,000 experiments: a share of 0.95 has a standard error of 0.0069, so 0.93 to 0.97 is nearly 3 of them.
    share, error = coverage(np.random.default_rng(1).normal(3.0, 2.0, (n, 1000)), 3.0)
    assert error < 0.008
    assert 0.93 <= share <= 0.97


def test_coverage_holds_at_another_confidence():
    share, _ = coverage(np.random.default_rng(2).normal(size=(30, 1000)), 0.0, confidence=0.8)
    assert 0.8 - 3 * 0.0127 <= share <= 0.8 + 3 * 0.0127


def test_intervals_of_skewed_values_lean_to_the_long_tail():
    values = np.random.default_rng(3).lognormal(0.0, 0.7, (30, 1000))
    mean, low, high = mean_intervals(values, resamples=4000)
    assert (high - mean).mean() > 1.2 * (mean - low).mean()
    share, _ = coverage(values, float(np.exp(0.7**2 / 2)))
    assert share > 0.91


def test_clusters_cover_where_samples_alone_do_not():
    random = np.random.default_rng(4)
    of_sample = np.repeat(np.arange(20), 10)
    values = random.normal(size=(20, 1000))[of_sample] + 0.3 * random.normal(size=(200, 1000))
    clustered, _ = coverage(values, 0.0, clusters=of_sample.tolist())
    alone, _ = coverage(values, 0.0)
    assert 0.93 <= clustered <= 0.97
    assert alone < 0.6


def test_agrees_with_scipy_where_samples_are_many():
    # With n = 2000 the expansion is negligible, so BCa of scipy is a reference.
    values = np.random.default_rng(5).exponential(size=2000)
    ours = mean_interval(values, resamples=20000)
    theirs = stats.bootstrap((values,), np.mean, n_resamples=2000, method="BCa", rng=0, vectorized=True)
    width = theirs.confidence_interval.high - theirs.confidence_interval.low
    assert ours.low == pytest.approx(theirs.confidence_interval.low, abs=0.06 * width)
    assert ours.high == pytest.approx(theirs.confidence_interval.high, abs=0.06 * width)


@pytest.mark.parametrize("clusters", [None, [0, 0, 1, 2, 2, 2, 3, 4, 5, 6, 6, 7]])
def test_agrees_with_the_formula_written_out(clusters):
    x = np.random.default_rng(9).exponential(size=12) ** 2
    groups = (
        [x[[k]] for k in range(12)] if clusters is None else [x[np.array(clusters) == k] for k in range(8)]
    )
    n, m = len(groups), x.mean()
    drawn = np.random.default_rng(3).integers(0, n, (3000, n))
    means = np.array([np.concatenate([groups[k] for k in row]).mean() for row in drawn])
    without = np.array([np.concatenate(groups[:k] + groups[k + 1 :]).mean() for k in range(n)])
    d = without.mean() - without
    a = (d**3).sum() / (6 * (d**2).sum() ** 1.5)
    equal = np.isclose(means, m, rtol=1e-12)  # every group once
    z0 = stats.norm.ppf(((means < m) & ~equal).mean() + 0.5 * equal.mean())
    z = np.sqrt(n / (n - 1)) * stats.t.ppf([0.025, 0.975], n - 1)
    shares = stats.norm.cdf(z0 + (z0 + z) / (1 - a * (z0 + z)))
    found = mean_interval(x, clusters, resamples=3000, seed=3)
    assert (found.low, found.high) == pytest.approx(tuple(np.quantile(means, shares)))


@given(st.lists(numbers, min_size=5, max_size=12), st.floats(0.1, 50), st.floats(-100, 100))
def test_interval_holds_its_mean_and_moves_with_the_values(values, scale, shift):
    x = np.array(values)
    one = mean_interval(x, resamples=300)
    other = mean_interval(scale * x + shift, resamples=300)
    size = 1e-9 * (1 + scale * np.abs(x).max() + abs(shift))
    assert x.min() - size <= one.low <= one.high <= x.max() + size
    assert other.low == pytest.approx(scale * one.low + shift, abs=size)
    assert other.high == pytest.approx(scale * one.high + shift, abs=size)


def test_same_seed_same_interval_and_columns_are_independent():
    values = np.random.default_rng(6).normal(size=(9, 4))
    together = mean_intervals(values, resamples=500, seed=7)
    for k in range(4):
        alone = mean_interval(values[:, k], resamples=500, seed=7)
        assert (alone.mean, alone.low, alone.high) == pytest.approx([column[k] for column in together])
    assert mean_interval(values[:, 0], seed=1) != mean_interval(values[:, 0], seed=2)


def test_degenerate_samples():
    assert mean_interval([4.0]) == mean_interval([4.0], clusters=["a"])
    assert (mean_interval([4.0]).low, mean_interval([4.0]).high) == (None, None)
    assert mean_interval([1.0, 3.0, 4.0, 8.0]).low is None
    assert mean_interval([1.0, 3.0, 4.0, 8.0, 5.0]).low is not None
    assert mean_interval([1.0, 3.0, 4.0, 8.0, 5.0], clusters=list("aabbb")).low is None
    equal = mean_interval([0.1] * 7)
    assert (equal.mean, equal.low, equal.high) == pytest.approx((0.1, 0.1, 0.1))


def test_one_cluster_a_sample_is_no_cluster():
    values = [1.0, 5.0, 2.0, 8.0, 3.0]
    assert mean_interval(values, clusters=list("abcde")) == mean_interval(values)


def test_paired_tells_methods_apart_whose_intervals_overlap():
    random = np.random.default_rng(8)
    hard = random.uniform(5.0, 50.0, 40)
    first, second = hard, hard + 1.0 + 0.1 * random.normal(size=40)
    ours, theirs = mean_interval(first), mean_interval(second)
    assert ours.high > theirs.low
    found = paired(first, second)
    assert found.decided
    assert found.difference.mean == pytest.approx((first - second).mean())
    assert found.difference.low < -1.0 < found.difference.high < 0
    assert (found.first, found.second, found.equal) == (40, 0, 0)


def test_paired_counts_wins_and_ties():
    found = paired([1.0, 2.0, 3.0, 4.0], [2.0, 2.0, 1.0, 9.0])
    assert (found.first, found.second, found.equal) == (2, 1, 1)
    assert not found.decided
    swapped = paired([2.0, 2.0, 1.0, 9.0], [1.0, 2.0, 3.0, 4.0])
    higher = paired([1.0, 2.0, 3.0, 4.0], [2.0, 2.0, 1.0, 9.0], lower_is_better=False)
    assert (higher.first, higher.second, higher.difference) == (1, 2, found.difference)
    assert swapped.difference.mean == -found.difference.mean


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: mean_interval([]), "at least one"),
        (lambda: mean_interval([1.0, np.nan]), "NaN"),
        (lambda: mean_interval([[1.0]]), "shape"),
        (lambda: mean_interval([1.0, 2.0], clusters=["a"]), "1 clusters of 2"),
        (lambda: mean_interval([1.0], confidence=95), "confidence = 95"),
        (lambda: mean_interval([1.0], resamples=0), "resamples = 0"),
        (lambda: paired([1.0], [1.0, 2.0]), "same samples"),
    ],
)
def test_bad_input_is_named(call, says):
    with pytest.raises(InputError, match=says):
        call()
