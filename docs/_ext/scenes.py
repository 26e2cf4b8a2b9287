"""The pictures of gallery pages: PyVista's scenes, which a reader can turn, beside their pictures."""

import pyvista as pv
from pyvista.plotting.utilities.sphinx_gallery import DynamicScraper


class Scenes(DynamicScraper):
    """PyVista's scraper, of plotters that were shown: those that only made a picture for the page are passed over."""

    def __call__(self, block, block_vars, gallery_conf):
        """Called by sphinx-gallery after each block of a page."""
        plotters = pv.plotting.plotter._ALL_PLOTTERS
        for name in [name for name, plotter in plotters.items() if plotter.last_image is None]:
            del plotters[name]
        return super().__call__(block, block_vars, gallery_conf)
