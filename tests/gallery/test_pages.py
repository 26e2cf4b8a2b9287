"""The pages of the gallery. `make docs`, which is a part of `make outside`, runs them with what they assert."""

from __future__ import annotations

import ast
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "gallery").rglob("plot_*.py"))


def name_of(page):
    return page.stem.removeprefix("plot_")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_page_has_a_title_and_asserts_a_number(page):
    code = ast.parse(page.read_text(encoding="utf-8"))
    title, line = [text for text in ast.get_docstring(code).splitlines() if text and not text.startswith("..")][:2]
    assert line == "=" * len(title)
    assert any(isinstance(node, ast.Assert) for node in ast.walk(code))


def test_the_site_shows_all_pages_in_its_order():
    sections = runpy.run_path(str(ROOT / "docs" / "_ext" / "story.py"))["SECTIONS"]
    listed = [(section, page) for section, pages in sections.items() for page in pages]
    assert sorted(listed) == sorted((page.parent.name, name_of(page)) for page in PAGES)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_page_needs_no_files(page):
    """Nor its own: where it is downloaded to, and where sphinx-gallery runs it, there is no ``__file__``."""
    text = page.read_text(encoding="utf-8")
    assert "shared" not in text
    assert "__file__" not in text
