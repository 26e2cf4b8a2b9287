"""What layers of one's own return: what is wrong with it is said before it reaches any loop.

what                    checked against
arrays                  the errors that name the layer, what is allowed and what was received
other types             the frame with the arrays as they should be, bit for bit
"""

from dataclasses import replace

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.layers.base import Displacement, Layer


class Dents(Layer):
    """A layer with waves in height, along x, that fields and displacements are taken from."""

    def __init__(self, changed=lambda found: found, fields=lambda n: {}):
        self.changed, self.own_fields = changed, fields

    def attach(self, face):
        self.x = np.empty(0)

    def follow(self, change, created):
        self.x = np.concatenate([self.x[change.kept], created.points[:, 0]])

    def displacement(self, state):
        n, across = len(self.x), np.tile([1.0, 0.0, 0.0], (len(self.x), 1))
        active = np.abs(self.x) < 30.0
        found = Displacement(0.5 * active * np.cos(self.x), np.where(active, np.pi, np.inf), across, active)
        assert len(found.height) == n
        return self.changed(found)

    def fields(self):
        return self.own_fields(len(self.x))


def simulated(face, layer):
    return fw.Simulation(face, fw.Refinement(max_level=1), layers=[layer], motion=fw.Still(face))


def with_one(values, first):
    out = np.array(values)
    out[0] = first
    return out


BROKEN = [
    ("height", lambda v: np.zeros(3), r"must have the shape \(\d+,\), received \(3,\)\."),
    ("height", lambda v: with_one(v, np.nan), r"must be finite; entry \[0\] is nan"),
    ("height", lambda v: with_one(v, -1e300), r"must be finite; entry \[0\] is -1e\+300"),
    ("height", lambda v: None, "must be numbers|must be finite"),
    ("spacing", lambda v: v[:-1], r"must have the shape \(\d+,\), received"),
    ("spacing", lambda v: v[:, None], r"must have the shape \(\d+,\), received \(\d+, 1\)"),
    ("spacing", lambda v: 1.0, r"must have the shape \(\d+,\), received \(\)\."),
    ("spacing", lambda v: with_one(v, np.nan), "must be greater than 0"),
    ("spacing", lambda v: with_one(v, 0.0), "must be greater than 0. Infinity asks for no triangles"),
    ("across", lambda v: np.zeros((3, 3)), r"must have the shape \(\d+, 3\), received \(3, 3\)"),
    ("across", lambda v: v[:, :2], r"must have the shape \(\d+, 3\), received \(\d+, 2\)"),
    ("across", lambda v: np.full(v.shape, "x"), "must be numbers in rows of one length"),
    ("across", lambda v: with_one(v, np.nan), r"must be finite; entry \[0, 0\] is nan"),
    ("active", lambda v: v[:-1], r"must have the shape \(\d+,\), received"),
    ("active", lambda v: None, r"must have the shape \(\d+,\), received"),
    ("shading_offset", lambda v: "deep", "must be numbers"),
    ("shading_offset", lambda v: np.zeros(3), r"must have the shape \(\d+,\), received \(3,\)"),
]


@pytest.mark.parametrize(("name", "values", "message"), BROKEN)
def test_what_is_no_displacement_is_refused(face, name, values, message):
    layer = Dents(lambda found: replace(found, **{name: values(getattr(found, name))}))
    with pytest.raises(fw.errors.ParameterError, match=rf"the {name} of a layer \(Dents\) ({message})"):
        simulated(face, layer).step()


@pytest.mark.parametrize(("given", "received"), [(None, "a NoneType"), ("deep", "a str"), (np.zeros(3), "a ndarray")])
def test_what_is_returned_in_place_of_a_displacement_is_named(face, given, received):
    message = rf"displacement\(\) of a layer \(Dents\) must return a Displacement, received {received}\. Return"
    with pytest.raises(fw.errors.ParameterError, match=message):
        simulated(face, Dents(lambda found: given)).step()


def test_other_types_of_numbers_and_views_make_the_same_frame(face, fingerprint):
    def others(found):
        return replace(
            found,
            height=found.height.tolist(),
            spacing=np.repeat(found.spacing, 2)[::2],
            across=np.asfortranarray(found.across.astype(np.float32)),
            active=found.active.tolist(),
        )

    plain, other = simulated(face, Dents()), simulated(face, Dents(others))
    for _ in range(3):
        one, two = plain.step(), other.step()
        assert fingerprint(one) == fingerprint(two)
    assert one.n_points > len(face.points)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (lambda n: None, r"fields\(\) of a layer \(Dents\) must return a dictionary .*a NoneType. Return \{\} if"),
        (lambda n: [1], r"fields\(\) of a layer \(Dents\) must return a dictionary .*received a list"),
        (lambda n: {"a": "x"}, r"the field 'a' of a layer \(Dents\) must have a number, or a row of numbers, for each"),
        (lambda n: {"a/b": None}, r"the field 'a/b' .* received object of the shape \(\)"),
        (lambda n: {"a": np.zeros(n - 1)}, r"for each of the \d+ vertices, received float64 of the shape \(\d+,\)"),
        (lambda n: {"a": np.zeros((n, 0))}, "the field 'a'"),
        (lambda n: {"a": np.zeros((n, 3, 3))}, "the field 'a'"),
        (lambda n: {"a": np.zeros(n, complex)}, "received complex128"),
        (lambda n: {"a": np.full(n, "x")}, "the field 'a'"),
        (lambda n: {"rest": np.zeros(n)}, r"the field 'rest' .* must have three numbers for each"),
        (lambda n: {"Normals": np.zeros(n)}, r"the field 'Normals' .* must have three numbers for each"),
        (lambda n: {"epsilon": np.zeros((n, 2))}, r"the field 'epsilon' .* must have a number for each"),
    ],
)
def test_what_are_no_fields_is_refused(face, fields, message):
    with pytest.raises(fw.errors.ParameterError, match=message):
        simulated(face, Dents(fields=fields)).step()


def test_fields_are_not_written_to(face):
    kept = {}

    def own(n):
        kept.setdefault("epsilon", np.full(n, 0.25))
        return kept

    layers = [fw.MuscleWrinkles(), Dents(lambda f: replace(f, active=np.zeros_like(f.active)), own)]
    simulation = fw.Simulation(face, fw.Refinement(max_level=0), layers=layers)
    simulation.step()
    given = kept["epsilon"]
    simulation.step()
    assert kept["epsilon"] is given
    assert (given == 0.25).all()


def test_a_layer_that_lacks_a_method_is_refused_when_it_is_made():
    class Half(Layer):
        def attach(self, face):
            pass

        def follow(self, change, created):
            pass

        def displacement(self, state):
            pass

    with pytest.raises(TypeError, match="abstract class Half .*fields"):
        Half()


def test_layers_show_their_settings():
    assert repr(fw.MuscleWrinkles(0.5)) == "MuscleWrinkles(depth=0.5, inextensible=True, waves=True)"
    assert all(repr(layer).startswith(type(layer).__name__) and len(repr(layer)) < 200 for layer in LAYERS)


LAYERS = [fw.WaveFolds(seed=3), fw.Creases(), fw.PrintedWrinkles(), fw.PatternLayer("dimple", (0, 0, 0), size=3.0)]
