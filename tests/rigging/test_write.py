"""Rigs as files and pages.

what                        checked against
shapes and their names      our own reader, trimesh's accessors, and the arrays of the rig
the format                  Khronos' validator
what a viewer shows         three.js in a browser without a window: names, pixels, and the neutral face
a page of its own           what a browser without a window shows

Some need Node, see `judging`.
"""

import re

import numpy as np
import pytest
from glb_files import read_glb
from judging import judged, path_of_chromium, shot

import facewrinkle as fw
from facewrinkle.mesh.formats.gltf import Document


@pytest.fixture(scope="session")
def glb(rig, tmp_path_factory):
    return fw.write_rig(rig, tmp_path_factory.mktemp("rig") / "head.glb")


def test_our_reader_gets_back_what_was_written(rig, glb):
    document = Document(glb)
    world = document.world()
    nodes = {document.label(node): document.primitives(node, world)[0] for node in document.shown}
    assert list(nodes) == list(rig.parts)
    for name, primitive in nodes.items():
        ours = 0.001 * rig.face.unit * rig.morphs[name].deltas  # in meters
        size = np.ptp(primitive.points, axis=0).max()
        np.testing.assert_allclose(primitive.points, 0.001 * rig.face.unit * rig.parts[name].points, atol=1e-6 * size)
        np.testing.assert_allclose(np.asarray(primitive.shapes), ours, atol=1e-6 * size)


def test_every_mesh_names_its_shapes(rig, glb):
    content, _ = read_glb(glb)
    assert len(content["meshes"]) == len(rig.parts)
    for mesh in content["meshes"]:
        assert mesh["extras"]["targetNames"] == list(rig.names)
        assert mesh["weights"] == [0.0] * len(rig.names)
        (primitive,) = mesh["primitives"]
        assert len(primitive["targets"]) == len(rig.names)
        assert len({tuple(sorted(target)) for target in primitive["targets"]}) == 1
    assert set(content["meshes"][0]["primitives"][0]["targets"][0]) == {"POSITION", "NORMAL"}
    assert all(accessor.get("sparse", {"count": 1})["count"] > 0 for accessor in content["accessors"])


def test_dense_files_hold_the_same(rig, glb, tmp_path):
    dense = fw.write_rig(rig, tmp_path / "head.glb", dense=True)
    text = fw.write_rig(rig, tmp_path / "head.gltf")
    assert dense.stat().st_size > 1.5 * glb.stat().st_size
    assert not any("sparse" in accessor for accessor in read_glb(dense)[0]["accessors"])
    shapes = []
    for path in (glb, dense, text):
        document = Document(path)
        world = document.world()
        shapes.append([np.asarray(document.primitives(node, world)[0].shapes) for node in document.shown])
    for one, *others in zip(*shapes, strict=True):
        for other in others:
            np.testing.assert_array_equal(one, other)


def test_the_file_plays_in_this_package(rig, glb):
    rest, recorded = fw.read_animation(glb, mesh="face", shapes={"jawOpen": 1.0, "browInnerUp": 0.5})
    assert recorded.names == rig.names
    assert recorded.action_units(1.0) == {"AU27": 1.0, "AU1": 0.5}
    moved = recorded.positions_at(1.0, np.asarray(rest.points)[: recorded.n_points])
    expected = rig.at({"jawOpen": 1.0, "browInnerUp": 0.5}).points
    assert np.ptp(moved, axis=0).max() == pytest.approx(0.001 * np.ptp(expected, axis=0).max(), rel=0.01)


def test_trimesh_sees_the_same_points(rig, glb):
    scene = pytest.importorskip("trimesh").load(glb, process=False)
    lengths = {len(geometry.vertices) for geometry in scene.geometry.values()}
    assert lengths == {len(model.points) for model in rig.parts.values()}
    skin = max(scene.geometry.values(), key=lambda geometry: len(geometry.faces) * geometry.area)
    np.testing.assert_allclose(skin.vertices, rig.parts["face"].points, atol=1e-4)


def test_unwritable_targets_are_refused(smooth_rig, tmp_path):
    with pytest.raises(fw.errors.OutputError, match=r"must end in \.glb or \.gltf"):
        fw.write_rig(smooth_rig, tmp_path / "head.fbx")
    (tmp_path / "file").write_text("")
    with pytest.raises(fw.errors.OutputError):
        fw.write_rig(smooth_rig, tmp_path / "file" / "head.glb")


@pytest.mark.parametrize("dense", [False, True], ids=["sparse", "dense"])
def test_the_validator_of_khronos_has_no_complaints(rig, tmp_path, dense):
    issues = judged("validate.mjs", str(fw.write_rig(rig, tmp_path / "head.glb", dense=dense)))
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


def test_every_shape_is_seen_in_three(rig, glb):
    found = judged("three.mjs", path_of_chromium(), str(glb))
    assert found["names"] == list(rig.names)
    assert found["same"]
    assert found["meshes"] == len(rig.parts)
    assert min(found["changed"].values()) > 20, found["changed"]
    assert found["back"] == 0


# --- pages ------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_page_needs_nothing_but_itself(smooth_rig, tmp_path):
    text = fw.rigging.write_page(smooth_rig, tmp_path / "<A & B>.html").read_text(encoding="utf-8")
    assert "<title>&lt;A &amp; B&gt;</title>" in text
    assert "{{" not in text
    assert not re.search(r"(src|href)\s*=|https?:", text)
    used = re.findall(r'from \\"\./(\w+\.js)', text)
    assert used
    assert all(f'"{name}": ' in text for name in used)
    with pytest.raises(fw.errors.OutputError, match=r"must end in \.html"):
        fw.rigging.write_page(smooth_rig, tmp_path / "head.htm")


@pytest.mark.slow
def test_the_page_shows_the_face_and_its_shapes(smooth_rig, tmp_path):
    path = fw.rigging.write_page(smooth_rig, tmp_path / "head.html")
    rest, again = (shot(path, tmp_path / f"{k}.png") for k in range(2))
    opened = shot(path, tmp_path / "2.png", "#jawOpen=1&browInnerUp=1")
    np.testing.assert_array_equal(rest, again)
    assert rest.std() > 20.0  # a face before the background
    assert rest[445:453, 260:272].mean() < 0.65 * rest[445:453, 180:192].mean()  # the throat, in the shadow of the chin
    assert 0.01 < (np.abs(rest - opened).max(axis=2) > 10.0).mean() < 0.5
