"""Skins that hold contraction rates, for tests."""


def held(skin, rates, steps):
    """Hold contraction rates by muscle for some steps; returns the displacements (n, 3) at their end, mm."""
    skin.contract(rates)
    for _ in range(steps):
        skin.step()
    return skin.displacement.copy()
