"""The pictures of gallery pages: PyVista's scenes, which a reader can turn, beside their pictures."""

import pyvista as pv
from pyvista.plotting.utilities.sphinx_gallery import DynamicScraper


class Scenes(DynamicScraper):
    """PyVista's scraper, without the plotters of :class:`facewrinkle.plotting.Scene`: their pictures are used in the
    pages.
    """

    def __call__(self, block, block_vars, gallery_conf):
        """Called by sphinx-gallery after each block of a page."""
        plotters = pv.plotting.plotter._ALL_PLOTTERS
        for name in [name for name, plotter in plotters.items() if plotter._closed]:
            del plotters[name]
        return super().__call__(block, block_vars, gallery_conf)
