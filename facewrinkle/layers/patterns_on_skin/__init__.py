"""Pattern functions as layers: on a region of a surface, with natural variation, and presets by landmarks."""
