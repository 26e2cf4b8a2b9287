"""What the pages of the site say exists, and the reference names everything; the pages of the gallery assert.

`make outside` runs the code of both.
"""

import ast
import doctest
import inspect
import re
import runpy
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import pytest
from cyclopts import MissingArgumentError
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from outside.pages import DOCS, PAGES, code_of

import facewrinkle as fw
from facewrinkle.cli import app


def test_all_python_compiles():
    for page in PAGES:
        for block in code_of(page):
            compile(block, page.name, "exec")


def test_names_in_the_text_exist():
    """Roles with a full name, such as :func:`facewrinkle.picture`."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for name in re.findall(r":(?:class|func|meth|data|mod):`~?(facewrinkle[\w.]*)`", text):
            found, parts = fw, name.split(".")[1:]
            for i, part in enumerate(parts):
                if not hasattr(found, part):
                    import_module(".".join(["facewrinkle", *parts[: i + 1]]))
                found = getattr(found, part)


def test_the_reference_has_all_names_of_the_top_level():
    listed = set(re.findall(r"^   (\w+)$|^\.\. data:: (\w+)$", (DOCS / "api" / "main.rst").read_text(), re.MULTILINE))
    rooms = {name for name in fw.__all__ if inspect.ismodule(getattr(fw, name))}
    assert set(fw.__all__) - rooms <= {name for pair in listed for name in pair}


def found(module, name):
    """What a name of the reference stands for: an attribute, or one of a module below."""
    *rooms, last = name.split(".")
    try:
        return getattr(import_module(".".join([module, *rooms])), last)
    except ModuleNotFoundError:  # a method
        return getattr(getattr(import_module(module), rooms[-1]), last)


def named(page):
    """The names that a page of the reference lists, and what they stand for."""
    module = ""
    for line in page.read_text(encoding="utf-8").splitlines():
        if said := re.match(r"\.\. (?:current)?module:: (\S+)", line):
            module = said[1]
        elif module and (said := re.fullmatch(r"   ([A-Za-z_][\w.]*)", line)):
            yield f"{module}.{said[1]}", found(module, said[1])


@pytest.mark.parametrize("page", sorted((DOCS / "api").glob("*.rst")), ids=lambda page: page.stem)
def test_the_reference_names_what_there_is_and_shows_it(page):
    """Classes and functions have examples, which the doctests run; constants need none."""
    names = dict(named(page))
    assert names or page.stem in ("index", "names")
    assert None not in names.values()
    assert [name for name, thing in names.items() if callable(thing) and not shown(thing)] == []


def shown(thing):
    """Whether its own text has a section of examples."""
    _, _, examples = inspect.cleandoc(thing.__doc__ or "").partition("\nExamples\n--------\n")
    return bool(doctest.DocTestParser().get_examples(examples))


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/architecture.rst"])
def test_files_that_are_named_for_contributors_exist(page):
    root = DOCS.parent
    text = (root / page).read_text(encoding="utf-8")
    named = {name for name in re.findall(r"`([\w./]+\.(?:py|js|toml|json|rst))`", text) if "module.py" not in name}
    assert len(named) > 10
    paths = [*root.glob("*"), *root.glob("[!.]*/**/*")]
    there = [path.relative_to(root).as_posix() for path in paths if path.suffix]
    assert [name for name in sorted(named) if not any(f"/{path}".endswith(f"/{name}") for path in there)] == []


def papers():
    return (DOCS / "papers.rst").read_text(encoding="utf-8")


def test_links_of_the_papers_lead_somewhere():
    """To labels, pages and pictures of the site; names in code are tested with those of all pages."""
    gallery = sorted((DOCS.parent / "gallery").rglob("plot_*.py"))
    sources = "\n".join(page.read_text(encoding="utf-8") for page in [*PAGES, *gallery])
    labels = set(re.findall(r"^(?:# )?\.\. _([\w-]+):$", sources, re.MULTILINE))
    pages = {str(page.relative_to(DOCS).with_suffix("")) for page in PAGES}
    pages |= {f"gallery/{page.parent.name}/{page.stem}" for page in gallery}
    assert set(re.findall(r":ref:`(?:[^`<]*<)?([\w-]+)>?`", papers())) <= labels
    assert set(re.findall(r":doc:`/?([\w/]+)`", papers())) <= pages
    assert set(re.findall(r":target: (gallery/[\w/]+)\.html", papers())) <= pages
    pictures = re.findall(r"/(gallery/\w+)/images/sphx_glr_(\w+)_\d{3}\.png", papers())
    assert {f"{section}/{page}" for section, page in pictures} <= pages


def test_commands_in_the_docs_are_understood():
    """A command without an argument that it needs is only named."""
    texts = [*PAGES, *(DOCS.parent / "gallery").rglob("plot_*.py"), DOCS.parent / "README.md"]
    written = "\n".join(text.read_text(encoding="utf-8") for text in texts)
    commands = set(re.findall(r"(?:``|^ +(?:\$ )?)facewrinkle ([^`#>\n]+)", written, re.MULTILINE))
    assert len(commands) > 60
    for command in commands:
        with suppress(MissingArgumentError):
            app.parse_args(command.split(), exit_on_error=False, print_error=False)


@pytest.mark.parametrize("title, rows", [("figures and table", 14), ("equations", 19), ("Paper B: figures", 12)])
def test_the_papers_are_there_as_a_whole(title, rows):
    """Every figure and every equation, by its number."""
    section = papers().partition(title + "\n")[2].partition("\nPaper ")[0]
    found = set()
    for first in re.findall(r"^   \* - (?:Figs?\. |(?=\d))(.*)$", section, re.MULTILINE):
        for low, high in re.findall(r"(\d+)(?:-(\d+))?", first.partition(":")[0]):
            found |= set(range(int(low), int(high or low) + 1))
    assert found == set(range(1, rows + 1))


# --- the pages of the gallery ----------------------------------------------------------------------


ROOT = Path(__file__).parents[2]
GALLERY = sorted((ROOT / "gallery").rglob("plot_*.py"))


def name_of(page):
    return page.stem.removeprefix("plot_")


@pytest.mark.parametrize("page", GALLERY, ids=name_of)
def test_page_has_a_title_and_asserts_a_number(page):
    code = ast.parse(page.read_text(encoding="utf-8"))
    title, line = [text for text in ast.get_docstring(code).splitlines() if text and not text.startswith("..")][:2]
    assert line == "=" * len(title)
    assert any(isinstance(node, ast.Assert) for node in ast.walk(code))


def test_the_site_shows_all_pages_in_its_order():
    sections = runpy.run_path(str(ROOT / "docs" / "_ext" / "story.py"))["SECTIONS"]
    listed = [(section, page) for section, pages in sections.items() for page in pages]
    assert sorted(listed) == sorted((page.parent.name, name_of(page)) for page in GALLERY)


@pytest.mark.parametrize("page", GALLERY, ids=name_of)
def test_page_needs_no_files(page):
    """Nor its own: where it is downloaded to, and where sphinx-gallery runs it, there is no ``__file__``."""
    text = page.read_text(encoding="utf-8")
    assert "shared" not in text
    assert "__file__" not in text


# --- formulas: docutils turns each into MathML ----------------------------------------------------


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
