"""Formulas of the site: docutils turns each into MathML."""

import re
from pathlib import Path

import pytest
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml

ROOT = Path(__file__).parents[1]
INLINE = re.compile(r":math:`([^`]+)`")
DISPLAY = re.compile(r"^( *)\.\. math::([^\n]*\n(?:\1 +[^\n]*\n|[ \t]*\n)+)", re.MULTILINE)


def formulas(text: str) -> list[tuple[str, bool]]:
    """The formulas of a text, and True for those that stand by themselves."""
    display = [(" ".join(block.split()), True) for _, block in DISPLAY.findall(text)]
    return [(" ".join(found.split()), False) for found in INLINE.findall(text)] + display


SOURCES = [
    *(path for path in (ROOT / "docs").rglob("*.rst") if not {"_build", "gallery", "generated"} & {*path.parts}),
    *(path for folder in ("facewrinkle", "gallery") for path in (ROOT / folder).rglob("*.py")),
]


def test_docutils_knows_every_formula():
    unknown, seen = [], 0
    for path in sorted(SOURCES):
        for formula, display in formulas(path.read_text(encoding="utf-8")):
            seen += 1
            try:
                tex2mathml(formula, as_block=display)
            except MathError as problem:
                unknown.append(f"{path.relative_to(ROOT)}: {formula}: {problem}")
    assert seen > 50
    assert not unknown


def test_formulas_are_found():
    text = "With :math:`a + b`.\n\n.. math::\n\n   c =\n   d\n\nMore.\n"
    assert formulas(text) == [("a + b", False), ("c = d", True)]
    with pytest.raises(MathError):
        tex2mathml(r"a \mathrel{-}= b")
