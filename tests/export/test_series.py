"""Time series: what VTK's own reader reads back must be what was written."""

import numpy as np
import pytest
import pyvista as pv
from command_files import read_series
from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray, vtk_to_numpy

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


def full_frame(number: int) -> pv.PolyData:
    """A frame with arrays of every type, of cells and fields too, and values that comparisons do not tell apart."""
    mesh, generator = frame(number), np.random.default_rng(number)
    mesh.verts, mesh.lines = [1, number], [2, 0, number + 1, 3, 1, 2, 3]
    for data, rows in ((mesh.point_data, mesh.n_points), (mesh.cell_data, mesh.n_cells), (mesh.field_data, 7)):
        for kind in ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"):
            bits = generator.bytes(2 * rows * np.dtype(kind).itemsize)
            data[f"of {kind}"] = np.frombuffer(bits, kind).reshape(rows, 2).copy()
    mesh.point_data["Colors"] = generator.integers(0, 255, (mesh.n_points, 3)).astype(np.uint8)
    mesh.point_data["signs"] = np.where(generator.random(mesh.n_points) < 0.5, -0.0, np.nan)
    mesh.point_data.active_normals = generator.normal(size=(mesh.n_points, 3))
    ids = numpy_to_vtkIdTypeArray(2**40 + np.arange(mesh.n_points), deep=True)  # VTK sends 32 bits of them
    ids.SetName("ids")
    mesh.GetPointData().AddArray(ids)
    mesh.field_data["word"] = "alone"
    mesh.field_data["words"] = ["", "a b", "%20", "two\nlines", '"']
    mesh.set_active_scalars("Colors")
    mesh.active_texture_coordinates = generator.random((mesh.n_points, 2)).astype(np.float32)
    return mesh


def everything(mesh: pv.PolyData) -> dict[str, object]:
    """All that a mesh holds, bit by bit."""
    held: dict[str, object] = {"points": (mesh.points.dtype, mesh.points.tobytes()), "bounds": mesh.bounds}
    for cells in ("Verts", "Lines", "Polys", "Strips"):
        for part in ("Offsets", "Connectivity"):
            array = vtk_to_numpy(getattr(getattr(mesh, f"Get{cells}")(), f"Get{part}Array")())
            held[f"{cells}: {part}"] = (array.dtype, array.tobytes())
    for kind in ("point_data", "cell_data", "field_data"):
        for name, values in getattr(mesh, kind).items():
            array = np.atleast_1d(values)
            held[f"{kind}: {name}"] = (array.dtype, array.shape, array.tobytes())
    for attributes in (mesh.GetPointData(), mesh.GetCellData()):
        for number in range(attributes.NUM_ATTRIBUTES):
            active = attributes.GetAbstractAttribute(number)
            held[f"{attributes.GetClassName()} {number}"] = active and active.GetName()
    return held


def test_series_holds_all_of_a_mesh_to_the_last_bit(tmp_path):
    frames, given = [full_frame(number) for number in (0, 1, 2, 3, 1)], [0.0, 1 / 3, 0.5, 10.1, 1000.0]
    before = [everything(mesh) for mesh in frames]
    times, meshes = read_series(write_series(iter(frames), iter(given), tmp_path / "new" / "series.vtkhdf"))
    assert times == given
    assert len({mesh.n_points for mesh in meshes}) == 4
    for mesh, held in zip(meshes, before, strict=True):
        assert len(held) > 40
        del mesh.field_data["Time"]  # VTK's reader adds it
        assert everything(mesh) == held
    assert [everything(mesh) for mesh in frames] == before


def test_names_with_slashes_and_dots(tmp_path):
    ball = pv.Sphere()
    ball["a/b.c"] = np.arange(ball.n_points)
    np.testing.assert_array_equal(pv.read(write_series([ball], [0], tmp_path / "s.hdf"))["a_b_c"], ball["a/b.c"])


def test_arrays_whose_names_are_alike_stay_apart(tmp_path):
    frames = [pv.Sphere(theta_resolution=n) for n in (8, 9)]
    for number, ball in enumerate(frames):
        for name, value in (("a/b", 0.0), ("a_b", 10.0), ("a.b", 20.0)):
            ball[name] = np.full(ball.n_points, value + number)
    _, meshes = read_series(write_series(frames, [0, 1], tmp_path / "s.vtkhdf"))
    found = [{name: mesh[name][0] for name in ("a_b", "a_b_2", "a_b_3")} for mesh in meshes]
    assert found == [{"a_b": 10.0, "a_b_2": 0.0, "a_b_3": 20.0}, {"a_b": 11.0, "a_b_2": 1.0, "a_b_3": 21.0}]


def test_pyvista_reads_a_series_back(tmp_path):
    frames, given = [frame(number) for number in (0, 1, 2)], [0.0, 1 / 3, 10.1]
    reader = pv.get_reader(write_series(iter(frames), given, tmp_path / "new" / "series.pvd"))
    assert reader.time_values == given
    for time, own in zip(given, frames, strict=True):
        reader.set_active_time_value(time)
        (mesh,) = reader.read()
        assert mesh == own


def test_a_frame_may_be_filled_again(tmp_path):
    def filled():
        ball = pv.Sphere(theta_resolution=60, phi_resolution=60)
        for height in range(6):
            ball.points[:, 2] = height
            yield ball

    _, meshes = read_series(write_series(filled(), range(6), tmp_path / "series.vtkhdf"))
    assert [set(mesh.points[:, 2].tolist()) for mesh in meshes] == [{float(height)} for height in range(6)]


def unlike(data: str) -> pv.PolyData:
    """A frame without an array of the others, or with one that they lack."""
    other = frame(1)
    if data == "none":
        other.point_data.remove("W")
    else:
        other.field_data["more"] = [1.0]
    return other


@pytest.mark.parametrize("ending", ["vtkhdf", "pvd"])
@pytest.mark.parametrize(
    ("frames", "times", "message"),
    [
        *(
            (lambda times=times: [frame(0)] * len(times), times, "times must be finite and increase")
            for times in ([], [0.0, 0.0], [1.0, 0.0], [0.0, np.nan], [0.0, np.inf])
        ),
        (lambda: [frame(0), frame(1)], [0, 1, 2], "3 times need as many frames, received 2 frames"),
        (lambda: [frame(0)] * 3, [0, 1], "received 2 times and more frames"),
        (lambda: [frame(0), unlike("none")], [0, 1], "arrays of the first.*frame 1 has other ones: {'W': 'none'}"),
        (lambda: [frame(0), unlike("field data")], [0, 1], "the first.*1 has other ones: {'more': 'field data'}"),
    ],
)
def test_frames_that_make_no_series_are_refused_and_leave_nothing(tmp_path, capfd, frames, times, message, ending):
    with pytest.raises(ParameterError, match=message):
        write_series(frames(), times, tmp_path / f"series.{ending}")
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "problem",
    [RuntimeError("the solver failed"), KeyboardInterrupt(), FileNotFoundError(2, "gone", "skin.png")],
)
@pytest.mark.parametrize("good", [False, True])
@pytest.mark.parametrize("ending", ["vtkhdf", "pvd"])
def test_an_error_in_the_frames_comes_through(tmp_path, problem, good, ending, capfd):
    def frames():
        if good:
            yield frame(0)
        raise problem

    with pytest.raises(type(problem)) as caught:
        write_series(frames(), range(40), tmp_path / f"series.{ending}")
    assert caught.value is problem
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")


def test_files_of_other_kinds(tmp_path):
    with pytest.raises(OutputError, match=r"must end in .vtkhdf or .hdf or .pvd, received 'series.vtp'"):
        write_series([frame(0)], [0], tmp_path / "series.vtp")
    with pytest.raises(OutputError, match=r"must end in .mp4 or .gif, received 'movie'"):
        write_movie([], tmp_path / "movie")
    (tmp_path / "folder.gif").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        write_movie([], tmp_path / "folder.gif")


def noisy(count: int, size: int = 100, arrays: int = 1):
    """Frames that no compression makes smaller: about half a megabyte each."""
    ball = pv.Sphere(theta_resolution=size, phi_resolution=size)
    generator = np.random.default_rng(0)
    for _ in range(count):
        points = ball.points + generator.normal(size=ball.points.shape)
        data = {f"W{number}": generator.normal(size=ball.n_points) for number in range(arrays)}
        yield to_polydata(points, ball.regular_faces, data)


@pytest.mark.parametrize("count", [26, *(pytest.param(count, marks=pytest.mark.slow) for count in (25, 27, 40))])
def test_a_full_disk_keeps_the_old_series(small_disk, count, capfd):
    path = write_series(noisy(1, 10), [0], small_disk / "series.vtkhdf")
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"no space left on its disk \(.* MB are free\). What was there before is"):
        write_series(noisy(count), range(count), path)
    assert path.read_bytes() == before
    assert [file.name for file in small_disk.iterdir()] == ["series.vtkhdf"]
    assert capfd.readouterr() == ("", "")
    write_series(noisy(2, 10), [0, 1], path)  # there is room for this one again
    assert len(read_series(path)[0]) == 2


@pytest.mark.parametrize("size", [1_000, 50_000, 1_500_000])
def test_a_file_that_may_not_grow_is_an_error_of_ours(tmp_path, size):
    """HDF5 itself crashes there; at the start of the file, within its first frame, and later."""
    resource = pytest.importorskip("resource")
    path = write_series([frame(0)], [0], tmp_path / "series.vtkhdf")
    before, usual = path.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, usual[1]))
    try:
        with pytest.raises(OutputError, match="larger than files may be here"):
            write_series(noisy(20), range(20), path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
