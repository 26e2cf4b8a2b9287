"""The order of the gallery's pages: the one in which they teach."""

from pathlib import Path

ORDER = (
    "first_expression",
    "five_expressions",
    "growing_wrinkles",
    "own_expression",
    "people",
    "data",
    "dataset",
    "own_scan",
    "studio",
    "animation",
    "character",
    "muscles",
    "skin",
    "wave_folds",
    "wrinkle_shape",
    "compression",
    "refinement",
    "fields",
    "measure_wrinkle",
    "own_layer",
    "export",
    "wrinkle_patterns",
    "pattern_functions",
    "forehead_cycle",
    "dimples",
    "eye_pouch",
    "any_surface",
    "own_pattern",
    "fig11_dripping_tear",
    "fig12_shedding_tear",
    "fig08_tear_shapes",
    "fig09_fig10_tear_steps",
    "water",
)


class Story:
    """Sorts file names; pages that the order does not name come last."""

    def __init__(self, src_dir):
        pass

    def __repr__(self):
        return "<Story>"

    def __call__(self, name):
        stem = Path(name).stem.removeprefix("plot_")
        return (ORDER.index(stem) if stem in ORDER else len(ORDER), stem)
