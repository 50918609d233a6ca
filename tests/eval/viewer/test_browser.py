"""The page in a browser that has no network: it draws, unpacks, and does what its controls say."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from muslin.eval.viewer.encode import encode_mesh
from muslin.eval.viewer.page import viewer
from muslin.eval.viewer.scene import Scene
from tests.browser import browser

NO_WEBGL = """
const original = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind.startsWith("webgl") ? null : original.call(this, kind, ...rest);
};
"""
COUNT_CONTEXTS = """
window.contexts = 0;
const original = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  if (kind.startsWith("webgl")) window.contexts += 1;
  return original.call(this, kind, ...rest);
};
"""
# how many pixels of a pane are drawn, and a number that stands for the picture
PICTURE = """([viewer, pane]) => {
  const canvas = muslinViewers[viewer].panes[pane].canvas;
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let drawn = 0, hash = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 3] > 200) drawn += 1;
    hash = (Math.imul(hash, 31) + data[i] + 256 * data[i + 1] + 65536 * data[i + 2]) | 0;
  }
  return [drawn / (canvas.width * canvas.height), hash];
}"""
# graphics in software take their time by the pixel
SMALL = "<style>.mv-canvas { height: 130px !important }</style>"
SETTLED = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))"


def write_page(path: Path, *fragments: str) -> str:
    """A page with these fragments and much text below each; its address."""
    text = "".join(f"<p>line {i}</p>" for i in range(60))
    body = text.join(fragments) + text
    path.write_text(f"<!doctype html><meta charset=utf-8>{SMALL}<body>{body}", encoding="utf-8")
    return path.as_uri()


@pytest.fixture(scope="module")
def chromium(tmp_path_factory) -> Iterator[Any]:
    with browser(tmp_path_factory.mktemp("profile"), viewport={"width": 760, "height": 620}) as opened:
        yield opened


@pytest.fixture(scope="module")
def address(scenes, tmp_path_factory) -> str:
    """A page with two viewers: all scenes, and the second scene alone."""
    folder = tmp_path_factory.mktemp("page")
    return write_page(folder / "page.html", viewer(scenes), viewer(scenes[1:2], library=False))


def opened(context: Any, address: str, script: str = COUNT_CONTEXTS) -> Any:
    """The page, with what it asked for and complained about in `page.asked` and `page.complaints`."""
    page = context.new_page()
    page.asked, page.complaints = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on(
        "console",
        lambda m: page.complaints.append(m.text) if m.type == "error" or "THREE" in m.text else None,
    )
    page.add_init_script(script)
    page.goto(address)
    page.wait_for_function("window.muslinViewers?.[0]?.scene")
    page.evaluate(SETTLED)
    return page


@pytest.fixture(scope="module")
def loaded(chromium, address) -> Iterator[Any]:
    page = opened(chromium, address)
    yield page
    assert page.complaints == []
    assert all(re.match("file:|data:|blob:", url) for url in page.asked)


@pytest.fixture
def page(loaded) -> Any:
    """The page as it was when it was opened: first scene, first frame, view and size of the beginning."""
    loaded.set_viewport_size({"width": 760, "height": 620})
    loaded.evaluate("scrollTo(0, 0); document.activeElement.blur()")
    loaded.evaluate("() => { const v = muslinViewers[0]; v.pause(); return (v.ready = v.open(0)); }")
    for name, pressed in (("Heat map", "true"), ("Body", "true"), ("Triangles", "false")):
        button = loaded.get_by_role("button", name=name).first
        if button.get_attribute("aria-pressed") != pressed:
            button.click()
    loaded.evaluate(SETTLED)
    return loaded


def picture(page: Any, pane: int = 1, of: int = 0) -> tuple[float, int]:
    page.evaluate(SETTLED)
    return tuple(page.evaluate(PICTURE, [of, pane]))


def label(page: Any) -> str:
    return page.locator(".mv-label").first.text_content()


def test_frames_come_out_as_they_went_in(page, scenes: list[Scene]) -> None:
    for index, scene in enumerate(scenes):
        page.evaluate(f"() => (muslinViewers[0].ready = muslinViewers[0].open({index}))")
        for name, mesh in scene.sides.items():
            step = encode_mesh(mesh)["step"]
            for t in range(0, scene.num_frames, 3):
                given = {"side": name, "frame": t}
                read = "({side, frame}) => muslinViewers[0].%s(side, frame).then((a) => a && [...a])"
                positions = np.reshape(page.evaluate(read % "positions", given), (-1, 3))
                assert np.abs(positions - mesh.positions[t]).max() <= step / 2 * (1 + 1e-6)
                faces = np.reshape(page.evaluate(read % "faces", given), (-1, 3))
                np.testing.assert_array_equal(faces, mesh.faces[t])
                values = page.evaluate(read % "values", given)
                if mesh.values is None:
                    assert values is None
                else:
                    top = max(v.max() for v in mesh.values)
                    assert np.abs(values - mesh.values[t]).max() <= 1.001 * top / 255


def test_every_pane_has_a_picture_of_its_own(page) -> None:
    pictures = [picture(page, pane) for pane in range(3)]
    assert all(drawn > 0.02 for drawn, _ in pictures)
    assert len({number for _, number in pictures}) == 3
    assert page.evaluate("contexts") == 1


@pytest.mark.parametrize("button", ["Cloth", "Triangles", "Body", "Follow"])
def test_buttons_change_the_picture_and_back(page, button: str) -> None:
    page.evaluate("muslinViewers[0].seek(6)")
    before = picture(page)
    page.get_by_role("button", name=button).first.click()
    after = picture(page)
    assert after != before
    page.get_by_role("button", name="Heat map" if button == "Cloth" else button).first.click()
    assert picture(page) == before


def test_the_truth_has_no_heat_map(page) -> None:
    before = picture(page, 0)
    page.get_by_role("button", name="Cloth").first.click()
    assert picture(page, 0) == before


def test_slider_and_keys_change_the_frame(page) -> None:
    assert label(page) == "frame 0 / 7 · 0.00 s"
    first = picture(page)
    page.locator(".mv-slider").first.fill("5")
    assert label(page) == "frame 5 / 7 · 0.20 s"
    assert picture(page) != first
    page.locator(".mv-canvas").first.focus()
    for key, expected in (("ArrowRight", 6), ("End", 7), ("ArrowRight", 7), ("ArrowLeft", 6), ("Home", 0)):
        page.keyboard.press(key)
        assert label(page).startswith(f"frame {expected} /")
    assert picture(page) == first
    assert page.locator(".mv-figure").nth(1).text_content() == "8.00 mm"


def test_space_plays_and_pauses(page) -> None:
    page.locator(".mv-canvas").first.focus()
    page.keyboard.press(" ")
    page.wait_for_function("muslinViewers[0].frame > 0")
    assert page.evaluate("scrollY") == 0
    page.keyboard.press(" ")
    at = label(page)
    page.wait_for_timeout(150)
    assert label(page) == at


def test_a_click_in_the_plot_seeks(page) -> None:
    plot = page.locator(".mv-plot").first
    width = plot.bounding_box()["width"]
    plot.click(position={"x": 46 + (width - 60) * 3 / 7, "y": 60})
    assert label(page).startswith("frame 3 /")
    assert plot.locator("polyline").count() == 2


def test_the_camera_is_common_and_resets(page) -> None:
    before = [picture(page, pane) for pane in range(3)]
    box = page.locator(".mv-canvas").nth(1).bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    for button, modifier in (("left", None), ("right", None), ("left", "Shift")):
        page.mouse.move(x, y)
        if modifier:
            page.keyboard.down(modifier)
        page.mouse.down(button=button)
        page.mouse.move(x + 40, y + 15, steps=2)
        page.mouse.up(button=button)
        if modifier:
            page.keyboard.up(modifier)
        page.mouse.move(1, 1)
        moved = [picture(page, pane) for pane in range(3)]
        assert all(a != b for a, b in zip(before, moved, strict=True))
        page.locator(".mv-canvas").nth(1).dblclick()
        assert [picture(page, pane) for pane in range(3)] == before


def test_the_wheel_scrolls_the_page_until_a_pane_is_clicked(page) -> None:
    canvas = page.locator(".mv-canvas").first
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 60, box["y"] + 60)
    zoom = "muslinViewers[0].orbit.zoom"
    page.mouse.wheel(0, 100)
    page.wait_for_function("scrollY > 0")
    assert page.evaluate(zoom) == 1
    page.evaluate("scrollTo(0, 0)")
    canvas.click()
    page.mouse.wheel(0, 100)
    page.wait_for_function(f"{zoom} < 0.9")
    assert page.evaluate("scrollY") == 0


def test_nothing_is_drawn_while_nothing_changes(page) -> None:
    page.mouse.move(1, 1)
    count = "muslinViewers[0].stage.renderer.info.render.frame"
    picture(page)
    before = page.evaluate(count)
    page.wait_for_timeout(200)
    assert page.evaluate(count) == before
    page.evaluate("muslinViewers[0].seek(1)")
    picture(page)
    assert page.evaluate(count) == before + 3


def test_the_pointer_reads_the_value_under_it(page) -> None:
    page.get_by_role("button", name="Body").first.click()
    page.evaluate("muslinViewers[0].seek(4)")
    box = page.locator(".mv-canvas").nth(1).bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    page.wait_for_function("!muslinViewers[0].panes[2].probe.hidden")
    shown = [float(text.split()[0]) for text in page.locator(".mv-probe").all_text_contents()[1:3]]
    # values are 20 (1 + t) (x + 0.4) and 5 (1 + t) (x + 0.4), and the camera looks at the middle, x = 0
    assert shown[0] == pytest.approx(40.0, rel=0.25)
    assert shown[0] / shown[1] == pytest.approx(4.0, rel=0.25)


def test_the_range_of_colours_can_be_set(page) -> None:
    before = picture(page)
    page.locator(".mv-number").first.fill("500")
    page.keyboard.press("Enter")
    assert picture(page) != before
    assert "0 to 500 mm" in page.locator(".mv-bar").first.get_attribute("aria-label")
    page.locator(".mv-number").first.fill("-1")
    page.keyboard.press("Enter")
    assert page.locator(".mv-number").first.input_value() == "500"


def test_scenes_can_be_chosen(page) -> None:
    page.get_by_label("scene").first.select_option("changing </script>")
    page.wait_for_function("muslinViewers[0].panes.length === 2")
    assert label(page) == "frame 0 / 5"
    pictures = set()
    for _ in range(6):
        pictures.add(picture(page, 1))
        page.evaluate("muslinViewers[0].seek(muslinViewers[0].frame + 1)")
    assert len(pictures) == 6
    page.get_by_label("scene").first.select_option("still")
    page.wait_for_function("muslinViewers[0].frames === 1")
    assert picture(page, 1)[0] > 0.02
    assert page.locator(".mv-time").first.is_hidden()
    assert page.locator(".mv-plot").first.is_hidden()


def test_a_second_viewer_shares_the_context(page) -> None:
    assert page.evaluate("muslinViewers[1]") is None  # too far below to be unpacked yet
    page.locator(".muslin-viewer").nth(1).scroll_into_view_if_needed()
    page.wait_for_function("muslinViewers[1]?.scene")
    assert picture(page, 0, of=1)[0] > 0.02
    assert page.evaluate("contexts") == 1
    page.evaluate("muslinViewers[1].seek(2)")
    assert page.evaluate("[muslinViewers[0].frame, muslinViewers[1].frame]") == [0, 2]


def test_panes_stack_in_a_narrow_window(page) -> None:
    def places() -> list[dict[str, float]]:
        return [page.locator(".mv-pane").nth(i).bounding_box() for i in range(3)]

    assert places()[1]["y"] == places()[0]["y"]
    page.set_viewport_size({"width": 380, "height": 700})
    page.evaluate(SETTLED)
    first, second, _ = places()
    assert second["y"] >= first["y"] + first["height"]
    assert picture(page, 1)[0] > 0.02
    assert page.evaluate("document.documentElement.scrollWidth") <= 380


def test_two_fingers_zoom(page) -> None:
    box = page.locator(".mv-canvas").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    session = page.context.new_cdp_session(page)

    def touch(kind: str, *apart: float) -> None:
        points = [{"x": x + side * apart[0], "y": y, "id": side} for side in (-1, 1)] if apart else []
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 10)
    touch("touchMove", 20)
    touch("touchMove", 40)
    touch("touchEnd")
    assert page.evaluate("muslinViewers[0].orbit.zoom") > 1.5


def test_the_last_choice_of_a_scene_counts(page) -> None:
    page.evaluate("() => { const v = muslinViewers[0]; v.open(1); return (v.ready = v.open(2)); }")
    page.wait_for_timeout(100)
    assert page.evaluate("muslinViewers[0].scene.name") == "still"


def test_thinned_frames_keep_their_numbers(chromium, scenes, tmp_path) -> None:
    page = opened(chromium, write_page(tmp_path / "thin.html", viewer(scenes[:1], budget=2500)))
    assert "One frame in 3 of 8 is in this page" in page.locator(".mv-note").text_content()
    page.keyboard.press("Tab")
    page.keyboard.press("End")
    assert label(page) == "frame 6 / 7 · 0.24 s"
    np.testing.assert_allclose(
        page.evaluate("muslinViewers[0].positions(1, 2).then((a) => [...a.slice(0, 3)])"),
        scenes[0].sides["first"].positions[6][0],
        atol=5e-5,
    )
    page.close()


def test_without_webgl_it_says_so(chromium, address) -> None:
    page = chromium.new_page()
    page.add_init_script(NO_WEBGL)
    page.goto(address)
    page.wait_for_function("window.muslinViewers?.[0]?.scene")
    assert "no WebGL" in page.get_by_role("alert").first.text_content()
    page.locator(".mv-slider").first.fill("5")
    assert label(page).startswith("frame 5 /")
    page.close()


def test_broken_data_is_named(chromium, scenes, tmp_path) -> None:
    text = str(viewer(scenes[2:]))
    place = text.index('"positions":"') + len('"positions":"')
    page = chromium.new_page()
    page.goto(write_page(tmp_path / "broken.html", text[:place] + "AAAA" + text[place + 4 :]))
    page.get_by_role("alert").wait_for()
    assert "cannot be unpacked" in page.get_by_role("alert").text_content()
    page.close()
