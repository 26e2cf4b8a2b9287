"""What the pages of the site say can be done, and the reference names everything."""

from __future__ import annotations

import doctest
import inspect
import itertools
import re
import textwrap
from contextlib import ExitStack, suppress
from importlib import import_module
from pathlib import Path

import pytest
import pyvista as pv
from cyclopts import MissingArgumentError

import facewrinkle as fw
from facewrinkle.cli import app
from facewrinkle.dataset import generate
from facewrinkle.export import write_series
from facewrinkle.mesh import to_polydata

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(page for folder in (DOCS, DOCS / "howto", DOCS / "theory") for page in folder.glob("*.rst"))


def code_of(page):
    """The Python of a page, in blocks."""
    text = (DOCS / page).read_text(encoding="utf-8")
    blocks = []
    for part in text.split(".. code-block:: python\n\n")[1:]:
        dent = re.match(" +", part)[0]
        block = itertools.takewhile(lambda line, dent=dent: not line or line.startswith(dent), part.splitlines())
        blocks.append(textwrap.dedent("\n".join(block)))
    return blocks


FEWER = {
    r"sim\.run\(\d+\)": "sim.run(3)",
    r"for i in range\(100\)": "for i in range(3)",
    r"for seed in range\(100\)": "for seed in range(1)",
    r"fw\.rig\((face|fw\.fit_face\([^)]*\))": r'fw.rig(\1, "browInnerUp+jawOpen"',
    r'"browInnerUp\+jawOpen", "[^"]*"': '"browInnerUp+jawOpen"',
    "size=2048": "size=256",
    r"000000\.\.000009": "000000..000000",
    "window.wait()": "",
}
"""What makes the code of pages shorter: frames, people, shapes, texels, shards and waiting."""

QUICK = {"start", "fields", "speed", "layer", "for_researchers"}
"""Pages whose code takes no more than three seconds."""


ELSEWHERE = re.compile(r"\bimport (bpy|maya|datasets)\b|\bhou\.")
"""In blocks for the Python of other programs, or for packages that are not installed here: these only compile."""


def pages_with_code():
    """All pages with code that runs here."""
    for page in PAGES:
        if [block for block in code_of(page) if not ELSEWHERE.search(block)]:
            marks = [] if page.stem in QUICK else [pytest.mark.slow]
            if page.stem == "dataset":  # webdataset leaves its shards open
                marks.append(pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"))
            yield pytest.param(page, id=page.stem, marks=marks)


@pytest.fixture
def users_folder(tmp_path, monkeypatch, face):
    """The present folder, with the files that pages name; windows of the studio close at the end."""
    monkeypatch.chdir(tmp_path)
    for name in ("scan.obj", "head.obj"):
        pv.PolyData.from_regular_faces(0.1 * face.points, face.triangles).save(name)
    names = [name for name in face.landmarks if not name.endswith("_centre")]
    fw.anatomy.landmarks.write_landmarks({name: 0.1 * face.landmarks[name] for name in names}, "landmarks.json")
    Path("take.csv").write_text("time,mouthSmileLeft\n0,0\n0.1,0.4\n")
    frames = [to_polydata(face.points + shift, face.triangles) for shift in (0.0, 0.1)]
    write_series(frames, [0.0, 0.1], "clip.vtkhdf")
    with ExitStack() as windows:
        studio = fw.studio
        monkeypatch.setattr(fw, "studio", lambda shown, **_: windows.enter_context(studio(shown, browser=False)))
        monkeypatch.setattr(pv.global_theme, "jupyter_backend", "static")
        yield tmp_path


@pytest.mark.parametrize("page", list(pages_with_code()))
def test_code_of_pages_runs_from_the_top(page, users_folder):
    if page.stem == "dataset":
        generate({"size": [64, 64], "shard": 2}, "dataset", count=2)
    code = "\n".join(block for block in code_of(page) if not ELSEWHERE.search(block)).replace("clip.glb", "clip.vtkhdf")
    for long, short in FEWER.items():
        code = re.sub(long, short, code)
    space = {"__name__": page.stem, "print": lambda *_: None}
    exec(code, space)
    if page.stem == "scan":
        assert space["face"].unit == pytest.approx(10.0, rel=0.02)
        assert abs(space["frame"]["W"]).max() > 0.3
    if page.stem == "expression":
        assert "procerus" in space["sim"].face.muscles
    if page.stem == "animation":
        assert space["take"].duration == pytest.approx(0.1)
    if page.stem == "start":
        assert (users_folder / "surprise.png").stat().st_size > 10_000


def test_code_of_the_readme_runs(users_folder):
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    exec(re.search(r"```python\n(.*?)```", readme, re.DOTALL)[1], {"print": lambda *_: None})
    assert Path("surprise.png").stat().st_size > 10_000


def test_all_python_compiles():
    for page in PAGES:
        for block in code_of(page):
            compile(block, page.name, "exec")


def test_names_in_the_text_exist():
    """Roles with a full name, such as :func:`facewrinkle.plotting.picture`."""
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
    there = [path.relative_to(root).as_posix() for path in root.glob("[!.]*/**/*") if path.suffix]
    assert [name for name in sorted(named) if not any(f"/{path}".endswith(f"/{name}") for path in there)] == []


def papers():
    return (DOCS / "papers.rst").read_text(encoding="utf-8")


def test_links_of_the_papers_lead_somewhere():
    """To labels, pages and pictures of the site; names in code are tested with those of all pages."""
    gallery = sorted((DOCS.parent / "gallery").glob("plot_*.py"))
    sources = "\n".join(page.read_text(encoding="utf-8") for page in [*PAGES, *gallery])
    labels = set(re.findall(r"^\.\. _([\w-]+):$", sources, re.MULTILINE))
    pages = {str(page.relative_to(DOCS).with_suffix("")) for page in PAGES} | {f"gallery/{x.stem}" for x in gallery}
    assert set(re.findall(r":ref:`(?:[^`<]*<)?([\w-]+)>?`", papers())) <= labels
    assert set(re.findall(r":doc:`/?([\w/]+)`", papers())) <= pages
    assert set(re.findall(r":target: (gallery/\w+)\.html", papers())) <= pages
    assert {f"gallery/{name}" for name in re.findall(r"sphx_glr_(\w+)_\d{3}\.png", papers())} <= pages


def test_commands_in_the_docs_are_understood():
    """A command without an argument that it needs is only named."""
    texts = [*PAGES, *(DOCS.parent / "gallery").glob("plot_*.py"), DOCS.parent / "README.md"]
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
