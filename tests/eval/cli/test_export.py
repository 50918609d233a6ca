"""`muslin export`: which samples, in which form."""

from __future__ import annotations

from pathlib import Path

import pytest

from muslin.sim.dataset.reader import write_dataset
from tests.eval.cli.commands import muslin, refused


@pytest.fixture
def data(make_sample, tmp_path: Path) -> Path:
    samples = [
        make_sample("a", labels={"split": "train", "design": "tee"}),
        make_sample("b", frames=3, labels={"split": "train", "design": "dress"}),
        make_sample("c", frames=2, labels={"split": "test", "design": "tee"}),
    ]
    write_dataset(tmp_path / "data", samples)
    return tmp_path / "data"


@pytest.mark.parametrize(
    ("options", "ids"),
    [
        ((), "abc"),
        (("--split", "train"), "ab"),
        (("--where", "design=tee"), "ac"),
        (("--where", "design=tee", "--where", "frames=2"), "c"),
        (("--sample", "b", "--sample", "a"), "ab"),
    ],
)
def test_selection(data: Path, tmp_path: Path, options: tuple[str, ...], ids: str) -> None:
    result = muslin("export", data, "--layout", "cloth3d", "--out", tmp_path / "layout", *options)
    assert f"{len(ids)} samples written, 0 were there" in result.stdout
    assert sorted(p.name for p in (tmp_path / "layout/samples").iterdir()) == list(ids)
    assert f"0 samples written, {len(ids)} were there" in (
        muslin("export", data, "--layout", "cloth3d", "--out", tmp_path / "layout", *options).stdout
    )
    muslin("export", data, "--format", "npz", "--out", tmp_path / "files", *options)
    assert sorted(p.stem for p in (tmp_path / "files").iterdir()) == list(ids)


def test_what_cannot_be_is_told(data: Path, tmp_path: Path) -> None:
    out = ("--out", tmp_path / "out")
    refused("export", data, "--layout", "obj", "--format", "obj", *out, says="give it without --format")
    refused("export", data, "--layout", "smpl", *out, says="must be one of obj, cloth3d, hood")
    refused("export", data, "--where", "design", *out, says="--where design: must be KEY=VALUE")
    refused(
        "export", data, "--where", "design=coat", *out, says="no sample has design=coat; there is tee, dress"
    )
    assert not (tmp_path / "out").exists()
