"""Commands of the command line, run in this process."""

from __future__ import annotations

from typer.testing import CliRunner

from muslin.eval.cli.app import app


def muslin(*arguments, code: int = 0):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == code, (result.output, result.exception)
    return result


def refused(*arguments, says: str):
    """Exit code 2, one line on standard error, no traceback."""
    result = muslin(*arguments, code=2)
    assert says in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert "Traceback" not in result.output
