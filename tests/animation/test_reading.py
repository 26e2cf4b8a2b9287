"""Time series as animations; glTF is in test_gltf.py.

what                     checked against
a series that we wrote   the frames that went into it, times and all; the face that it is played on
what cannot be played    the errors that name it
"""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw

TIMES = [0.1, 0.3, 0.4, 0.9]


def test_a_series_is_played_back(face, tmp_path):
    sim = fw.Simulation(face, fw.Refinement(max_level=0), layers=[])
    sim.express("frowning")
    frames = list(sim.run(4))
    path = fw.write_series([fw.Simulation(face, layers=[]).step(), *frames], [0.0, *TIMES], tmp_path / "frown.vtkhdf")
    mesh, recorded = fw.read_animation(path)
    assert np.array_equal(mesh.points, face.points)
    assert np.array_equal(mesh.regular_faces, face.triangles)
    assert recorded.track.times.tolist() == [0.0, *TIMES]
    for time, frame in zip(TIMES, frames, strict=True):
        np.testing.assert_allclose(
            recorded.positions_at(recorded.recorded_time(time), face.points), frame.points, atol=1e-12
        )
    halfway = 0.5 * (frames[0].points + frames[1].points)
    np.testing.assert_allclose(recorded.positions_at(recorded.recorded_time(0.2), face.points), halfway, atol=1e-12)
    # On the face itself, with the wrinkles that the series was written without.
    *_, top = fw.Simulation(face, motion=recorded, time_step=0.3).run(40)
    assert np.ptp(top["W"]) > 0.2
    assert top.n_points > face.mesh.n_points


def refined(face, path, first=0, layers=None):
    """Writes a surprise, refined and wrinkled, from a step on; returns the positions of the skin under it."""
    sim, bare = fw.Simulation(face, layers=layers), []
    sim.express("paper_surprise")

    def frames():
        for step, frame in enumerate(sim.run(10, ramp=0.8)):
            if step >= first:
                bare.append((sim.skin.points + sim.skin.displacement) / face.unit)
                yield frame

    fw.write_series(frames(), 0.02 * np.arange(1, 11 - first), path)
    return np.array(bare), sim


@pytest.mark.parametrize("unit", [pytest.param(1.0, marks=pytest.mark.slow), 10.0])
def test_a_refined_series_is_played_without_its_wrinkles(face, tmp_path, unit):
    mesh = face.mesh.copy()
    mesh.points = face.points / unit
    corners = np.asarray(mesh.active_texture_coordinates, float)[mesh.regular_faces]
    corners[:60] += 0.25
    mesh.cell_data["Texture Corners"] = corners.reshape(-1, 6)
    own = fw.fit_face(mesh, {name: point / unit for name, point in face.landmarks.items()}, units=unit)
    bare, sim = refined(own, tmp_path / "surprise.vtkhdf")
    assert sim.forest.n_points > own.mesh.n_points + 500
    mesh, recorded = fw.read_animation(tmp_path / "surprise.vtkhdf")
    np.testing.assert_array_equal(mesh.points, own.points)
    np.testing.assert_array_equal(mesh.regular_faces, own.triangles)
    np.testing.assert_allclose(recorded.track.values, bare, rtol=0, atol=1e-9 / unit)
    np.testing.assert_array_equal(mesh.cell_data["Texture Corners"], corners.reshape(-1, 6))
    np.testing.assert_array_equal(mesh["Colors"], own.mesh["Colors"])
    assert not {"W", "rest", "level", "epsilon"} & set(mesh.point_data)


def test_refined_series_that_do_not_tell_the_face_are_refused(face, tmp_path):
    refined(face, tmp_path / "late.vtkhdf", first=8)
    with pytest.raises(fw.errors.MeshError, match="refined in all 2 frames.*first frame"):
        fw.read_animation(tmp_path / "late.vtkhdf")


def test_a_series_of_any_surface(tmp_path):
    waves = [pv.Plane(i_resolution=3, j_resolution=3) for _ in range(3)]
    for height, wave in enumerate(waves):
        wave.points[:, 2] = 0.1 * height
    mesh, recorded = fw.read_animation(fw.write_series(waves, [1.0, 2.0, 3.0], tmp_path / "waves.vtkhdf"))
    frame = fw.Simulation(mesh, motion=recorded, time_step=0.5).step()
    np.testing.assert_allclose(frame.points[:, 2], 0.05, atol=1e-7)


def test_series_that_cannot_be_played_are_refused(tmp_path):
    one, other = pv.Sphere(theta_resolution=8), pv.Sphere(theta_resolution=9)
    turned = one.copy()
    turned.flip_faces(inplace=True)
    for frames, message in (
        ([one], "a single time"),
        ([one, other], "changes at step 1.*without refinement"),
        ([one, one, turned], "changes at step 2"),
    ):
        for frame in frames:
            frame.clear_data()
        path = fw.write_series(frames, np.arange(len(frames)) * 1.0, tmp_path / "bad.vtkhdf")
        with pytest.raises(fw.errors.MeshError, match=message):
            fw.read_animation(path)
    (tmp_path / "bad.vtkhdf").write_bytes(b"nothing")
    with pytest.raises(fw.errors.MeshError, match="cannot be read"):
        fw.read_animation(tmp_path / "bad.vtkhdf")
