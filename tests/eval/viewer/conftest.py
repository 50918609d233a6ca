"""Small scenes with every case: a body that moves or not, meshes that change, values or none."""

import numpy as np
import pytest
import trimesh

from muslin.eval.viewer.scene import MovingMesh, Scene


def sheet(n: int, side: float = 0.8) -> tuple[np.ndarray, np.ndarray]:
    """A level square of n x n vertices."""
    x = np.linspace(-side / 2, side / 2, n)
    X, Z = np.meshgrid(x, x, indexing="ij")
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.c_[i, i + 1, i + n + 1], np.c_[i, i + n + 1, i + n]])
    return np.stack([X.ravel(), np.full(n * n, 0.3), Z.ravel()], axis=1), faces


def waving(points: np.ndarray, t: int, size: float = 0.1) -> np.ndarray:
    """The sheet in frame t of a wave that runs over it, walking in x."""
    moved = points.copy()
    moved[:, 1] += size * np.sin(6.0 * points[:, 0] + 0.7 * t)
    moved[:, 0] += 0.12 * t
    return moved


def side(sizes: list[int], amplitude: float, error: float | None) -> MovingMesh:
    """A side whose frame t is a sheet of sizes[t] x sizes[t] vertices; with errors that grow along x."""
    sheets = {n: sheet(n) for n in sizes}
    positions = [waving(sheets[n][0], t, amplitude) for t, n in enumerate(sizes)]
    values = None
    if error is not None:
        values = [error * (1 + t) * (sheets[n][0][:, 0] + 0.4) for t, n in enumerate(sizes)]
    return MovingMesh(positions, [sheets[n][1] for n in sizes], values)


@pytest.fixture(scope="session")
def scenes() -> list[Scene]:
    """One topology over a moving ball; topologies that come and go, with no body; a single drape."""
    ball = trimesh.creation.icosphere(2, 0.25)
    follows = [ball.vertices + np.array([0.12 * t, 0, 0]) for t in range(8)]
    body = MovingMesh(follows, [np.asarray(ball.faces)] * 8)
    plain = {
        "truth": side([14] * 8, 0.1, None),
        "first": side([14] * 8, 0.06, 20.0),
        "second": side([14] * 8, 0.14, 5.0),
    }
    changing = {
        "truth": side([9, 9, 12, 12, 9, 9], 0.1, None),
        "coarse": side([6, 6, 6, 6, 6, 6], 0.1, 3.0),
    }
    still = {"truth": side([10], 0.1, None), "<b>one</b>": side([10], 0.12, 2.0)}
    once = MovingMesh(body.positions[:1], body.faces[:1])
    return [
        Scene("waving", plain, 25.0, body),
        Scene("changing </script>", changing),
        Scene("still", still, body=once, unit="cm", high=1.5),
    ]
