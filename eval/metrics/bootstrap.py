"""How sure a mean over samples is: bootstrap intervals, and two methods on the same samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import t as student_t

from muslin.garments.errors import InputError

CONFIDENCE = 0.95
RESAMPLES = 10_000
FEWEST = 5
"""Of samples, or clusters, that get an interval: one of three normal values would hold the mean 74 times in
100 where it says 95."""
DRAWS_AT_ONCE = 4_000_000


@dataclass(frozen=True)
class Interval:
    """A mean with the interval that holds the true one with probability `confidence`.

    low, high   None for fewer than `FEWEST` samples (or clusters of them)
    n           samples
    """

    mean: float
    low: float | None
    high: float | None
    n: int


@dataclass(frozen=True)
class Paired:
    """A first method against a second on the same samples.

    difference     of the means, first minus second
    first, second  samples on which each has the better figure
    equal          samples on which neither has
    """

    difference: Interval
    first: int
    second: int
    equal: int

    @property
    def decided(self) -> bool:
        """Whether the interval of the difference leaves out zero."""
        low, high = self.difference.low, self.difference.high
        return low is not None and high is not None and (low > 0 or high < 0)


def mean_interval(
    values: ArrayLike,
    clusters: Sequence[object] | None = None,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Mean of one figure a sample, with its bootstrap interval (see `mean_intervals`).

    values     (n,)
    clusters   of each sample, what is drawn with it; None draws sample by sample
    """
    x = np.asarray(values, dtype=np.float64)
    if x.ndim != 1:
        raise InputError(f"bootstrap: values of shape {x.shape}; one figure a sample is needed, (n,)")
    mean, low, high = mean_intervals(x[:, None], clusters, confidence, resamples, seed)
    if np.isnan(low[0]):
        return Interval(float(mean[0]), None, None, len(x))
    return Interval(float(mean[0]), float(low[0]), float(high[0]), len(x))


def mean_intervals(
    values: ArrayLike,
    clusters: Sequence[object] | None = None,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Means of k figures over n samples, with expanded BCa bootstrap intervals.

    Samples are independent, frames and vertices of one sample are not: so a sample is drawn whole, with all
    its k figures (its frames, say). With `clusters`, all samples of a cluster (a design, say) are drawn
    together, and the mean stays that of samples.

    With m = ∑ x_i / n, means m* of `resamples` draws of n samples with replacement, and the distribution
    function Φ of the standard normal:

        z0     = Φ⁻¹(share of m* below m, those equal counted half)
        a      = ∑ (m. - m_(i))³ / (6 (∑ (m. - m_(i))²)^(3/2)),   m_(i): mean without sample i, m.: their mean
        z(α)   = √(n / (n - 1)) t_(n-1)(α)
        α₁,₂   = Φ(z0 + (z0 + z) / (1 - a (z0 + z))),             z = z(α / 2), z(1 - α / 2)
        low, high = quantiles α₁, α₂ of m*

    BCa uses the normal quantile for z(α), and its intervals of small samples are too short; the factor and
    Student's t make up for it, exactly so for means of normal values.

    values     (n, k)
    returns    mean, low, high, each (k,); low and high are NaN for fewer than `FEWEST` samples or clusters
    Raises InputError for no value, NaN or infinity, and clusters of another number.

    Sources: Efron 1987, "Better Bootstrap Confidence Intervals" (BCa); Hesterberg 2015, "What Teachers Should
    Know About the Bootstrap", §4.2 (the expansion, there of percentile intervals).
    """
    x = np.asarray(values, dtype=np.float64)
    _check(x, clusters, confidence, resamples)
    sums, counts = _by_cluster(x, clusters)
    n = len(sums)
    mean = sums.sum(axis=0) / counts.sum()
    if n < FEWEST:
        return mean, np.full_like(mean, np.nan), np.full_like(mean, np.nan)
    drawn = np.concatenate(
        [(w @ sums) / (w @ counts)[:, None] for w in _draws(n, resamples, np.random.default_rng(seed))]
    )
    drawn.sort(axis=0)
    # Draws of equal values differ from their mean by rounding alone, on either side or not by chance.
    slack = 1e-12 * np.abs(x).max(axis=0)
    below = (drawn < mean - slack).mean(axis=0) + 0.5 * (np.abs(drawn - mean) <= slack).mean(axis=0)
    z0 = ndtri(np.clip(below, 0.5 / resamples, 1 - 0.5 / resamples))
    a = _acceleration(sums, counts)
    tail = 0.5 * (1.0 - confidence)
    bounds = []
    for share in (tail, 1.0 - tail):
        z = np.sqrt(n / (n - 1)) * student_t.ppf(share, n - 1)
        reach = z0 + z
        bounds.append(_quantiles(drawn, ndtr(z0 + reach / np.maximum(1.0 - a * reach, 1e-12))))
    return mean, bounds[0], bounds[1]


def paired(
    first: ArrayLike,
    second: ArrayLike,
    clusters: Sequence[object] | None = None,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
    lower_is_better: bool = True,
) -> Paired:
    """Two methods on the same samples: the interval of the mean of the differences, and who wins how often.

    What makes a sample hard for both cancels in its difference, so this tells methods apart whose own
    intervals overlap.

    first, second   (n,), the same figure of the same samples in the same order
    Raises InputError as `mean_intervals`, and for arrays of two lengths.
    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    if a.shape != b.shape or a.ndim != 1:
        raise InputError(
            f"paired comparison of {a.shape} and {b.shape} figures; give both methods on the same samples"
        )
    difference = mean_interval(a - b, clusters, confidence, resamples, seed)
    lower, higher = int((a < b).sum()), int((a > b).sum())
    wins, losses = (lower, higher) if lower_is_better else (higher, lower)
    return Paired(difference, wins, losses, len(a) - lower - higher)


def _check(x: np.ndarray, clusters: Sequence[object] | None, confidence: float, resamples: int) -> None:
    if x.ndim != 2 or x.size == 0:
        raise InputError(f"bootstrap: values of shape {x.shape}; at least one sample is needed, (n, k)")
    if not np.isfinite(x).all():
        raise InputError("bootstrap: NaN or infinity among the values; leave such samples out, and say so")
    if clusters is not None and len(clusters) != len(x):
        raise InputError(f"bootstrap: {len(clusters)} clusters of {len(x)} samples; give one a sample")
    if not 0 < confidence < 1:
        raise InputError(f"bootstrap: confidence = {confidence} is not allowed; it must be between 0 and 1")
    if resamples < 1:
        raise InputError(f"bootstrap: resamples = {resamples} is not allowed; it must be 1 or more")


def _by_cluster(x: np.ndarray, clusters: Sequence[object] | None) -> tuple[np.ndarray, np.ndarray]:
    """Sums of the figures (g, k) and numbers of samples (g,) of each cluster."""
    if clusters is None:
        return x, np.ones(len(x))
    place = {name: k for k, name in enumerate(dict.fromkeys(clusters))}
    of_sample = np.array([place[name] for name in clusters])
    sums = np.zeros((len(place), x.shape[1]))
    np.add.at(sums, of_sample, x)
    return sums, np.bincount(of_sample).astype(np.float64)


def _draws(n: int, resamples: int, random: np.random.Generator) -> Iterator[np.ndarray]:
    """How often each of n is drawn in each resample: rows of n counts that sum to n."""
    most = max(1, DRAWS_AT_ONCE // n)
    for start in range(0, resamples, most):
        rows = min(most, resamples - start)
        chosen = random.integers(0, n, (rows, n)) + n * np.arange(rows)[:, None]
        yield np.bincount(chosen.ravel(), minlength=rows * n).reshape(rows, n).astype(np.float64)


def _acceleration(sums: np.ndarray, counts: np.ndarray) -> np.ndarray:
    without = (sums.sum(axis=0) - sums) / (counts.sum() - counts)[:, None]
    d = without.mean(axis=0) - without
    spread = (d**2).sum(axis=0)
    return (d**3).sum(axis=0) / np.where(spread > 0, 6.0 * spread**1.5, 1.0)


def _quantiles(rows: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Of each column of sorted rows the quantile of its own share, linear between rows."""
    place = shares * (len(rows) - 1)
    below = np.floor(place).astype(int)
    above = np.minimum(below + 1, len(rows) - 1)
    k = np.arange(rows.shape[1])
    return rows[below, k] + (place - below) * (rows[above, k] - rows[below, k])
