"""muslin: Hausdorff bounds 0.1% apart and a mean with a standard error of 0.1%, from arrays to figures."""

from __future__ import annotations

from benchmarks.surfaces.exchange import Pair, contend
from muslin.eval.metrics.surface_pair import compare_surfaces

ACCURACY = 1e-3


def measure(pair: Pair) -> dict[str, float]:
    """Both figures of a pair, metres, building the trees included."""
    found = compare_surfaces(
        pair.vertices_a,
        pair.faces_a,
        pair.vertices_b,
        pair.faces_b,
        relative=ACCURACY,
        absolute=0.0,
        mean_relative=ACCURACY,
    )
    distance = found.distance
    return {
        "lower": found.hausdorff.lower,
        "upper": found.hausdorff.upper,
        "mean": distance.mean,
        "mean_error": distance.mean_error,
        "variance": (distance.rms_ab**2 - distance.mean_ab**2 + distance.rms_ba**2 - distance.mean_ba**2) / 4,
        "samples": distance.samples,
    }


if __name__ == "__main__":
    contend(measure, ("libigl", "numpy"))
