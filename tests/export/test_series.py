"""Time series: what VTK's own reader reads back must be what was written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from facewrinkle.errors import OutputError, ParameterError
from facewrinkle.export import write_movie, write_series
from facewrinkle.mesh import ARRAYS, MUSCLES, to_polydata


def frame(number: int) -> pv.PolyData:
    """A sphere of its own resolution, with every array of a frame and the muscles' names."""
    ball = pv.Sphere(theta_resolution=6 + 3 * number, phi_resolution=9 + number % 2)
    points = ball.points.astype(float) * np.pi
    generator = np.random.default_rng(number)
    data = {name: generator.normal(size=len(points)) for name in ARRAYS}
    data["rest"] = generator.normal(size=(len(points), 3))
    data["muscle"] = generator.integers(-1, 23, len(points)).astype(np.int32)
    data["level"] = generator.integers(0, 4, len(points)).astype(np.int32)
    mesh = to_polydata(points, ball.regular_faces, data)
    mesh.field_data[MUSCLES] = ["zygomatic_major_l", "frontalis_inner_r"]
    return mesh


def read_series(path: Path) -> tuple[list[float], list[pv.PolyData]]:
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    information = reader.GetExecutive().GetOutputInformation(0)
    key = vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    times = [information.Get(key, step) for step in range(reader.GetNumberOfSteps())]
    meshes = []
    for time in times:
        reader.UpdateTimeStep(time)
        meshes.append(pv.wrap(reader.GetOutput()).copy())
    return times, meshes


def test_series_round_trip(tmp_path):
    times = [0.0, 1 / 3, 0.5, 10.1, 1000.0]
    path = write_series((frame(k) for k in range(5)), times, tmp_path / "new" / "series.vtkhdf")
    read_times, meshes = read_series(path)
    assert read_times == np.array(times, dtype=np.float32).tolist()
    assert len({mesh.n_points for mesh in meshes}) == 5
    for number, mesh in enumerate(meshes):
        original = frame(number)
        assert mesh.points.dtype == np.float64
        np.testing.assert_array_equal(mesh.points, original.points)
        np.testing.assert_array_equal(mesh.regular_faces, original.regular_faces)
        assert set(mesh.point_data) == set(ARRAYS)
        for name in ARRAYS:
            np.testing.assert_array_equal(mesh[name], original[name])
            assert mesh[name].dtype == original[name].dtype
        assert list(mesh.field_data[MUSCLES]) == list(original.field_data[MUSCLES])


def test_series_opens_in_pyvista_at_the_first_time(tmp_path):
    path = write_series([frame(2), frame(1)], [0, 1], str(tmp_path / "series.hdf"))
    np.testing.assert_array_equal(pv.read(path).points, frame(2).points)


def test_series_takes_every_frame_once(tmp_path):
    taken: list[int] = []

    def frames():
        for number in range(4):
            taken.append(number)
            yield frame(number)

    write_series(frames(), range(4), tmp_path / "series.vtkhdf")
    assert taken == [0, 1, 2, 3]


def test_series_replaces_a_file(tmp_path):
    path = tmp_path / "series.vtkhdf"
    write_series([frame(0), frame(1), frame(2)], [0, 1, 2], path)
    write_series([frame(3), frame(4)], [5, 6], path)
    times, meshes = read_series(path)
    assert times == [5.0, 6.0]
    np.testing.assert_array_equal(meshes[0].points, frame(3).points)


def test_a_single_frame(tmp_path):
    path = write_series([frame(3)], [5], tmp_path / "series.vtkhdf")
    np.testing.assert_array_equal(pv.read(path).points, frame(3).points)


def test_a_frame_may_be_filled_again(tmp_path):
    def filled():
        ball = pv.Sphere(theta_resolution=60, phi_resolution=60)
        for height in range(6):
            ball.points[:, 2] = height
            yield ball

    _, meshes = read_series(write_series(filled(), range(6), tmp_path / "series.vtkhdf"))
    assert [set(mesh.points[:, 2].tolist()) for mesh in meshes] == [{float(height)} for height in range(6)]


def test_series_leaves_frames_as_they_are(tmp_path):
    mesh = frame(1)
    before = (mesh.points.tobytes(), mesh.faces.tobytes(), [mesh[name].tobytes() for name in mesh.point_data])
    write_series([mesh], [0], tmp_path / "series.vtkhdf")
    assert (
        mesh.points.tobytes(),
        mesh.faces.tobytes(),
        [mesh[n].tobytes() for n in mesh.point_data],
    ) == before


@pytest.mark.parametrize("times", [[], [0.0, 0.0], [1.0, 0.0], [0.0, np.nan], [1.0, 1.0 + 1e-9], ["x"], [1e300]])
def test_series_needs_increasing_times(tmp_path, times):
    with pytest.raises(ParameterError, match="times must be finite and increase|a time must"):
        write_series([frame(0)] * len(times), times, tmp_path / "series.vtkhdf")
    assert not list(tmp_path.iterdir())


def test_series_needs_one_time_for_each_frame(tmp_path, capfd):
    path = tmp_path / "series.vtkhdf"
    with pytest.raises(ParameterError, match="3 times need as many frames, received 2 frames"):
        write_series([frame(0), frame(1)], [0, 1, 2], path)
    assert not path.exists()
    with pytest.raises(ParameterError, match="received 2 times and more frames"):
        write_series([frame(0)] * 3, [0, 1], path)
    assert not path.exists()
    assert capfd.readouterr() == ("", "")


def test_series_needs_the_same_arrays(tmp_path):
    other = frame(1)
    other.point_data.remove("W")
    with pytest.raises(ParameterError, match=r"point arrays of the first.*frame 1 has"):
        write_series([frame(0), other], [0, 1], tmp_path / "series.vtkhdf")


@pytest.mark.parametrize("problem", [RuntimeError("the solver failed"), KeyboardInterrupt()])
@pytest.mark.parametrize("good", [False, True])
def test_an_error_in_the_frames_comes_through(tmp_path, problem, good, capfd):
    def frames():
        if good:
            yield frame(0)
        raise problem

    with pytest.raises(type(problem)) as caught:
        write_series(frames(), range(40), tmp_path / "series.vtkhdf")
    assert caught.value is problem
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")


def test_files_of_other_kinds(tmp_path):
    with pytest.raises(OutputError, match=r"must end in .vtkhdf or .hdf, received 'series.vtp'"):
        write_series([frame(0)], [0], tmp_path / "series.vtp")
    with pytest.raises(OutputError, match=r"must end in .mp4 or .gif, received 'movie'"):
        write_movie([], tmp_path / "movie")
    (tmp_path / "folder.gif").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        write_movie([], tmp_path / "folder.gif")


@pytest.mark.parametrize("when", [0, 1, 2, 7])
def test_an_interrupt_stops_the_writer(tmp_path, when):
    """VTK would go on through all steps."""
    taken = []

    def frames():
        for number in range(100_000):
            taken.append(number)
            if number == when:
                raise KeyboardInterrupt
            yield frame(number % 3)

    with pytest.raises(KeyboardInterrupt):
        write_series(frames(), range(100_000), tmp_path / "new" / "series.vtkhdf")
    assert taken == list(range(when + 1))
    assert not list(tmp_path.iterdir())


def noisy(count: int, size: int = 100, arrays: int = 1):
    """Frames that no compression makes smaller: about half a megabyte each."""
    ball = pv.Sphere(theta_resolution=size, phi_resolution=size)
    generator = np.random.default_rng(0)
    for _ in range(count):
        points = ball.points + generator.normal(size=ball.points.shape)
        data = {f"W{number}": generator.normal(size=ball.n_points) for number in range(arrays)}
        yield to_polydata(points, ball.regular_faces, data)


@pytest.mark.parametrize("count", [10, 12, 13, 14, 40])  # of 9, the room reserved is still there
def test_a_full_disk_keeps_the_old_series(small_disk, count, capfd):
    """VTK's writer would go round for ever with the interpreter's lock, or leave a file that nobody can read."""
    path = write_series(noisy(1, 10), [0], small_disk / "series.vtkhdf")
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"no space left on its disk \(.* MB are free\). What was there before is"):
        write_series(noisy(count), range(count), path)
    assert path.read_bytes() == before
    assert [file.name for file in small_disk.iterdir()] == ["series.vtkhdf"]
    assert capfd.readouterr() == ("", "")
    write_series(noisy(2, 10), [0, 1], path)  # there is room for this one
    assert len(read_series(path)[0]) == 2


def test_a_disk_that_fills_up_behind_our_back(small_disk):
    """Room that was reserved, and is not there: VTK's writer fails, and must end. HDF5 is lost to that process."""
    program = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "import facewrinkle.export.series as series, facewrinkle.export.series_file as series_file\n"
        "from export.test_series import noisy\n"
        "series_file.reserve = lambda *_: None\n"
        f"try: series.write_series(noisy(16), range(16), {str(small_disk / 'series.vtkhdf')!r})\n"
        "except ValueError as error: print(error)\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60.0, check=False)
    assert "no space left on its disk" in run.stdout
    assert not list(small_disk.iterdir())


@pytest.mark.parametrize(("size", "arrays"), [(10, 1), (10, 30), (100, 1), (300, 1), (100, 12)])
def test_the_room_reserved_suffices_and_is_given_back(tmp_path, monkeypatch, size, arrays):
    reserved = []

    def reserve(path, room):
        reserved.append((path.stat().st_size, room))

    monkeypatch.setattr("facewrinkle.export.series_file.reserve", reserve)
    path = write_series(noisy(8, size, arrays), range(8), tmp_path / "series.vtkhdf")
    sizes = [length for length, _ in reserved[1:]] + [path.stat().st_size]
    assert all(after <= room for (_, room), after in zip(reserved, sizes, strict=True))
    monkeypatch.undo()
    again = write_series(noisy(8, size, arrays), range(8), tmp_path / "series.vtkhdf")
    assert 512 * again.stat().st_blocks <= again.stat().st_size + 2**16


def test_an_error_of_the_disk_in_the_frames_is_not_ours(tmp_path):
    def frames():
        yield frame(0)
        raise FileNotFoundError(2, "no such texture", "skin.png")

    with pytest.raises(FileNotFoundError, match="no such texture"):
        write_series(frames(), range(4), tmp_path / "series.vtkhdf")
    assert not list(tmp_path.iterdir())
