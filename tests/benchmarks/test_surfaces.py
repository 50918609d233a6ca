"""Pairs that packages are given, what is read back, and how figures are put beside each other."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks.agreement import Row, closed_forms, table
from benchmarks.surface import MUSLIN, PYMESHLAB, Result, samples_for
from benchmarks.surface import table as speed_table
from benchmarks.surfaces.exchange import SAMPLES_FILE, fixed_points, load_pairs
from benchmarks.surfaces.with_muslin import measure


def test_pairs_come_back_with_their_samples(tmp_path):
    pairs = closed_forms()
    for name, pair in pairs.items():
        pair.save(tmp_path / f"{name}.npz")
    (tmp_path / SAMPLES_FILE).write_text(json.dumps({"quad": 7}), encoding="utf-8")
    found = load_pairs(tmp_path)
    assert {name: pair.samples for name, pair in found.items()} == {
        "lifted square": 0,
        "quad": 7,
        "spheres": 0,
    }
    np.testing.assert_array_equal(found["spheres"].vertices_b, pairs["spheres"].vertices_b)
    np.testing.assert_array_equal(fixed_points(found["quad"]), fixed_points(pairs["quad"]))


def test_muslin_measures_a_pair_to_a_thousandth():
    found = measure(closed_forms()["quad"])
    exact = 0.2 / np.sqrt(1 + 2 * 0.2**2)
    assert exact * (1 - 1e-3) <= found["lower"] <= exact * (1 + 1e-12)
    assert exact * (1 - 1e-12) <= found["upper"] <= exact * (1 + 1e-3)
    assert found["mean_error"] <= 1e-3 * found["mean"]


def test_independent_samples_for_a_thousandth():
    # half the sum of two independent means of n points each, of variance 4 and 8: (4 + 8) / (4 n)
    figures = {"variance": (4.0 + 8.0) / 4.0, "mean": 1.0}
    assert samples_for(figures) == 3_000_000
    rng = np.random.default_rng(0)
    n = samples_for({"variance": (1.0 + 1.0) / 4.0, "mean": 50.0})
    drawn = [0.5 * (rng.normal(size=n).mean() + rng.normal(size=n).mean()) for _ in range(4000)]
    assert np.std(drawn) == pytest.approx(1e-3 * 50.0, rel=0.05)


def test_digits_of_agreement():
    assert Row("p", "x", 1.001, 1.0, 1.0, True).digits == pytest.approx(3.0)
    assert Row("p", "x", 1.0005, 1.0, 1.001, True).digits == 15
    assert Row("p", "x", 9.0, 1.0, 1.0, True).digits == 0.0
    text = table([Row("p", "x", 0.0, 1.0, 1.0, False), Row("p", "y", 1.0, 1.0, 1.0, True)])
    assert "| p | x | 0 | 1000 | **0.0** |" in text
    assert "| p | y | 1000 | 1000 | 15.0 |" in text


def test_a_line_of_the_speed_table():
    ours = {"lower": 0.01, "upper": 0.01001, "mean": 0.002, "mean_error": 1e-6}
    theirs = {"mean": 0.00201, "lower": 0.0099, "samples": 1000}
    versions = {"package": "1.0"}
    results = {
        MUSLIN.name: Result({"p": [1.0, 2.0]}, {"p": ours}, versions),
        PYMESHLAB.name: Result({"p": [5.0, 8.0]}, {"p": theirs}, versions),
    }
    line = speed_table(results).splitlines()[2]
    assert "10.0000 and 10.0100" in line
    assert "1.00%" in line
    assert line.endswith("| 4.5 (4.0 to 5.0) |")
