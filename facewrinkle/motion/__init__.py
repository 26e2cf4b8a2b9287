"""Motions: they move the base mesh, by the muscles of a face or by a recording."""
