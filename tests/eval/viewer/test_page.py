"""The fragment: whole, closed against its own data, and no larger than it may be."""

import json
import re

import numpy as np
import pytest
from markupsafe import Markup

from muslin.eval.viewer.page import MAX_FRAMES, asset, viewer
from muslin.eval.viewer.scene import MovingMesh, Scene

TRIANGLE = np.array([[0, 1, 2]])


def data_of(fragment: str) -> dict:
    (text,) = re.findall(r'<script type="application/json">(.*?)</script>', fragment, re.DOTALL)
    return json.loads(text)


def long_scene(frames: int, vertices: int = 3) -> Scene:
    points = np.random.default_rng(0).normal(size=(frames, vertices, 3))
    values = np.abs(points[:, :, 0])
    return Scene("long", {"truth": MovingMesh(list(points), [TRIANGLE] * frames, list(values))}, 30.0)


def test_names_cannot_end_the_script(scenes) -> None:
    fragment = viewer(scenes)
    assert isinstance(fragment, Markup)
    data = data_of(fragment)
    assert [scene["name"] for scene in data["scenes"]] == ["waving", "changing </script>", "still"]
    assert fragment.count("<script") == fragment.count("</script>") == 2
    assert "<b>one" not in fragment


def test_nothing_is_loaded_from_elsewhere(scenes) -> None:
    fragment = viewer(scenes)
    assert not re.search(r"\b(src|href)=|@import|url\(", fragment)
    assert "fetch(" not in asset("decode.js")


def test_the_library_comes_once_and_with_its_licence(scenes) -> None:
    whole, second = viewer(scenes), viewer(scenes, library=False)
    assert len(asset("three.min.js")) < 800_000
    assert len(whole) - len(second) < 800_000
    assert "The MIT License" in whole
    assert "three.js authors" in whole
    assert len(second) < 60_000
    assert "muslinViewers.start()" in second


def test_the_top_of_the_colours_is_given_or_found(scenes) -> None:
    waving, _, still = data_of(viewer(scenes))["scenes"]
    everything = np.concatenate([v for s in scenes[0].sides.values() if s.values for v in s.values])
    assert waving["high"] == pytest.approx(np.quantile(everything, 0.99))
    assert still["high"] == 1.5


def test_no_error_anywhere_still_has_a_scale() -> None:
    mesh = MovingMesh([np.eye(3)], [TRIANGLE], [np.zeros(3)])
    assert data_of(viewer([Scene("s", {"truth": mesh})]))["scenes"][0]["high"] == 1.0


def test_long_sequences_are_thinned_and_say_so() -> None:
    scene = data_of(viewer([long_scene(2 * MAX_FRAMES + 1)]))["scenes"][0]
    assert scene["stride"] == 3
    assert scene["frames"] == 2 * MAX_FRAMES + 1
    assert len(scene["sides"][0]["mesh"]["frames"]) == len(range(0, 2 * MAX_FRAMES + 1, 3)) <= MAX_FRAMES
    assert len(scene["sides"][0]["means"]) == 2 * MAX_FRAMES + 1  # the plot loses nothing


@pytest.mark.parametrize(("budget", "stride"), [(400, 1), (399, 2), (200, 2), (199, 3), (1, 10)])
def test_the_page_stays_within_its_budget(budget: int, stride: int) -> None:
    scenes = [long_scene(10, 20), long_scene(10, 20)]
    assert {scene["stride"] for scene in data_of(viewer(scenes, budget=budget))["scenes"]} == {stride}


def test_means_are_those_of_the_values(scenes) -> None:
    first = data_of(viewer(scenes[:1]))["scenes"][0]["sides"][1]
    expected = [v.mean() for v in scenes[0].sides["first"].values]
    np.testing.assert_allclose(first["means"], expected, rtol=1e-3)


def test_the_same_scenes_give_the_same_bytes(scenes) -> None:
    assert viewer(scenes) == viewer(scenes)
