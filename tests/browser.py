"""Debian's Chromium without a display and without a network, driven by Playwright."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

# Software rendering, and nothing that Chromium does by itself in the background.
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)
PLACES = ("chromium", "chromium-browser", "google-chrome")


def chromium() -> Path | None:
    """Where the browser is, or None."""
    return next((Path(found) for place in PLACES if (found := shutil.which(place))), None)


@contextmanager
def browser(profile: Path, *, flags: tuple[str, ...] = FLAGS, **context: Any) -> Iterator[Any]:
    """A browser context, offline, with its profile in that folder; skips where there is no browser.

    context   options of Playwright's contexts: viewport, color_scheme, has_touch, ...
    """
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: the dev extra"
    )
    found = chromium()
    if found is None:
        pytest.skip(f"no browser: none of {', '.join(PLACES)} is on the path")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch_persistent_context(
            profile, executable_path=found, headless=True, args=list(flags), offline=True, **context
        )
        try:
            yield opened
        finally:
            opened.close()
