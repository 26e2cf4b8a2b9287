"""Wrinkles that muscles fold into faces, on PyVista meshes."""
