"""Docstrings say what a thing is or does: none of them opens with a question word."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
QUESTION = re.compile(r"\s*(What|How|Whether|Where|Which)\b")


def docstrings(path: Path) -> list[tuple[int, str]]:
    """The strings that stand alone in a module, also those under constants, with their lines."""
    return [
        (node.lineno, node.value.value)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    ]


FILES = sorted(path for folder in ("facewrinkle", "tools", "analysis") for path in (ROOT / folder).rglob("*.py"))


def test_no_docstring_opens_with_a_question_word():
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text.splitlines()[0]}"
        for path in FILES
        for line, text in docstrings(path)
        if QUESTION.match(text)
    ]
    assert not found


def test_the_reader_of_docstrings_sees_them():
    found = docstrings(ROOT / "facewrinkle" / "mesh" / "arrays.py")
    assert len(found) > 15
    assert QUESTION.match("Whether so.")
    assert not QUESTION.match("Whatever so.")
