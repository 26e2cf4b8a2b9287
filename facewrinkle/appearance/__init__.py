"""Coloured meshes of all that is seen of a face besides its skin, for pictures and for files."""
