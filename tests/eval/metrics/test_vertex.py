"""Vertex and velocity errors against closed forms and invariances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.eval.metrics.accumulate import ErrorAccumulator
from muslin.eval.metrics.motion import derivatives, velocity_errors
from muslin.eval.metrics.vertex import statistics, vertex_areas, vertex_errors
from muslin.garments.errors import InputError


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def test_translation_gives_its_length_everywhere():
    x = np.random.default_rng(0).normal(size=(4, 7, 3))
    assert vertex_errors(x + np.array([0.3, 0.0, -0.4]), x) == pytest.approx(np.full((4, 7), 0.5))


def test_rigid_motion_of_both_changes_nothing():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 50, 3))
    R, t = random_rotation(rng), rng.normal(size=3)
    assert vertex_errors(x @ R.T + t, y @ R.T + t) == pytest.approx(vertex_errors(x, y))


def test_statistics_of_a_ramp():
    s = statistics(np.arange(1, 101) / 100)
    assert s.mean == pytest.approx(0.505)
    assert s.rms == pytest.approx(np.sqrt(101 * 201 / 6) / 100)
    assert (s.median, s.p95, s.max) == pytest.approx((0.5, 0.95, 1.0))


@given(st.lists(st.tuples(st.floats(0, 10), st.integers(1, 5)), min_size=1, max_size=20))
def test_integer_weights_mean_repetition(pairs):
    values, counts = (np.array(column) for column in zip(*pairs, strict=True))
    weighted, repeated = statistics(values, counts), statistics(np.repeat(values, counts))
    for name in ("mean", "rms", "max"):
        assert getattr(weighted, name) == pytest.approx(getattr(repeated, name))


def test_weighted_quantile_is_where_the_weight_is():
    s = statistics(np.array([1.0, 2.0, 3.0]), np.array([0.05, 0.05, 0.9]))
    assert (s.median, s.p95) == (3.0, 3.0)


def test_vertex_areas_sum_to_the_area_and_split_a_triangle_in_three():
    v = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0], [9, 9, 9]])
    assert vertex_areas(v, np.array([[0, 1, 2]])) == pytest.approx([1, 1, 1, 0])


def test_area_weights_cancel_uneven_sampling():
    # a unit strip cut unevenly in x, with error e = x: the mean over the area is 1/2
    x = np.concatenate([np.linspace(0, 0.1, 200)[:-1], np.linspace(0.1, 1, 20)])
    n = len(x)
    v = np.concatenate([np.c_[x, 0 * x, 0 * x], np.c_[x, 0 * x + 1, 0 * x]])
    i = np.arange(n - 1)
    f = np.concatenate([np.c_[i, i + 1, i + n], np.c_[i + 1, i + 1 + n, i + n]])
    assert statistics(v[:, 0], vertex_areas(v, f)).mean == pytest.approx(0.5, abs=1e-3)
    assert statistics(v[:, 0]).mean < 0.15


def test_velocity_of_uniform_motion():
    t = np.arange(5)[:, None, None] / 24.0
    x = np.array([[[0.0, 0, 0], [1, 1, 1]]]) + t * np.array([1.0, -2.0, 0.5])
    assert derivatives(x, 24.0, 1) == pytest.approx(np.broadcast_to([1.0, -2.0, 0.5], (4, 2, 3)))


def test_velocity_error_ignores_offset_and_counts_jitter_by_rate():
    x = np.random.default_rng(2).normal(size=(6, 9, 3))
    assert velocity_errors(x + 0.7, x, 30.0) == pytest.approx(np.zeros((5, 9)))
    jitter = x + np.where(np.arange(6) % 2, 1e-3, -1e-3)[:, None, None] * np.array([0, 1.0, 0])
    assert velocity_errors(jitter, x, 30.0) == pytest.approx(np.full((5, 9), 2e-3 * 30))


def test_accumulator_equals_all_at_once():
    rng = np.random.default_rng(3)
    errors, weights = rng.random((5, 40)).astype(np.float32), rng.random(40).astype(np.float32)
    accumulator = ErrorAccumulator()
    for frame in errors:
        accumulator.update(frame, weights)
    assert accumulator.result() == statistics(errors)
    assert accumulator.weighted_result() == statistics(errors, weights)
    assert ErrorAccumulator().result() is None


@pytest.mark.parametrize(
    "call",
    [
        lambda: vertex_errors(np.zeros((3, 3)), np.zeros((4, 3))),
        lambda: vertex_errors(np.full((3, 3), np.nan), np.zeros((3, 3))),
        lambda: statistics(np.zeros(0)),
        lambda: statistics(np.ones(2), np.zeros(2)),
        lambda: derivatives(np.zeros((1, 4, 3)), 30.0, 1),
        lambda: derivatives(np.zeros((2, 4, 3)), 0.0, 1),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()
