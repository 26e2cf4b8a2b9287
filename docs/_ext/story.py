"""The sections of the gallery and the order of its pages: the one in which they teach."""

from pathlib import Path

SECTIONS = {
    "faces": (
        "first_expression",
        "own_expression",
        "people",
        "own_scan",
        "animation",
        "character",
        "studio",
    ),
    "folds": (
        "five_expressions",
        "growing_wrinkles",
        "muscles",
        "skin",
        "wrinkle_shape",
        "compression",
        "refinement",
        "wave_folds",
    ),
    "patterns": (
        "wrinkle_patterns",
        "pattern_functions",
        "dimples",
        "eye_pouch",
        "any_surface",
        "own_pattern",
    ),
    "tears": (
        "tears_on_a_face",
        "tear_shapes",
        "tear_steps",
        "water",
    ),
    "numbers": (
        "fields",
        "measure_wrinkle",
        "own_layer",
        "dataset",
        "export",
    ),
}


def place(name):
    """Return the key by which folders of sections, and files of pages, are sorted; what no section names comes last."""
    stem = Path(name).stem.removeprefix("plot_")
    order = [*SECTIONS, *(page for pages in SECTIONS.values() for page in pages)]
    return (order.index(stem) if stem in order else len(order), stem)


class Story:
    """Sorts the pages of a section, as sphinx-gallery asks for it: a class whose instances are keys."""

    def __init__(self, src_dir):
        pass

    def __repr__(self):
        return "<Story>"

    def __call__(self, name):
        return place(name)
