"""The site: `make docs`."""

import logging
import os
import sys
import warnings
from pathlib import Path

if sys.platform.startswith("linux"):
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
os.environ["PYVISTA_BUILDING_GALLERY"] = "true"

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

import pyvista as pv  # noqa: E402
import sphinx.ext.autosummary as summaries  # noqa: E402
from docutils import nodes  # noqa: E402
from scenes import Scenes  # noqa: E402

import facewrinkle  # noqa: E402

pv.OFF_SCREEN = True
pv.BUILDING_GALLERY = True
warnings.filterwarnings("ignore", message=".*non-interactive, and thus cannot be shown")
logging.getLogger("asyncio").setLevel(logging.CRITICAL)  # trame asks the network for what scenes do without

summaries.WELL_KNOWN_ABBREVIATIONS += ("Eq.", "Eqs.", "Fig.", "Figs.")  # no ends of sentences

project = "facewrinkle"
author = "the facewrinkle authors"
copyright = "2026, the facewrinkle authors"
version = release = facewrinkle.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "pyvista.ext.viewer_directive",
    "cyclopts.ext.sphinx",
    "mathml",
    "names",
]
templates_path = ["_templates"]
exclude_patterns = ["_build", "images"]
html_math_renderer = "mathml"
nitpicky = False
smartquotes_action = "qe"  # "--face" is no dash

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"  # the docstrings say types and shapes
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
autoclass_content = "class"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = [("Attributes", "params_style")]
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_preprocess_types = False

sphinx_gallery_conf = {
    "examples_dirs": "../gallery",
    "gallery_dirs": "gallery",
    "filename_pattern": "/plot_",
    "image_scrapers": (Scenes(), "matplotlib"),
    "abort_on_example_error": True,
    "capture_repr": (),
    "download_all_examples": False,
    "remove_config_comments": True,
    "write_computation_times": False,
    "show_memory": False,
    "show_signature": False,
    "subsection_order": "story.place",
    "within_subsection_order": "story.Story",
    "reference_url": {"facewrinkle": None},
    "doc_module": ("facewrinkle",),
    "backreferences_dir": "gallery/backreferences",
    "inspect_global_variables": False,
    "nested_sections": False,
}

html_theme = "pydata_sphinx_theme"
html_title = "facewrinkle"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "show_prev_next": False,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "header_links_before_dropdown": 7,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "tango",
    "pygments_dark_style": "monokai",
}
html_sidebars = {"index": []}


def dashed(app, what, name, thing, options, lines):
    """The dashes that napoleon puts before descriptions; in all other places two hyphens are those of an option."""
    lines[:] = [line.replace(" -- ", " – ") for line in lines]


def dashed_fields(app, tree):
    """The dashes that Sphinx puts between an error and when it is raised."""
    for text in [text for text in tree.findall(nodes.Text) if text.astext() == " -- "]:
        text.parent.replace(text, nodes.Text(" – "))


def setup(app):
    app.connect("autodoc-process-docstring", dashed, priority=600)  # after napoleon
    app.connect("doctree-read", dashed_fields)
