"""Files out: what VTK's own reader and ffmpeg read back must be what was written."""

from __future__ import annotations

import builtins
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from facewrinkle.errors import MissingPackageError, OutputError, ParameterError
from facewrinkle.export import output_folder, write_movie, write_series
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


# --- time series --------------------------------------------------------------------------------


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


# --- movies -------------------------------------------------------------------------------------


def pictures(count: int, height: int, width: int, channels: int = 3):
    """A light bar that wanders down; every picture differs from the one before."""
    for number in range(count):
        image = np.zeros((height, width, channels), np.uint8)
        image[number * height // count : (number + 1) * height // count] = 255
        yield image


def read_movie(path: Path, height: int, width: int) -> tuple[np.ndarray, str]:
    """The pictures of a movie of this size, decoded by ffmpeg itself, and what it says about the file."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    command = [
        ffmpeg,
        "-i",
        str(path),
        "-fps_mode",
        "passthrough",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-",
    ]
    run = subprocess.run(command, capture_output=True, check=True, stdin=subprocess.DEVNULL)
    said = run.stderr.decode().split("Output #0")[0]
    assert f"{width}x{height}" in said
    return np.frombuffer(run.stdout, np.uint8).reshape(-1, height, width, 3), said


@pytest.mark.parametrize("ending", [".mp4", ".gif"])
@pytest.mark.parametrize("channels", [3, 4])
def test_movie(tmp_path, ending, channels):
    path = write_movie(pictures(12, 48, 64, channels), tmp_path / "new" / f"movie{ending}", fps=10)
    read, said = read_movie(path, 48, 64)
    assert len(read) == 12
    assert "10 fps" in said
    for image, original in zip(read, pictures(12, 48, 64), strict=True):
        assert np.abs(image.astype(int) - original).mean() < 4.0  # H.264 loses a little at the bar's edges


def test_odd_pictures_are_not_rescaled(tmp_path):
    read, _ = read_movie(write_movie(pictures(3, 33, 47), tmp_path / "odd.mp4"), 34, 48)
    assert len(read) == 3
    assert np.abs(read[0, :33, :47].astype(int) - next(pictures(3, 33, 47))).mean() < 4.0
    read, _ = read_movie(write_movie(pictures(3, 33, 47), tmp_path / "odd.gif"), 33, 47)
    assert len(read) == 3


@pytest.mark.parametrize(
    ("images", "message"),
    [
        ([], "one picture at least"),
        ([np.zeros((4, 4), np.uint8)], r"received uint8 of \(4, 4\)"),
        ([np.zeros((4, 4, 3))], "received float64"),
        (
            [np.zeros((4, 4, 3), np.uint8), np.zeros((4, 6, 3), np.uint8)],
            r"must be \(4, 4\) as the first, 1 is \(4, 6\)",
        ),
    ],
)
def test_movie_checks_its_pictures(tmp_path, images, message):
    with pytest.raises(ParameterError, match=message):
        write_movie(images, tmp_path / "movie.gif")
    with pytest.raises(ParameterError, match="fps must lie in"):
        write_movie(images, tmp_path / "movie.gif", fps=0)


@pytest.mark.parametrize(("missing", "ending"), [("imageio", ".gif"), ("imageio_ffmpeg", ".mp4")])
def test_movie_without_its_packages(tmp_path, monkeypatch, missing, ending):
    original = builtins.__import__

    def without(name, *args, **kwargs):
        if name.split(".")[0] == missing:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return original(name, *args, **kwargs)

    for name in [name for name in sys.modules if name.split(".")[0] == missing]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingPackageError, match=rf"{missing}.*pip install 'facewrinkle\[export\]'"):
        write_movie(pictures(2, 4, 4), tmp_path / f"movie{ending}")


# --- folders ------------------------------------------------------------------------------------


def test_output_folder(tmp_path, monkeypatch):
    folder = output_folder(tmp_path / "a" / "b")
    assert folder.is_dir()
    assert output_folder(str(folder)) == folder
    assert not list(folder.iterdir())
    monkeypatch.setenv("HOME", str(tmp_path))
    assert output_folder("~/c") == tmp_path / "c"


def test_a_file_in_the_place_of_the_folder(tmp_path):
    (tmp_path / "file").write_text("something")
    for path in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(OutputError, match="a file stands there or on the way to it. Name another"):
            output_folder(path)
    assert (tmp_path / "file").read_text() == "something"


@pytest.mark.parametrize("operation", ["mkdir", "write"])
def test_a_folder_that_refuses(tmp_path, monkeypatch, operation):
    """Simulated, since root passes permission bits."""

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(
        *((Path, "mkdir", refuse) if operation == "mkdir" else ("facewrinkle.export.TemporaryFile", refuse))
    )
    with pytest.raises(OutputError, match="cannot be written: Permission denied. Name a folder"):
        output_folder(tmp_path / "new")


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder that nobody can write to")
def test_a_folder_that_nobody_can_write_to():
    with pytest.raises(OutputError, match="cannot be written"):
        output_folder("/proc/facewrinkle")


@pytest.mark.parametrize("name", ["x" * 300, "null\0"])
def test_names_that_no_file_can_have(tmp_path, name):
    for call in (
        lambda: output_folder(tmp_path / name),
        lambda: write_movie([], tmp_path / f"{name}.gif"),
        lambda: write_series([], [0.0], tmp_path / f"{name}.vtkhdf"),
    ):
        with pytest.raises(OutputError, match="cannot be written"):
            call()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("problem", [KeyboardInterrupt, RuntimeError])
def test_half_a_movie_is_not_left_behind(tmp_path, problem):
    pytest.importorskip("imageio_ffmpeg")

    def images():
        yield np.zeros((16, 16, 3), np.uint8)
        raise problem

    for ending in ("mp4", "gif"):
        with pytest.raises(problem):
            write_movie(images(), tmp_path / f"movie.{ending}")
    assert not list(tmp_path.iterdir())
