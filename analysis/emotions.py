"""Emotions of the atlas against captured ones, which are put together from the captured shapes of their action units.

The captured counterpart of an emotion is the sum of the shapes of its units, as strong as they are in it. The ceiling
is the best mixture of the muscles: a non-negative least-squares fit of their own fields to the captured emotion.

    python -m analysis.emotions FACE.obj --landmarks LANDMARKS.json --shapes SHAPES.npz --units cm
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import nnls

import facewrinkle as fw
from facewrinkle.geometry.normals import vertex_areas

from .motion import Agreement, compared, run_on_captured, settled, summed
from .report import COLORS, Plot, Report, Table, plot

Array = npt.NDArray[np.float64]

EMOTIONS = "happiness", "sadness", "surprise", "fear", "anger", "disgust", "contempt"

SHAPES: Mapping[str, tuple[float, str]] = {
    "AU1": (1.0, "browInnerUp_L+browInnerUp_R"),
    "AU2": (1.0, "browOuterUp_L+browOuterUp_R"),
    "AU4": (1.0, "browDown_L+browDown_R"),
    "AU5": (1.0, "eyeWide_L+eyeWide_R"),
    "AU6": (1.0, "cheekSquint_L+cheekSquint_R"),
    "AU7": (1.0, "eyeSquint_L+eyeSquint_R"),
    "AU9": (1.0, "noseSneer_L+noseSneer_R"),
    "AU10": (1.0, "mouthUpperUp_L+mouthUpperUp_R"),
    "AU11": (1.0, "mouthUpperUp_L+mouthUpperUp_R"),
    "AU12": (1.0, "mouthSmile_L+mouthSmile_R"),
    "AU12R": (1.0, "mouthSmile_R"),
    "AU14R": (1.0, "mouthDimple_R"),
    "AU15": (1.0, "mouthFrown_L+mouthFrown_R"),
    "AU17": (1.0, "mouthShrugLower"),
    "AU20": (1.0, "mouthStretch_L+mouthStretch_R"),
    "AU23": (0.5, "mouthRollLower+mouthRollUpper"),
    "AU24": (1.0, "mouthPress_L+mouthPress_R"),
    "AU25": (0.5, "mouthLowerDown_L+mouthLowerDown_R"),
    "AU26": (0.6, "jawOpen"),
    "AU64": (1.0, "eyeLookDown_L+eyeLookDown_R"),
}
"""Captured shapes of these units, and the share of them that the unit is: a jaw that drops is not stretched open
(AU27), lips that part are not drawn down (AU16), nor are tight ones sucked in (AU28). AU11 has no shape of its own.
"""


@dataclass(frozen=True)
class EmotionAgreement:
    """An emotion of the atlas against the captured one.

    Attributes
    ----------
    agreement : Agreement
        Of the atlas; `muscle` is the name of the expression, `shape` its action units.
    ceiling : float
        Cosine similarity of the best mixture of the muscles.
    nearest : str
        The captured emotion that this one resembles most.
    """

    agreement: Agreement
    ceiling: float
    nearest: str


def captured_emotion(shapes: Mapping[str, Array], units: Mapping[str, float]) -> Array:
    """Return the displacements (n, 3) in mm of action units with intensities in [0, 1]."""
    parts = []
    for unit, intensity in units.items():
        share, name = SHAPES[unit]
        parts.append(intensity * share * summed(dict(shapes), name))
    return np.asarray(sum(parts))


def emotion_agreements(face: fw.Face, shapes: Mapping[str, Array]) -> list[EmotionAgreement]:
    """Return the agreement of every one of `EMOTIONS` on a face with captured shapes."""
    skin = fw.Skin(face, time_step=1.0)
    area = vertex_areas(skin.points, face.triangles)
    fields = np.stack([settled(skin, {name: 1.0}).ravel() for name in face.muscles], axis=1)
    units_of = {emotion: face.atlas.units_of({emotion: 1.0}) for emotion in EMOTIONS}
    captured = {emotion: captured_emotion(shapes, units) for emotion, units in units_of.items()}
    out = []
    for emotion, units in units_of.items():
        ours = settled(skin, face.atlas.contractions(emotion))
        best = fields @ nnls(fields, captured[emotion].ravel())[0]
        rows = {other: compared(ours, field, area, emotion, "+".join(units)) for other, field in captured.items()}
        ceiling = compared(best.reshape(-1, 3), captured[emotion], area).cosine
        out.append(EmotionAgreement(rows[emotion], ceiling, max(rows, key=lambda other: rows[other].cosine)))
    return out


def report(face: fw.Face, shapes: Mapping[str, Array]) -> Report:
    """Report all emotions on a captured face."""
    rows = emotion_agreements(face, shapes)
    figure, (ax,) = plot(1, 1, (7.0, 3.0))
    bars = {"atlas": [row.agreement.cosine for row in rows], "best mixture": [row.ceiling for row in rows]}
    for k, (label, values) in enumerate(bars.items()):
        ax.barh(np.arange(len(rows)) + 0.4 * (k - 0.5), values, 0.36, color=COLORS[k], label=label)
    ax.set_yticks(np.arange(len(rows)), [row.agreement.muscle for row in rows], fontsize=7)
    ax.set(xlabel="cosine")
    ax.invert_yaxis()
    ax.legend(fontsize=7, frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    names = ("emotion", "units", "cosine", "by area", "size", "error (mm)", "largest (mm)", "captured (mm)")
    return Report(
        "emotions",
        "Emotions",
        "Displacements of the atlas's emotions against the sums of the captured shapes of their action units, "
        "on the same mesh, and the best that any mixture of the muscles reaches.",
        f"Mean cosine {np.mean(bars['atlas']):.2f} (the least {min(bars['atlas']):.2f}); the best mixtures reach "
        f"{np.mean(bars['best mixture']):.2f}.",
        [
            Table(
                "Emotions",
                (*names, "best mixture", "most like"),
                [(*asdict(row.agreement).values(), row.ceiling, row.nearest) for row in rows],
            )
        ],
        [Plot("emotions", figure, "Agreement of the emotions with captured ones.")],
        {"emotions": [asdict(row) for row in rows]},
    )


if __name__ == "__main__":
    run_on_captured(report)
