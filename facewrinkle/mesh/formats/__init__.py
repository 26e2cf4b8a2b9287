"""File formats: readers of OBJ, OFF, PLY, glTF, USD, VTK and STL files, and of their images."""
