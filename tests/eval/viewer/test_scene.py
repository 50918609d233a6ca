"""What cannot be shown is refused by name."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.eval.viewer.page import viewer
from muslin.eval.viewer.scene import MovingMesh, Scene
from muslin.garments.errors import InputError

TRIANGLE = np.array([[0, 1, 2]])
POINTS = np.eye(3)
GOOD = MovingMesh([POINTS, POINTS], [TRIANGLE, TRIANGLE], [np.zeros(3), np.ones(3)])
NAN = np.array([[0, 0, 0], [1, np.nan, 0], [0, 0, 1.0]])


def test_what_is_right_passes() -> None:
    scene = Scene("s", {"truth": GOOD, "other": GOOD}, 30.0, MovingMesh([POINTS], [TRIANGLE]))
    assert scene.validate() is scene


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (MovingMesh([], []), "no frame"),
        (replace(GOOD, faces=[TRIANGLE]), "2 frames of positions but 1 of faces"),
        (replace(GOOD, values=[np.zeros(3)]), "2 frames of positions but 1 of values"),
        (replace(GOOD, positions=[POINTS, NAN]), "frame 1: vertex 1 is not finite"),
        (replace(GOOD, positions=[POINTS, POINTS[:, :2]]), r"positions of shape \(3, 2\)"),
        (replace(GOOD, positions=[POINTS, POINTS[:0]]), r"positions of shape \(0, 3\)"),
        (replace(GOOD, positions=[POINTS, POINTS[:2]]), "frame 1: faces name vertices 0 to 2 of 2"),
        (replace(GOOD, faces=[TRIANGLE, TRIANGLE - 1]), "faces name vertices -1 to 1"),
        (replace(GOOD, faces=[TRIANGLE, TRIANGLE[:0]]), r"faces of shape \(0, 3\)"),
        (replace(GOOD, faces=[TRIANGLE, TRIANGLE * 1.0]), "float64; expected integers"),
        (replace(GOOD, values=[np.zeros(3), np.zeros(2)]), r"values of shape \(2,\) for 3 vertices"),
        (replace(GOOD, values=[np.zeros(3), np.array([0, np.nan, 0])]), "value nan of vertex 1"),
        (replace(GOOD, values=[np.zeros(3), np.array([0, 0, -1.0])]), "value -1.0 of vertex 2"),
    ],
)
def test_bad_sides_are_named(mesh: MovingMesh, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        viewer([Scene("walk", {"truth": GOOD, "mine": mesh})])
    assert "scene 'walk', side 'mine'" in str(caught.value)


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (Scene("s", {}), "no side"),
        (Scene("s", {"truth": GOOD, "short": GOOD.every(2)}), "sides differ in frames"),
        (Scene("s", {"truth": GOOD}, body=MovingMesh([POINTS] * 3, [TRIANGLE] * 3)), "body has 3 frames"),
        (Scene("s", {"truth": GOOD}, body=MovingMesh([NAN], [TRIANGLE])), "body, frame 0: vertex 1"),
        (Scene("s", {"truth": GOOD}, fps=0.0), "fps is 0.0"),
        (Scene("s", {"truth": GOOD}, fps=float("nan")), "fps is nan"),
        (Scene("s", {"truth": GOOD}, high=-1.0), "high is -1.0"),
        (Scene("s", {"truth": GOOD}, azimuth=float("inf")), "azimuth is inf"),
    ],
)
def test_bad_scenes_are_named(scene: Scene, message: str) -> None:
    with pytest.raises(InputError, match=message):
        viewer([scene])


def test_no_scene_is_refused() -> None:
    with pytest.raises(InputError, match="no scene"):
        viewer([])
