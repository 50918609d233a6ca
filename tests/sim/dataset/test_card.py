"""The card says what the dataset holds, nothing that differs from run to run, and its code runs."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from sheet_producer import make_scene, sheets_config, simulate

from muslin.sim.dataset import licences
from muslin.sim.dataset.card import MARK, card_text, write_card
from muslin.sim.dataset.config import DatasetConfig, parse_config
from muslin.sim.dataset.generate import GenerateReport, generate
from muslin.sim.dataset.header import Header
from muslin.sim.dataset.index import COLUMNS
from muslin.sim.dataset.info import info
from muslin.sim.dataset.plan import plan
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.schema import CARD


def run(config: DatasetConfig, out: Path, workers: int = 1) -> GenerateReport:
    return generate(config, out, workers=workers, simulate=simulate, make_scene=make_scene)


@pytest.fixture(scope="module")
def sheets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sheets") / "data"
    assert run(sheets_config(), out).card
    return out


def blocks(card: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", card, flags=re.DOTALL)


def test_the_card_tells_what_is_there(sheets: Path) -> None:
    card = (sheets / CARD).read_text()
    assert card.startswith(f"{MARK}\n# sheets\n")
    assert "9 samples: 8 drapes (one frame at rest), 1 sequence\n" in card
    assert "38 frames; frames in a sequence 30; frames a second 30" in card
    assert "| split | train | 7 | 7 |\n|  | test | 2 | 31 |" in card
    # Eight values from -1 to 1, one in each of eight of the twelve bins.
    assert re.search(r"\| `body\.beta\[0\]` \| -1 \| 0 \| 1 \| `█[█·]{10}█` \|", card)
    assert "| smallest distance, m | 0.02 | 0.02 | 0.02 | 9 of 9 |" in card
    assert "| force residual, share of the weight |  |  |  | 0 of 9 |" in card
    assert "| motion | wave | a file of the dataset's maker |" in card
    assert info(sheets).geometry_sha256 in card
    assert str(sheets.parent) not in card


def test_the_config_on_the_card_makes_the_same_dataset(sheets: Path) -> None:
    (text,) = blocks((sheets / CARD).read_text(), "toml")
    assert parse_config(tomllib.loads(text)) == sheets_config()


@pytest.mark.parametrize("place", [0, 1], ids=["with_muslin", "zarr_only"])
def test_the_lines_on_the_card_run(sheets: Path, place: int) -> None:
    code = blocks((sheets / CARD).read_text(), "python")[place]
    assert len([line for line in code.splitlines() if line]) <= 5
    told = subprocess.run(
        [sys.executable, "-c", code + "\nimport sys; print(any('muslin' in name for name in sys.modules))"],
        cwd=sheets,
        capture_output=True,
        text=True,
        check=True,
    )
    first = "(81, 3) (128, 3)" if place == 0 else "(1, 81, 3) (128, 3) {"
    assert told.stdout.startswith(first)
    if place == 1:
        # An editable installation puts its finder there, and nothing else of muslin's.
        code = "import sys; print(any('muslin' in name for name in sys.modules))"
        bare = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert told.stdout.splitlines()[-1] == bare.stdout.strip()


def test_the_same_dataset_has_the_same_card_however_it_came_to_be(tmp_path: Path) -> None:
    def config(count: int) -> DatasetConfig:
        return parse_config({"kind": "drape", "shapes": [{"name": "s", "random": {"count": count}}]})

    run(config(2), tmp_path / "grown")
    before = (tmp_path / "grown" / CARD).read_bytes()
    run(config(3), tmp_path / "grown")
    run(config(3), tmp_path / "whole", workers=2)
    card = (tmp_path / "grown" / CARD).read_bytes()
    assert before != card
    assert card == (tmp_path / "whole" / CARD).read_bytes()


def test_what_somebody_wrote_is_left_as_it_is(sheets: Path, tmp_path: Path) -> None:
    """A README.md, whether it was there before the dataset or was a card once."""
    out = tmp_path / "data"
    out.mkdir()
    (out / CARD).write_text("# Mine\n")
    config = parse_config({"kind": "drape"})
    assert not run(config, out).card
    assert (out / CARD).read_text() == "# Mine\n"
    card = (sheets / CARD).read_text()
    (out / CARD).write_text(card + "a change under the mark is lost\n")
    assert run(config, out).card
    written = (out / CARD).read_text()
    assert written.startswith(MARK)
    assert "a change" not in written
    (out / CARD).unlink()
    (out / CARD).mkdir()
    dataset = open_dataset(out)
    assert not write_card(dataset.root, dataset.header, dataset.rows, plan(config).jobs)


def test_a_begun_dataset_says_so_and_absolute_paths_are_cut() -> None:
    scene = {"body": {"model": "/home/me/SMPL_F.pkl"}, "fabric": "/home/me/mine.toml:silk"}
    config = parse_config({"kind": "drape", "scene": scene, "shapes": [{"beta": [0.5]}]})
    planned = plan(config)
    header = Header(config.model_dump(mode="json"), planned.splits)
    empty = card_text(header, [], planned.jobs)
    assert "**not complete**: 1 planned samples" in empty
    assert "No sample is there yet." in empty
    values = dict.fromkeys([*COLUMNS.names, "topologies"]) | {"id": planned.jobs[0].id, "kind": "drape"}
    values |= {"frames": 1, "vertices": 81, "topologies": 1, "geometry_sha256": "0"}
    row = values | {"body": "/home/me/SMPL_F.pkl", "fabric": "/home/me/mine.toml:silk"}
    card = card_text(header, [row], planned.jobs)
    assert "/home" not in empty + card
    assert "| body | SMPL_F.pkl | a file of the dataset's maker |" in card
    assert "| fabric | mine.toml:silk |" in card
    assert "`body.beta[0]` 0.5" in card


def test_everything_that_muslin_ships_has_a_source() -> None:
    assert licences.body_source("female") != licences.OWN == licences.body_source("female.npz")
    assert "CMU" in licences.motion_source("cmu_01_03")[0]
    assert "zlib" in licences.motion_source("walk")[1]
    assert "cite" in licences.fabric_source("gray-interlock")[1]
    assert licences.motion_source("cmu_99_99") == licences.OWN
