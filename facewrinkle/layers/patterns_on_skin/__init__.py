"""Patterns as layers: on a region of a surface, with natural variation, and presets placed by landmarks."""
