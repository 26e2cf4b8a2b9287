"""What a report of a problem needs: versions of the package and of what it uses, and the graphics card."""

from __future__ import annotations

from typing import Any

import pyvista as pv


def Report(**options: Any) -> Any:
    """Return the report of :class:`pyvista.Report`, with this package and what it uses, to describe a problem.

    Parameters
    ----------
    **options
        Those of :class:`pyvista.Report`, such as ``gpu=False``.

    Examples
    --------
    >>> "facewrinkle : " in str(Report(gpu=False))
    True
    """
    used = ["facewrinkle", "scipy", "numba", "h5py", "usd-core", "imageio-ffmpeg", "aiohttp", "pyarrow"]
    return pv.Report(**{"additional": used, **options})
