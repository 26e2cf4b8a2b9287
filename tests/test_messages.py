"""What formulas say about numbers they cannot use (parameter, allowed, received), and the line that warnings name."""

import math
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.anatomy.muscles import (
    Crease,
    LinearMuscle,
    SheetMuscle,
    SphincterMuscle,
    TongueMuscle,
    TriangularMuscle,
    Wrinkles,
)
from facewrinkle.geometry import equations
from facewrinkle.geometry.least_squares import moving_least_squares
from facewrinkle.layers import patterns

LINES = ([(-10, 40, 0), (10, 40, 0)], [(-10, 0, 0), (10, 0, 0)])


def linear(insertion=(0, 5, 0), angle=0.5, radius=6.0, **words):
    return LinearMuscle((0, 0, 0), insertion, angle, radius, **words)


def crease(width=9.0, **words):
    return Crease([(0, 40, 0), (6, 18, 0), (0, 0, 0)], (1, 0, 0), width, **words)


def ring(centre=(0, 0, 0), a=40.0, b=30.0, normal=(0, 0, 1), lateral=(1, 0, 0), **words):
    return SphincterMuscle(centre, a, b, normal, lateral, **words)


def fitted(x=((0.0,),), points=((0.0,), (1.0,)), values=(1.0, 2.0), **words):
    return moving_least_squares(x, points, values, **words)


UNIT, NEVER_1 = "in [0, 1]", "in [0, 1"
CASES = [  # call, what the message begins with, what is allowed, what was received
    (lambda: Wrinkles(count=0), "the number of wrinkles", "in [1, 1e+09]", "0"),
    (lambda: Wrinkles(count=10**9 + 1), "the number of wrinkles", "in [1, 1e+09]", "1e+09"),
    (lambda: Wrinkles(count=1.5), "the number of wrinkles", "whole number", "1.5"),
    (lambda: Wrinkles(start=1.0), "lambda_w", NEVER_1, "1"),
    (lambda: Wrinkles(start=-0.1), "lambda_w", NEVER_1, "-0.1"),
    (lambda: Wrinkles(depth=-1.0), "depth", "in [0, 1e+06]", "-1"),
    (lambda: Wrinkles(depth=1e6 + 0.5), "depth", "in [0, 1e+06]", "1e+06"),
    (lambda: Wrinkles(core=1.1), "core", UNIT, "1.1"),
    (lambda: Wrinkles(taper=2.5), "taper", "in [0, 2]", "2.5"),
    (lambda: Wrinkles(taper=-0.5), "taper", "in [0, 2]", "-0.5"),
    (lambda: Wrinkles(alpha=-0.5), "alpha", "in [0, 100]", "-0.5"),
    (lambda: Wrinkles(alpha=100.5), "alpha", "in [0, 100]", "100.5"),
    (lambda: equations.bulge_height(1.0, -1.5), "alpha", "in [-1, 100]", "-1.5"),
    (lambda: Wrinkles(ends="loose"), "ends", "one of continuous, paper,", "'loose'"),
    (lambda: Wrinkles(falloff="hard"), "falloff", "one of paper, smoothstep,", "'hard'"),
    (lambda: Wrinkles(fronts="bent"), "fronts", "one of straight, round,", "'bent'"),
    (lambda: equations.shape(0.0, -2.0), "the half cycle u", "positive", "-2.0"),
    (lambda: linear(strength=-1.0), "strength", "in [0, 1e+06]", "-1"),
    (lambda: linear(strength=1e6 + 0.5), "strength", "in [0, 1e+06]", "1e+06"),
    (lambda: linear(normal_share=1.5), "normal_share", UNIT, "1.5"),
    (lambda: linear(insertion=(0, 5)), "insertion", "three finite numbers", "(0, 5)"),
    (lambda: linear(angle=2.0), "max_angle", "(0, pi/2) radians", "2.0"),
    (lambda: linear(radius=4.9), "radius", "at least the distance from attachment to insertion (5)", "4.9"),
    (lambda: linear().force([[1.0, 2.0]]), "points", "the shape (n, 3)", "(1, 2)"),
    (
        lambda: SheetMuscle([*LINES[0], (0, 0, 0)], LINES[1]),
        "attachment",
        "a pair of points",
        "an array of shape (3, 3)",
    ),
    (lambda: SheetMuscle(*LINES, length=-3.0), "length", "at least 0", "-3"),
    (lambda: SheetMuscle(*LINES, width=-3.0), "width", "at least 0", "-3"),
    (lambda: SheetMuscle(*LINES, normal_share=-0.5), "normal_share", UNIT, "-0.5"),
    (lambda: linear(radius=math.inf), "radius", "a finite number greater than 0", "inf"),
    (lambda: SheetMuscle(*LINES, length=math.inf), "length", "a finite length", "inf"),
    (lambda: SheetMuscle(*LINES, width=math.inf), "width", "a finite length", "inf"),
    (lambda: SheetMuscle(*LINES, thickness=math.inf), "thickness", "a finite length", "inf"),
    (lambda: TriangularMuscle(*LINES, insertion_width=math.inf), "insertion_width", "a finite length", "inf"),
    (lambda: ring(a=math.inf), "semi_major", "a finite number greater than 0", "inf"),
    (lambda: ring(b=-1.0, thickness=1.0), "semi_minor", "a finite number greater than 0", "-1"),
    (lambda: ring(thickness=math.inf), "thickness", "a finite length", "inf"),
    (lambda: ring(protrusion=math.inf), "protrusion", "in [-1e+06, 1e+06]", "inf"),
    (lambda: crease(width=math.inf), "width", "a finite number greater than 0", "inf"),
    (lambda: crease(thickness=math.inf), "thickness", "a finite length", "inf"),
    (lambda: fw.errors.check_positive("x", np.array([1.0, 2.0])), "x", "a number", "array([1., 2.])"),
    (lambda: fw.errors.check_positive("x", math.nan), "x", "a finite number greater than 0", "nan"),
    (lambda: fw.errors.check_whole("n", math.inf, 0, math.inf), "n", "a whole number", "inf"),
    (lambda: ring(centre=(0, math.inf, 0)), "centre", "three finite numbers", "(0, inf, 0)"),
    (lambda: ring(normal=(0, 1)), "normal", "three finite numbers", "(0, 1)"),
    (lambda: ring(lateral="x"), "lateral", "three finite numbers", "'x'"),
    (lambda: ring(vertical=(0, 1)), "vertical", "three finite numbers", "(0, 1)"),
    (lambda: ring(inner=1.0), "inner", NEVER_1, "1"),
    (lambda: ring(inner=-0.1), "inner", NEVER_1, "-0.1"),
    (lambda: ring(dead_zone=1.0), "dead_zone", NEVER_1, "1"),
    (lambda: ring(beta1=3.2), "beta1", "in [0, 3.14159]", "3.2"),
    (lambda: ring(beta2=-0.1), "beta2", "in [0, 3.14159]", "-0.1"),
    (lambda: ring(strength=-1.0), "strength", "in [0, 1e+06]", "-1"),
    (lambda: patterns.dimple(0.0, 0.0, -1.0), "t", "a finite number greater than 0", "-1"),
    (lambda: patterns.dimple_time(10.5, 0.1), "strength", "in [0, 10]", "10.5"),
    (lambda: patterns.dimple_time(-0.5, 0.1), "strength", "in [0, 10]", "-0.5"),
    (lambda: patterns.eye_pouch(0.0, 0.0, 0.001, 1, 1, 2), "t", "at least 0.01", "0.001"),
    (lambda: patterns.eye_pouch(0.0, 0.0, 1.0, 1, 1, 65), "gamma", "in [0, 64]", "65"),
    (lambda: patterns.eye_pouch(0.0, 0.0, 1.0, 1, 1, -1), "gamma", "in [0, 64]", "-1"),
    (lambda: patterns.eye_pouch(0.0, 0.0, 1.0, 1, 1, 2.5), "gamma", "whole number", "2.5"),
    (lambda: patterns.frown([0.0, 1.0], [-1.0, 1.0], 0.25, 1, 1, "fan"), "y + t", "above 0 all over", "-0.75"),
    (lambda: patterns.eye_corner([-1.0, 1.0], [0.0, 0.0], 1, 1, 1, 3), "gamma", "an even number", "3"),
    (lambda: fitted(degree=9), "degree", "in [0, 8]", "9"),
    (lambda: fitted(degree=-1), "degree", "in [0, 8]", "-1"),
    (lambda: fitted(degree=1.5), "degree", "whole number", "1.5"),
    (lambda: fitted(epsilon=-1.0), "epsilon", "in [0, 1e+50]", "-1"),
    (lambda: fitted(values=(1.0,)), "x", "(q, d), points (n, d) and values (n,)", "(1, 1), (2, 1), (1,)"),
    (lambda: fitted(points=((0.0, 1.0),), values=(1.0,)), "x", "(q, d), points (n, d) and", "(1, 1), (1, 2), (1,)"),
]


@pytest.mark.parametrize(("call", "name", "allowed", "received"), CASES)
def test_messages_name_the_parameter_the_range_and_the_value(call, name, allowed, received):
    with pytest.raises(fw.FaceWrinkleError) as caught:
        call()
    message = str(caught.value)
    assert message.startswith(f"{name} must ")
    assert allowed in message[: message.index(", received ") + 1]
    told = message[message.index(", received ") + len(", received ") :]
    assert told.startswith(received)
    assert told[len(received)] in ".:"
    assert message.endswith(".")


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: linear(insertion=(0, 0, 0)), "attachment and insertion coincide"),
        (lambda: SheetMuscle(LINES[0], LINES[0]), "a sheet muscle needs"),
        (lambda: SheetMuscle([(0, 40, 0), (0, 60, 0)], LINES[1]), "the attachment line runs along the fibers"),
        (lambda: ring(lateral=(0, 0, 2)), "normal and lateral must be"),
        (lambda: ring(lateral=(0, 0, 0)), "normal and lateral must be"),
        (lambda: ring(beta1=0.0, beta2=0.0), "beta1 + beta2 must be"),
        (lambda: patterns.cheek([np.inf], [0.0], 1, 1, 1), "x and y must be finite; NaN"),
        (lambda: patterns.frown(0.0, 0.0, 1.0, 1.0, 0.0), "beta must not be 0"),
        (lambda: patterns.frown(0.0, 0.0, 1.0, 1.0, 1.0, "fen"), "unknown variant of frown 'fen'"),
        (lambda: fitted(x=((np.nan,),)), "x, points and values must be finite"),
        (lambda: fitted(points=np.empty((0, 1)), values=[]), "x, points and values must be finite"),
        (lambda: linear().replaced(dept=1), "unknown property of a muscle 'dept'"),
        (lambda: linear().replaced(k0=9), "unknown property of a muscle 'k0'. The k0 of the paper is called 'depth'"),
        (lambda: linear().replaced(n_w=9), "unknown property of a muscle 'n_w'. The n_w of the paper is called 'c"),
        (lambda: linear().replaced(lambda_w=0.4), "unknown property of a muscle 'lambda_w'. The lambda_w of the pape"),
        (lambda: linear().replaced(Ls=4.0), "unknown property of a muscle 'Ls'"),
        (lambda: crease().replaced(count=8), "a Crease has no count: it folds one line along its path"),
        (lambda: crease(wrinkles=Wrinkles(start=0.7)), "a Crease has no start: it folds one line along its path"),
        (lambda: linear(folds=crease()).replaced(start=0.7), "a Crease has no start: it folds one line along its path"),
        (lambda: ring().replaced(start=0.7), "a SphincterMuscle has no start: its folds are radial"),
        (lambda: SheetMuscle(*LINES).replaced(fronts="round"), "a SheetMuscle has no fronts: its folds run straight"),
        (lambda: TongueMuscle().replaced(depth=1.0), "a TongueMuscle has no depth: it does not fold the skin"),
        (lambda: linear(wrinkles=Wrinkles(count=8), folds=crease()), "the wrinkles of a muscle with folds are those"),
    ],
)
def test_messages_say_what_does_not_go_together(call, says):
    with pytest.raises(fw.FaceWrinkleError) as caught:
        call()
    assert str(caught.value).startswith(says)
    assert str(caught.value)[-1] in ".?"


def test_the_ends_of_the_ranges_are_allowed():
    assert equations.half_cycle(2e9, 0.0, 10**9) == 1.0
    style = Wrinkles(count=1, start=0.0, depth=1e6, alpha=0.0, core=1.0, taper=1.0)
    assert Wrinkles(depth=0.0, core=0.0, taper=0.0, alpha=100.0).depth == 0.0
    muscle = linear(radius=5.0, strength=1e6, normal_share=0.0, wrinkles=style)
    assert linear(strength=0.0, normal_share=1.0).strength == 0.0
    assert muscle.half_wavelength == 2.5
    assert ring(inner=0.0, dead_zone=0.0, beta1=math.pi, beta2=math.pi).half_wavelength > 0.0
    assert ring(beta1=0.0).beta1 == ring(beta2=0.0).beta2 == 0.0
    assert patterns.dimple_time(10.0, 1.0) == pytest.approx(1.0 / 1023.0, rel=1e-12)
    assert patterns.eye_pouch(3.0, 4.0, 0.01, 1, 1, 0) == pytest.approx(100.0)
    assert patterns.eye_pouch(0.0, 0.0, 0.5, 0, 0, 64) == 2.0**65
    assert fitted(degree=0, epsilon=1e50).tolist() == [1.5]


WARNED = {
    "several parts": lambda face: fw.surface(face.mesh + pv.Sphere(radius=5.0, center=(300.0, 0.0, 0.0))),
    "unknown landmark": lambda face: fw.fit_face(face.mesh, {**face.landmarks, "root": face.landmarks["nasion"]}),
    "odd units": lambda face: fw.fit_face(face.mesh, face.landmarks, units=3.0),
    "few points": lambda face: fitted([(0.3, 0.6)], [(0, 0), (1, 1), (2, 2)], [0.0, 1.0, 2.0], degree=2),
}


@pytest.mark.parametrize("call", WARNED.values(), ids=WARNED)
def test_warnings_name_the_line_that_called(face, call):
    with pytest.warns(fw.FaceWrinkleWarning) as told:
        call(face)
    assert {Path(warning.filename).name for warning in told} == {Path(__file__).name}
