"""House rules that a machine can check on every file of the packages."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("garments", "sim", "learn", "eval")
SOURCES = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))
LONGEST = 400
# path: why this file is one concept although it is longer than LONGEST lines
LONG_FOR_A_REASON: dict[str, str] = {}


def name_of(path: Path) -> str:
    """Return the path from the root of the repository, with forward slashes."""
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_module_says_what_it_is_for(path: Path) -> None:
    docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    assert docstring, f"{name_of(path)} has no module docstring: say in a line what it holds"


def test_no_file_outgrows_one_concept() -> None:
    lengths = {name_of(path): len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    too_long = {name: n for name, n in lengths.items() if n > LONGEST and name not in LONG_FOR_A_REASON}
    assert not too_long, f"longer than {LONGEST} lines: split, or give the reason in LONG_FOR_A_REASON"
    settled = [name for name in LONG_FOR_A_REASON if lengths.get(name, 0) <= LONGEST]
    assert not settled, f"no longer long, remove from LONG_FOR_A_REASON: {settled}"


def test_no_unowned_promises() -> None:
    promises = [
        f"{name_of(path)}:{number}"
        for path in SOURCES
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if "TODO" in line
    ]
    assert not promises, f"do it, or file it: {promises}"
