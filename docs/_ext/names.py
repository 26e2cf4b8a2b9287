"""``.. names::``: the names on the top level, each with its first sentence and a picture of a page that uses it."""

import inspect
import re
from collections import Counter
from pathlib import Path

from sphinx.util.docutils import SphinxDirective

import facewrinkle

GALLERY = Path(__file__).parents[2] / "gallery"


def names():
    """Return the names on the top level that are no rooms."""
    return [name for name in facewrinkle.__all__ if not inspect.ismodule(getattr(facewrinkle, name))]


def summary(name):
    """Return the first sentence about a public name."""
    value = getattr(facewrinkle, name)
    if not callable(value):
        return f"The {name.lower().replace('_', ' ')} of the built-in atlas."
    return re.split(r"(?<=\.)\s", " ".join(inspect.getdoc(value).split()), maxsplit=1)[0]


def pages():
    """Return a page of the gallery for each name that one uses, so that few names share a page."""
    paths = sorted(GALLERY.rglob("plot_*.py"))
    texts = {path.relative_to(GALLERY).with_suffix(""): path.read_text(encoding="utf-8") for path in paths}
    said = {page: set(re.findall(r"\bfw\.(\w+)", text)) for page, text in texts.items()}
    uses = {name: [page for page in texts if name in said[page]] for name in names()}
    taken, chosen = Counter(), {}
    for name in sorted((name for name in uses if uses[name]), key=lambda name: (len(uses[name]), name)):
        chosen[name] = min(uses[name], key=lambda page: (taken[page], page.stem))
        taken[chosen[name]] += 1
    return chosen


class Names(SphinxDirective):
    """The directive. Pictures are there once the gallery has been built."""

    def run(self):
        """Return the table."""
        lines, chosen = [".. list-table::", "   :widths: 22 48 30", ""], pages()
        for name in sorted(names(), key=str.lower):
            room = "errors." if hasattr(facewrinkle.errors, name) else ""  # documented by where they are
            lines += [f"   * - :obj:`~facewrinkle.{room}{name}`", f"     - {summary(name)}"]
            page = chosen.get(name, Path("none"))
            thumbnail = f"gallery/{page.parent}/images/thumb/sphx_glr_{page.stem}_thumb.png"
            if (Path(self.env.srcdir) / thumbnail).exists():
                lines += [
                    f"     - .. figure:: /{thumbnail}",
                    "          :width: 180",
                    f"          :alt: {name} at work",
                ]
                lines += ["", f"          :doc:`/gallery/{page}`", ""]
            else:
                lines += ["     -"]
        return self.parse_text_to_nodes("\n".join(lines))


def setup(app):
    """Called by Sphinx."""
    app.add_directive("names", Names)
    return {"parallel_read_safe": True}
