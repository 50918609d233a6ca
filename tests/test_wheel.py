"""The wheel works away from the repository: modules import, data files are there, the command runs."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("garments", "sim", "learn", "eval")
BUILD_FILES = ("pyproject.toml", "setup.py", "README.md", "LICENSE", "NOTICE")
# Libraries that only some modules need: those of extras, and of the scripts that baked the committed data.
OPTIONAL = ("torch", "accelerate", "safetensors", "anny")

IMPORT_ALL = """
import importlib, json, sys
missing, failed = {}, {}
for name in json.load(sys.stdin):
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        missing[name] = error.name
    except Exception as error:
        failed[name] = repr(error)
import muslin.sim
print(json.dumps({"missing": missing, "failed": failed, "where": list(muslin.sim.__path__)}))
"""


def modules() -> list[str]:
    """Return the dotted name of every module in the repository but `__main__`: importing that runs it."""
    names = []
    for path in sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if parts[-1] != "__main__":
            names.append(".".join(("muslin", *(parts[:-1] if parts[-1] == "__init__" else parts))))
    return names


def run(*command: str | Path, cwd: Path, given: str = "") -> str:
    """Run a command away from the repository and return what it printed; its errors are the test's."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [*map(str, command)], cwd=cwd, env=environment, input=given, capture_output=True, text=True
    )
    assert done.returncode == 0, f"{command} exited with {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a virtual environment that holds the built wheel and borrows every other library."""
    base = tmp_path_factory.mktemp("wheel")
    # A copy: building leaves files behind, and an old build folder would put removed modules into the wheel.
    source = base / "source"
    for folder in FOLDERS:
        shutil.copytree(ROOT / folder, source / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in BUILD_FILES:
        shutil.copy(ROOT / name, source / name)
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation"]
    run(*build, "--outdir", base / "dist", source, cwd=base)
    (wheel,) = (base / "dist").glob("muslin-*.whl")

    target = base / "venv"
    venv.create(target, with_pip=False, symlinks=True)
    python = target / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check"]
    run(*pip, "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=base)
    # A folder named in a .pth file is searched, but the .pth files inside it are not read: so the editable
    # install of the repository stays out.
    libraries = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (site,) = target.glob("lib/python*/site-packages")
    (site / "borrowed.pth").write_text("\n".join(sorted(libraries)) + "\n", encoding="utf-8")
    return target


def test_every_module_imports(installed: Path, tmp_path: Path) -> None:
    output = run(installed / "bin/python", "-c", IMPORT_ALL, cwd=tmp_path, given=json.dumps(modules()))
    result = json.loads(output.splitlines()[-1])
    assert all(where.startswith(str(installed)) for where in result["where"])
    assert not result["failed"]
    assert not {name: library for name, library in result["missing"].items() if library not in OPTIONAL}


def test_every_data_file_is_there(installed: Path) -> None:
    (package,) = installed.glob("lib/python*/site-packages/muslin")
    expected = {
        path.relative_to(ROOT).as_posix()
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix not in {".py", ".pyc"}
    }
    there = {path.relative_to(package).as_posix() for path in package.rglob("*") if path.is_file()}
    assert expected - there == set(), "list the folder in [tool.setuptools.package-data]"


def test_command_line_runs(installed: Path, tmp_path: Path) -> None:
    muslin = installed / "bin/muslin"
    assert version("muslin") in run(muslin, "--version", cwd=tmp_path)
    run(muslin, "pattern", "tee", "--out", "tee.json", cwd=tmp_path)
    assert json.loads((tmp_path / "tee.json").read_text(encoding="utf-8"))["schema_version"]
