"""File formats: what is read from OBJ, OFF, PLY, glTF, USD, VTK and STL files, and their images."""
