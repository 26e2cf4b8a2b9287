"""Repair of surfaces, until the algorithms can rely on them."""
