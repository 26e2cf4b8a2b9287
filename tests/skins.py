"""Skins that hold contraction rates, for tests."""

import facewrinkle as fw


def held(skin, rates, steps):
    """Hold contraction rates by muscle for some steps; returns the displacements (n, 3) at their end, mm."""
    skin.contract(rates)
    for _ in range(steps):
        skin.step()
    return skin.displacement.copy()


def settled(face, what, **material):
    """Displacements (n, 3) of skin at rest under an expression: to the subject's left, up and forward, mm."""
    skin = fw.Skin(face, time_step=1.0, material=fw.SkinMaterial(**material))
    return held(skin, face.atlas.contractions(what), 15) @ face.frame.axes.T
