"""Make the helpers importable, here and in the processes that the tests start; the undisturbed dataset."""

import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import pytest

from benchmarks.faults import Contents, contents


@pytest.fixture(scope="session")
def peaceful(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The dataset of sheets, when nothing happens to its making."""
    from sheets import make

    out = tmp_path_factory.mktemp("peaceful") / "data"
    assert len(make(out).made) == 9
    return out


@pytest.fixture(scope="session")
def undisturbed(peaceful: Path) -> Contents:
    """What that dataset holds."""
    return contents(peaceful)


@pytest.fixture(scope="session")
def s3(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a server that speaks S3, which this process and those it starts use from now on."""
    from s3_server import S3_VARIABLES, s3_server

    with s3_server(tmp_path_factory.mktemp("s3")) as address, pytest.MonkeyPatch.context() as patch:
        for name, value in S3_VARIABLES.items():
            patch.setenv(name, value)
        patch.setenv("AWS_ENDPOINT_URL", address)
        yield address


@pytest.fixture
def bucket(s3: str, request: pytest.FixtureRequest) -> str:
    """URL of a new bucket."""
    import s3fs

    name = request.node.name.replace("_", "-").split("[")[0][:60].strip("-")
    s3fs.S3FileSystem().mkdir(name)
    return f"s3://{name}"
