"""The process that compiles what a command needs later: when it starts, and that it compiles something."""

from __future__ import annotations

import os
from types import SimpleNamespace

import pytest
from numba.core import event

from facewrinkle.appearance import _hair_kernels
from facewrinkle.commands import compiling
from facewrinkle.geometry import _mesh_kernels
from facewrinkle.geometry.compilation import njit
from facewrinkle.plotting import _pixel_kernels


def compiled(count, module):
    """Compile functions of a module."""
    for number in range(count):

        def function(x, number=number):
            return x + number

        function.__module__ = module
        assert njit()(function)(1, number) == 1 + number


@pytest.fixture
def started(monkeypatch):
    """The commands of processes that would have been started, and the listeners that stay no longer than a test."""
    commands, before = [], list(event._registered["numba:compile"])

    def begun(command, **_):
        commands.append(command)
        return SimpleNamespace(kill=lambda: None)

    monkeypatch.setattr(compiling, "subprocess", SimpleNamespace(DEVNULL=-3, Popen=begun))
    monkeypatch.setattr(compiling, "allowed", True)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    yield commands
    event._registered["numba:compile"][:] = before


def test_the_process_starts_once_where_much_has_to_be_compiled(started):
    compiling.begin()
    compiled(compiling.ENOUGH - 1, "facewrinkle.tests")
    compiled(2, "others.tests")
    assert started == []
    compiled(4, "facewrinkle.tests")
    ((_, *rest),) = started
    assert rest == ["-m", "facewrinkle.commands.compiling"]


@pytest.mark.parametrize("cores, allowed", [(1, True), (2, False)])
def test_no_process_starts_without_a_core_for_it_or_in_a_process_of_others(started, monkeypatch, cores, allowed):
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    monkeypatch.setattr(compiling, "allowed", allowed)
    compiling.begin()
    compiled(compiling.ENOUGH + 1, "facewrinkle.tests")
    assert started == []


def test_what_draws_a_face_is_compiled_by_it():
    compiling.compile_ahead()
    for kernel in (_hair_kernels.ribbons, _pixel_kernels.halved_over, _mesh_kernels.mark_triangles):
        assert kernel.signatures, kernel.__name__
