"""Errors of docs/measured/planted_errors.csv can be planted; the tests that caught them exist."""

from __future__ import annotations

import ast

import pytest
from underwater_spectral.benchmarks import planted_errors as errors
from underwater_spectral.benchmarks.runner import ROOT

ROWS = {row["error"]: row for row in errors.rows()}
TESTS = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))


@pytest.mark.parametrize("error", errors.ERRORS, ids=lambda error: error.name)
def test_an_error_can_be_planted(error):
    """Code moves on; an error whose line is gone would never be looked for again."""
    ast.parse(error.planted(ROOT / "uw_spectral"))


@pytest.mark.parametrize("error", errors.ERRORS, ids=lambda error: error.name)
def test_what_caught_it_is_there(error):
    row = ROWS[error.name]
    names = [name for column in errors.COLUMNS[1:] for name in row[column].split("; ") if name]
    assert names
    assert [name for name in names if f"def {name}(" not in TESTS] == []


def test_every_row_is_an_error():
    assert list(ROWS) == [error.name for error in errors.ERRORS]


def test_text_that_is_not_there_once_is_refused(tmp_path):
    (tmp_path / "code.py").write_text("a = 1\na = 1\n", encoding="utf-8")
    for text in ("a = 1", "b = 1"):
        with pytest.raises(ValueError, match=r"not once in code\.py"):
            errors.Error("", "code.py", text, "").planted(tmp_path)
