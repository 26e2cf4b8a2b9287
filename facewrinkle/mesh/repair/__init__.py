"""Repair: any surface becomes one that the algorithms can rely on."""
