"""Recordings that move a face in place of its muscles: the files they are read from, and how they are played."""
