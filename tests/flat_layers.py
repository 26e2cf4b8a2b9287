"""A layer that adds nothing, from which those of tests are derived."""

import numpy as np

from facewrinkle.layers.base import Displacement, Layer


class Flat(Layer):
    """A layer without height that asks for no triangles."""

    def attach(self, face):
        self.face = face

    def follow(self, change, created):
        pass

    def displacement(self, state):
        n = len(state.bare)
        return Displacement(np.zeros(n), np.full(n, np.inf), np.zeros((n, 3)), np.zeros(n, bool))

    def fields(self):
        return {}
