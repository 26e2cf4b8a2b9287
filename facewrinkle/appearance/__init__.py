"""Meshes, with colours, of what is seen of a face beside its skin: pictures and files share them."""
