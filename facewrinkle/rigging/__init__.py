"""Rigs: a face with blend shapes that wrinkle, for other programs."""





