"""A frame of the skin against a general physics engine: vertex block descent of Newton, on the processor.

Both have the same vertices, masses, springs, tethers and forces; the skin does without bending, stiffening and tissue
that bulges here, as the peer does. Where lips press, it has all of them: without, they enter each other. A tether is
stiffer along the normal: there, it is a spring of no length and a spring to an anchor far below. Newton needs five
substeps a frame, or springs that are pressed together explode, and some damping.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import replace

import numpy as np
import pytest

import facewrinkle as fw
from tools.trials.oracle import Oracle

newton = pytest.importorskip("newton", reason="pip install newton")
wp = pytest.importorskip("warp")

SUBSTEPS, ITERATIONS, DAMPING, FAR = 5, 10, 0.005, 1000.0
"""Per frame, per substep, of the springs (s), and how far below the skin the anchors of the normals are (mm)."""

MARGIN = 0.1
"""Distance at which the peer's skin meets itself, mm."""

MATERIAL = fw.SkinMaterial(bending=1e-6, stiffening=0.0)


class Peer:
    """The springs and tethers of a skin in Newton; with `contact`, its triangles keep off each other."""

    def __init__(self, skin, contact=False):
        wp.config.quiet = True
        points = self.points = skin.points
        n = self.n = len(points)
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        below = points - FAR * skin._normals
        for at, mass in zip(np.concatenate([points, points, below]), np.r_[skin._mass, np.zeros(2 * n)], strict=True):
            builder.add_particle(wp.vec3(*at), wp.vec3(0.0, 0.0, 0.0), float(mass))
        each = np.arange(n)
        pairs = np.concatenate([skin._edges, np.c_[each, each + n], np.c_[each, each + 2 * n]])
        stiffness = np.r_[skin._stiffness, skin._along, skin._across]
        lengths = np.r_[skin._length, np.zeros(n), np.full(n, FAR)]
        for (i, j), k, length in zip(pairs.tolist(), stiffness.tolist(), lengths.tolist(), strict=True):
            builder.add_spring(i, j, k, DAMPING * k, 0.0)
            builder.spring_rest_length[-1] = length
        near = {}
        if contact:
            none = [0.0] * len(skin._triangles)
            builder.add_triangles(
                *skin._triangles.T.tolist(), tri_ke=none, tri_ka=none, tri_kd=none, tri_drag=none, tri_lift=none
            )
            near = {
                "particle_enable_self_contact": True,
                "particle_self_contact_margin": MARGIN,
                "particle_self_contact_gap": MARGIN,
                "particle_rest_shape_contact_exclusion_radius": 1.01 * MARGIN,
            }
        builder.color()
        self.model = builder.finalize(device="cpu")
        self.model.soft_contact_ke, self.model.soft_contact_kd, self.model.soft_contact_mu = 10.0, 0.0, 0.0
        self.solver = newton.solvers.SolverVBD(self.model, iterations=ITERATIONS, **near)
        self.time_step = skin.time_step / SUBSTEPS
        force = np.concatenate([skin._force, np.zeros((2 * n, 3))]).astype(np.float32)
        self.force = wp.array(force, dtype=wp.vec3, device="cpu")
        self.now, self.next, self.control = self.model.state(), self.model.state(), self.model.control()

    def step(self):
        for _ in range(SUBSTEPS):
            self.now.particle_f = self.next.particle_f = self.force
            self.solver.step(self.now, self.next, self.control, None, self.time_step)
            self.now, self.next = self.next, self.now

    @property
    def displacement(self):
        return self.now.particle_q.numpy()[: self.n] - self.points


def flat(face):
    """The face with tissue that keeps no volume."""
    return replace(face, tissue=replace(face.tissue, bulge=np.zeros(len(face.points))))


def pulled(rates, face, material=None):
    """A skin at rest that these contraction rates pull, and peers of it."""
    skin = fw.Skin(face, material=material)
    skin.contract(rates)
    skin.step()  # now it has forces
    peers = Peer(skin), Peer(skin, contact=True)
    skin.reset()
    skin.contract(rates)
    return skin, *peers


def test_springs(versus):
    """A smile of a fifth: 60 frames from rest, and those that follow."""
    rates = {"zygomaticus_major_l": 0.2, "zygomaticus_major_r": 0.2}
    skin, peer, _ = pulled(rates, flat(fw.default_face()), MATERIAL)
    for _ in range(60):
        skin.step()
        peer.step()
    apart = np.linalg.norm(skin.displacement - peer.displacement)
    assert apart < 0.1 * np.linalg.norm(skin.displacement), "both are the same skin"
    versus("skin step, 2321 vertices; Newton's VBD", skin.step, peer.step)


def test_contact(benchmark, results):
    """Pressed lips (AU24), 30 frames from rest: seconds a frame, and how deep the lips are in each other then."""
    face = fw.default_face()
    oracle, seconds = Oracle(face), []
    skin, _, peer = pulled(face.atlas.contractions("AU24", 1.0), face)

    def beside():
        begin = time.perf_counter()
        peer.step()
        seconds.append(time.perf_counter() - begin)

    benchmark.group = "pressed lips"
    benchmark.pedantic(skin.step, setup=beside, rounds=30)
    depths = [oracle.findings(oracle.rest + each.displacement).lips for each in (skin, peer)]
    assert depths[0] < 0.1, "lips stay off each other, mm"
    if not benchmark.disabled:
        times = statistics.median(benchmark.stats.stats.data), statistics.median(seconds)
        value = f"{times[1] / times[0]:.1f}x as fast; lips {depths[0]:.2f}, {depths[1]:.2f} mm deep"
        results.record("pressed lips, 2321 vertices; Newton's VBD", *times, value)
