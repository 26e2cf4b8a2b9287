"""Draw the pictures of README that no command of the package draws: python -m tools.draw_readme

Look at them before they are committed.
"""

from __future__ import annotations

from pathlib import Path

import facewrinkle as fw
from facewrinkle.array_types import Image
from facewrinkle.plotting import Style, picture, save_picture, side_by_side, stacked
from facewrinkle.plotting.views import View

IMAGES = Path(__file__).parents[1] / "docs" / "images"

PORTRAIT = Style((470, 560), View((0.5, 0.03, 1.0), "nose_tip", (0.32, 0.1, -0.9), 4.0))
GROWN = {"age": 0.6, "sex": 0.8, "beard": 0.3}
"""Who is on the first picture."""

EMOTIONS = ("happiness", "surprise", "anger", "sadness", "disgust")
"""Those of the columns of people."""

SEED = 20
"""Of the first of twenty people."""


def shown(face: fw.Face, expression: str | None, style: Style) -> Image:
    """Return a picture of a face that holds an expression."""
    simulation = fw.Simulation(face)
    if expression is not None:
        simulation.express(expression)
    return picture(simulation.settle(), face, style)


def main() -> None:
    """Draw all of them."""
    face = fw.default_face(GROWN)
    images = [shown(face, expression, PORTRAIT) for expression in (None, "happiness", "paper_surprise")]
    print(save_picture(side_by_side(images), IMAGES / "smile.jpg"))
    rows = []
    for row in range(4):
        first = SEED + row * len(EMOTIONS)
        people = [fw.default_face(fw.Identity.random(first + k)) for k in range(len(EMOTIONS))]
        images = [shown(face, emotion, Style((280, 300))) for face, emotion in zip(people, EMOTIONS, strict=True)]
        rows.append(side_by_side(images, gap=0))
    print(save_picture(stacked(rows, gap=0), IMAGES / "people.jpg"))


if __name__ == "__main__":
    main()
