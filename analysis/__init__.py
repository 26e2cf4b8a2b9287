"""Numbers and plots that verify the package; each module runs by itself: ``python -m analysis.motion --help``."""
