"""The mechanics of the skin, as numbers that can be set."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from ..errors import check_range


@dataclass(frozen=True, kw_only=True)
class SkinMaterial:
    """Mechanics of the skin, relative to its membrane stiffness of 1. Lengths in mm, times in s.

    Attributes
    ----------
    decay : float
        Distance over which a local pull dies out on the forehead: sqrt(membrane stiffness / stiffness of the tethers).
    normal_ratio : float
        Stiffness of the tethers along the normal, relative to that along the surface, for tissue as on the forehead.
    bending : float
        Biharmonic bending stiffness, mm^2.
    threshold, stiffening : float
        Strain beyond which a spring gets stiffer, and the stiffness that is added then, relative to its own.
    pull : float
        Distance by which a muscle of strength 1 would move wide, free skin of the forehead, mm.
    rate : float
        Natural frequency of the skin on its tethers, rad/s.
    damping : float
        Relative to critical damping.
    smallest_area : float
        Triangles are kept from falling below this share of their area.
    lid_stiffness : float
        Stiffness of the tethers of the lids' plates, relative to those of the forehead.
    lip_firmness : float
        Stiffness that is added to the tethers of the lips along the surface, relative to their own: flesh does not
        glide as skin on bone does.
    cartilage : float
        Stiffness that is added to the springs at the tip of the nose, relative to their own: the tip goes along, and
        stays whole, when the wings of the nose rise.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> soft = fw.SkinMaterial(decay=20.0, damping=0.3)  # pulls reach further, and the skin swings
    >>> sim = fw.Simulation(fw.default_face(), material=soft)
    """

    decay: float = 14.0
    normal_ratio: float = 2.5
    bending: float = 20.0
    threshold: float = 0.3
    stiffening: float = 2.0
    pull: float = 18.0
    rate: float = 30.0
    damping: float = 1.0
    smallest_area: float = 0.3
    lid_stiffness: float = 5000.0
    lip_firmness: float = 1.3
    cartilage: float = 13.0

    def __post_init__(self) -> None:
        for name, value in dataclasses.asdict(self).items():
            smallest = 1e-6 if name in ("decay", "rate", "normal_ratio", "bending") else 0.0
            check_range(name, value, smallest, 1e9)
