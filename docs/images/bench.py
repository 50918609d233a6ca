"""Draws docs/images/bench.png: the page of a benchmark of two methods that learn nothing.

make demo
python docs/images/bench.py out/demo docs/images/bench.png
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

from muslin.eval.bench.findings import findings
from muslin.eval.bench.protocol import load_protocol
from muslin.eval.bench.report import bench_report
from muslin.eval.bench.run import bench
from muslin.sim.dataset.reader import open_dataset, write_dataset

PROTOCOL = Path(__file__).resolve().parents[2] / "scenes" / "protocols" / "static_designs.toml"
SIZE = {"width": 1280, "height": 2000}
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def neighbours(truth: Path, folder: Path) -> Path:
    """Each drape by that of the same garment on the next shape."""
    dataset = open_dataset(truth)
    drapes = [sample for sample in map(dataset.__getitem__, dataset.ids) if sample.kind == "drape"]
    found = []
    for sample in drapes:
        assert sample.body is not None
        others = [s for s in drapes if s.labels["design"] == sample.labels["design"] and s is not sample]
        nearest = min(others, key=lambda other: np.abs(other.body.beta - sample.body.beta).max())
        found.append(replace(sample, positions=nearest.positions))
    write_dataset(folder, found)
    return folder


def main(demo: str, out: str) -> None:
    truth = Path(demo) / "dataset"
    protocol = load_protocol(PROTOCOL)
    # The demo's shapes are the same for both designs.
    protocol = protocol.model_copy(
        update={"select": protocol.select.model_copy(update={"unseen": ["design"]})}
    )
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        methods = {
            "next shape": neighbours(truth, Path(folder) / "next"),
            "coarse simulation": Path(demo) / "coarse",
        }
        outcome = bench(protocol, methods, truth, workers=2)
        page = Path(folder) / "bench.html"
        page.write_text(bench_report(outcome, findings(outcome)), encoding="utf-8")
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        tab = browser.new_page(viewport=SIZE)
        tab.goto(page.as_uri())
        tab.locator(".muslin-viewer").scroll_into_view_if_needed()
        tab.wait_for_function("window.muslinViewers?.[0]?.scene")
        tab.wait_for_timeout(4000)
        tab.screenshot(path=out, full_page=True)
        browser.close()
    Image.open(out).convert("RGB").save(out, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
