"""Names are the field's words: what ``tools/words.py`` finds, and what it lets pass."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def words():
    found = importlib.util.spec_from_file_location("words", _ROOT / "tools" / "words.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def test_names_of_production_are_known_words(words, capsys):
    assert words.main() == 0, capsys.readouterr().out


@pytest.mark.parametrize(
    ("source", "complaint"),
    [
        ("def shade_of(light): ...", "'shade' was given up for occlusion"),
        ("def absorbed(glimmerwort): ...", "no word of the vocabulary: 'glimmerwort'"),
        ("def _absorbed(glimmerwort): ...", ""),
        ("class GlimmerwortLight: ...", "no word of the vocabulary: 'glimmerwort'"),
        ("shader = 1", ""),
    ],
)
def test_private_words_are_named(words, tmp_path, monkeypatch, capsys, source, complaint):
    for name in ("tools/vocabulary.txt", "docs/glossary.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text((_ROOT / name).read_text())
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "water.py").write_text(source)
    monkeypatch.setattr(words, "_ROOT", tmp_path)
    assert words.main() == bool(complaint)
    assert complaint in capsys.readouterr().out
