"""Animations of one mesh.

what                     checked against
principal targets        the displacements that went in; their rank; fewer targets for a larger error
files                    our own reader: every frame within the error that was asked for
vertices that come later the middle of their parents
point caches             the frames, byte by byte
"""

import struct
from functools import cache

import numpy as np
import pytest
from command_files import in_usd
from glb_files import read_glb
from hypothesis import given, settings
from hypothesis import strategies as st
from small_meshes import signed_distances

import facewrinkle as fw
from facewrinkle.errors import FaceWrinkleWarning, MeshError, OutputError, ParameterError
from facewrinkle.export.animation import AnimationWriter, _grown, increments, principal_targets
from facewrinkle.tears.drop import Sampled

FRAMES = 12


@pytest.fixture(scope="module")
def take(face):
    """Frames of a surprise on triangles that only become finer, and the simulation."""
    simulation = fw.Simulation(face, fw.Refinement(max_level=1, coarsen=False))
    simulation.express("paper_surprise")
    frames = list(simulation.run(FRAMES))
    assert frames[0].n_points < frames[-1].n_points
    return frames, simulation


@pytest.fixture(scope="module")
def written(face, take, tmp_path_factory):
    """The animation in files of some endings, within some errors: the writer, and the files."""

    @cache
    def written(ending, error=0.1):
        frames, simulation = take
        writer = AnimationWriter(face, tmp_path_factory.mktemp("take") / f"take.{ending}", error)
        for frame in frames:
            writer.add(frame)
        return writer, writer.write(0.02 * (1 + np.arange(FRAMES)), simulation.forest)

    return written


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(0.01, 1.0))
def test_targets_are_within_the_error(seed, rank, allowed):
    random = np.random.default_rng(seed)
    ways = np.tensordot(random.normal(size=(15, rank)), random.normal(size=(rank, 40, 3)), axes=1).astype(np.float32)
    weights, targets = principal_targets(ways, allowed)
    assert len(targets) <= rank
    assert np.abs(weights).max() <= 1.0 + 1e-6
    left = np.tensordot(weights, targets, axes=1) - ways
    assert np.linalg.norm(left, axis=2).max() <= allowed * 1.001
    assert len(principal_targets(ways, 3.0 * allowed)[1]) <= len(targets)


def test_frames_without_motion_need_no_target():
    weights, targets = principal_targets(np.zeros((4, 10, 3), np.float32), 0.1)
    assert weights.shape == (4, 0)
    assert targets.shape == (0, 10, 3)


@pytest.mark.parametrize("error", [0.05, 0.5])
def test_the_file_is_as_close_as_was_asked_for(face, take, written, error):
    frames, simulation = take
    writer, (path,) = written("glb", error)
    assert 0 < writer.targets <= FRAMES
    rest, recorded = fw.read_animation(path, mesh="face")
    unit, skin = 1000.0 / face.unit, np.asarray(rest.points)[: recorded.n_points]  # glTF is in meters
    for number, frame in enumerate(frames):
        moved = unit * recorded.positions_at(0.02 * (1 + number), skin)
        n = len(face.points)
        assert np.linalg.norm(moved[:n] - frame.points[:n], axis=1).max() * face.unit <= error + 1e-3
    assert len(skin) >= simulation.forest.n_points - 5  # without those that seams leave unused


def test_a_written_animation_can_be_played(face, written):
    """The lining of the mouth shares its rim with the lips, and is no part of the skin when the file is read again."""
    _, (path,) = written("glb", 0.05)
    rest, recorded = fw.read_animation(path)  # without a word: one of the meshes is called face
    places = {name: place * face.unit / 1000.0 for name, place in face.landmarks.items()}
    with pytest.warns(FaceWrinkleWarning, match="separate parts"):
        again = fw.fit_face(rest, places)
    assert len(again.points) == len(again.source_points) <= recorded.n_points
    assert again.source_points.max() < recorded.n_points
    np.testing.assert_array_equal(recorded.points_of(again), again.source_points)


def test_a_larger_error_needs_fewer_targets(written):
    assert written("glb", 0.5)[0].targets < written("glb", 0.05)[0].targets


def test_earlier_frames_lie_on_their_own_triangles(take):
    frames, simulation = take
    grown = _grown(np.asarray(frames[0].points, np.float32), simulation.forest)
    np.testing.assert_array_equal(grown[: frames[0].n_points], np.asarray(frames[0].points, np.float32))
    parents = simulation.forest.parents
    later = np.arange(frames[0].n_points, len(grown))
    np.testing.assert_allclose(grown[later], 0.5 * (grown[parents[later, 0]] + grown[parents[later, 1]]), rtol=1e-6)


def test_a_point_cache_holds_the_frames(take, written):
    frames, simulation = take
    _, (path, mesh) = written("pc2")
    data = path.read_bytes()
    signature, version, points, start, rate, samples = struct.unpack_from("<12siiffi", data)
    assert (signature, version, start, rate) == (b"POINTCACHE2\0", 1, 0.0, 1.0)
    assert (points, samples) == (simulation.forest.n_points, FRAMES)
    cached = np.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)
    np.testing.assert_array_equal(cached[-1], np.asarray(frames[-1].points, np.float32))
    np.testing.assert_array_equal(cached[0][: frames[0].n_points], np.asarray(frames[0].points, np.float32))
    assert mesh.name == "take.obj"
    assert sum(line.startswith("v ") for line in mesh.read_text().splitlines()) == points


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 1.0))
def test_sums_of_increments_are_within_the_error(seed, least):
    values = np.cumsum(np.random.default_rng(seed).normal(scale=0.2, size=(12, 7, 3)), axis=0)
    sums = values[0] + np.cumsum(increments(values, least), axis=0)
    assert np.linalg.norm(sums - values, axis=2).max() <= least * 1.001


@pytest.mark.slow
def test_tears_are_meshes_of_their_own(face, take, tmp_path):
    """On the skin as targets show it: that is off by more than the water is thick."""
    pytest.importorskip("pxr")
    frames, simulation = take
    times = 0.02 * (1 + np.arange(FRAMES))
    tears = [fw.SheddingTear(face, start="l", begin=0.1), fw.DrippingTear(face, "r"), fw.DrippingTear(begin=9.0)]
    files = {}
    for ending in ("glb", "usdc", "pc2"):
        writer = AnimationWriter(face, tmp_path / f"take.{ending}")
        for frame in frames:
            writer.add(frame)
        files[ending] = writer.write(times, simulation.forest, tears)
    content, _ = read_glb(files["glb"][0])
    names = [mesh["name"] for mesh in content["meshes"]]
    assert names[-2:] == ["tears_1", "tears_2"]  # the third begins later
    assert content["materials"][-1]["alphaMode"] == "BLEND"
    samplers = {names[c["target"]["node"]]: c["sampler"] for c in content["animations"][0]["channels"]}
    assert len({samplers["face"], samplers["tears_1"], samplers["tears_2"]}) == 3
    assert samplers["eye_l"] == samplers["face"]
    for number, wet in ((0, False), (FRAMES - 1, True)):
        skin, water = (in_usd(files["usdc"][0], name, times[number]) for name in ("face", "tears_1"))
        depth = face.unit * signed_distances(water.points, skin)
        assert (depth.max() > 0.3) if wet else (depth.max() < -0.2)
    assert {path.name for path in files["pc2"]} >= {"take_tears_1.pc2", "take_tears_2.obj"}


class Standing:
    """Water that does not move."""

    def __init__(self, face):
        self.points = face.landmarks["subnasale"] + np.array([[0.0, 0.0, 5.0], [5.0, 0.0, 5.0], [0.0, 5.0, 5.0]])

    def sampled(self, times, frames):
        points, up = (np.tile(values, (len(frames), 1, 1)) for values in (self.points, [[0.0, 0.0, 1.0]] * 3))
        return Sampled(points, up, np.array([[0, 1, 2]], np.int32))


@pytest.mark.parametrize("count", [1, pytest.param(FRAMES, marks=pytest.mark.slow)])
def test_what_does_not_move_has_no_targets_and_no_channel(face, take, tmp_path, count):
    pytest.importorskip("pxr")
    frames, simulation = take
    times, water = 0.02 * (1 + np.arange(count)), Standing(face)
    for ending in ("glb", "usda"):
        writer = AnimationWriter(face, tmp_path / f"take.{ending}")
        for frame in frames[-count:]:
            writer.add(frame)
        path, *_ = writer.write(times, simulation.forest, [water])
        if ending == "usda":
            assert in_usd(path, "tears_1", times[-1]).n_cells == 1
            continue
        content, _ = read_glb(path)
        assert min(view["byteLength"] for view in content["bufferViews"]) > 0
        assert min(accessor["count"] for accessor in content["accessors"]) > 0
        meshes = {mesh["name"]: mesh for mesh in content["meshes"]}
        assert "targets" not in meshes["tears_1"]["primitives"][0]
        nodes = [channel["target"]["node"] for channel in content["animations"][0]["channels"]]
        moving = {list(meshes)[content["nodes"][node]["mesh"]] for node in nodes}
        assert moving == {name for name, mesh in meshes.items() if "targets" in mesh["primitives"][0]}
        assert "face" in moving


def test_what_cannot_be_written_is_refused(face, take, tmp_path):
    frames, simulation = take
    with pytest.raises(OutputError, match=r"must end in \.glb or \.gltf or \.pc2"):
        AnimationWriter(face, tmp_path / "take.abc")
    with pytest.raises(ParameterError, match="animation_error"):
        AnimationWriter(face, tmp_path / "take.glb", 0.0)
    writer = AnimationWriter(face, tmp_path / "take.glb")
    with pytest.raises(MeshError, match="at least one frame"):
        writer.write([], simulation.forest)
    writer.add(frames[-1])
    with pytest.raises(MeshError, match="only grows"):
        writer.add(frames[0])
