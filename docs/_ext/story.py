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


class Story:
    """Sorts the folders of sections, and file names in them; pages that no section names come last."""

    def __init__(self, src_dir=None):
        pass

    def __repr__(self):
        return "<Story>"

    def __call__(self, name):
        stem = Path(name).stem.removeprefix("plot_")
        order = [*SECTIONS, *(page for pages in SECTIONS.values() for page in pages)]
        return (order.index(stem) if stem in order else len(order), stem)
