"""Time series written by a process of its own: the same data, the same errors, and nothing left behind."""

from __future__ import annotations

import itertools
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import pyvista as pv
from export.test_series import frame, noisy, read_series
from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray, vtk_to_numpy

from facewrinkle.errors import OutputError, ParameterError
from facewrinkle.export import series_process, write_series
from facewrinkle.export.series import write_series_aside


@pytest.fixture
def processes(monkeypatch):
    """The processes that a test starts; in the end none is there any more, not even as a zombie."""
    begun, start = [], series_process._started

    def started():
        begun.append(start())
        return begun[-1]

    monkeypatch.setattr(series_process, "_started", started)
    yield begun
    assert begun
    assert all(process.returncode is not None for process in begun)
    assert all(pipe.closed for process in begun for pipe in (process.stdin, process.stdout))


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
    mesh.set_active_scalars(None if number % 2 else "Colors")
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
            array = np.asarray(values)
            held[f"{kind}: {name}"] = (array.dtype, array.shape, array.tobytes())
    for attributes in (mesh.GetPointData(), mesh.GetCellData()):
        for number in range(attributes.NUM_ATTRIBUTES):
            active = attributes.GetAbstractAttribute(number)
            held[f"{attributes.GetClassName()} {number}"] = active and active.GetName()
    return held


def test_the_file_holds_the_same_to_the_last_bit(tmp_path, processes):
    frames = [full_frame(number) for number in (0, 1, 2, 3, 1)]
    before = [everything(mesh) for mesh in frames]
    times = [0.0, 1 / 3, 0.5, 10.1, 1000.0]
    here = read_series(write_series(frames, times, tmp_path / "here.vtkhdf"))
    path = write_series_aside(iter(frames), iter(times), str(tmp_path / "new" / "aside.vtkhdf"))
    assert path == tmp_path / "new" / "aside.vtkhdf"
    aside = read_series(path)
    assert aside[0] == here[0] == np.array(times, np.float32).tolist()
    for one, other in zip(aside[1], here[1], strict=True):
        held = everything(one)
        assert len(held) > 40
        assert held == everything(other)
    assert [everything(mesh) for mesh in frames] == before
    assert [file.name for file in path.parent.iterdir()] == ["aside.vtkhdf"]


def failing(frames, problem):
    yield from frames
    raise problem


def other_arrays():
    last = frame(2)
    last.point_data.remove("W")
    return [frame(0), frame(1), last, frame(3)]


WRONG = {
    "too few": (lambda: [frame(0), frame(1), frame(2)], ParameterError, "4 times need as many frames, received 3"),
    "too many": (lambda: [frame(0)] * 5, ParameterError, "received 4 times and more frames"),
    "others": (other_arrays, ParameterError, r"point arrays of the first.*frame 2 has"),
    "at once": (lambda: failing([], KeyboardInterrupt()), KeyboardInterrupt, None),
    "interrupt": (lambda: failing([frame(0), frame(1)], KeyboardInterrupt()), KeyboardInterrupt, None),
    "disk": (lambda: failing([frame(0)], FileNotFoundError(2, "no such texture")), FileNotFoundError, "texture"),
}


@pytest.mark.parametrize("case", WRONG)
def test_errors_in_the_frames_come_through_and_leave_what_was_there(tmp_path, processes, case, capfd):
    path = tmp_path / "series.vtkhdf"
    path.write_bytes(b"of an earlier run")
    frames, error, message = WRONG[case]
    with pytest.raises(error, match=message):
        write_series_aside(frames(), range(4), path)
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [(path.name, b"of an earlier run")]
    assert capfd.readouterr() == ("", "")


def test_what_cannot_be_written_is_refused_before_anything_starts(tmp_path, monkeypatch):
    monkeypatch.setattr(series_process, "_started", lambda: pytest.fail("it was started"))
    with pytest.raises(OutputError, match="must end in .vtkhdf or .hdf"):
        write_series_aside([frame(0)], [0], tmp_path / "series.vtp")
    with pytest.raises(ParameterError, match="times must be finite and increase"):
        write_series_aside([frame(0)] * 2, [1, 0], tmp_path / "series.vtkhdf")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("when", [1, 3])
def test_a_process_that_is_killed_is_an_error_at_the_next_frame(tmp_path, processes, when, capfd):
    made = []

    def frames():
        for number in itertools.count():
            if number == when:
                processes[0].kill()
                processes[0].wait()
            made.append(number)
            yield frame(number % 3)

    with pytest.raises(OutputError, match="cannot be written: the process that writes it came to an end"):
        write_series_aside(frames(), range(100_000), tmp_path / "new" / "series.vtkhdf")
    assert made == list(range(when + 1))
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")


def test_a_full_disk_is_told_early_and_keeps_the_old_series(small_disk, processes, capfd):
    path = write_series(noisy(1, 10), [0], small_disk / "series.vtkhdf")
    before, made = path.read_bytes(), []
    frames = (made.append(0) or mesh for mesh in noisy(200))
    with pytest.raises(OutputError, match=r"no space left on its disk \(.* MB are free\). What was there before is"):
        write_series_aside(frames, range(200), path)
    assert 5 < len(made) < 25  # of 0.6 MB, on 8
    assert path.read_bytes() == before
    assert [file.name for file in small_disk.iterdir()] == ["series.vtkhdf"]
    assert capfd.readouterr() == ("", "")


def no_process(*_: object, **__: object) -> None:
    raise OSError(11, "no more processes")


@pytest.mark.parametrize("ends_at_once", [False, True])
def test_without_a_process_the_series_is_written_here(tmp_path, monkeypatch, ends_at_once):
    if ends_at_once:
        command = [sys.executable, "-c", "print('no answer')"]
        start = subprocess.Popen
        monkeypatch.setattr(subprocess, "Popen", lambda _, **options: start(command, **options))
    else:
        monkeypatch.setattr(subprocess, "Popen", no_process)
    path = write_series_aside((frame(number) for number in range(3)), range(3), tmp_path / "series.vtkhdf")
    times, meshes = read_series(path)
    assert times == [0.0, 1.0, 2.0]
    for number, mesh in enumerate(meshes):
        np.testing.assert_array_equal(mesh.points, frame(number).points)
    assert [file.name for file in tmp_path.iterdir()] == ["series.vtkhdf"]


def test_the_process_finds_this_package_wherever_it_starts(tmp_path, monkeypatch, processes):
    for name in ("facewrinkle", "pickle"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('another one')")
    monkeypatch.chdir(tmp_path)
    assert series_process._heard(series_process._started()) is None
    processes[0].kill()
    series_process._close(processes[0])


@pytest.mark.parametrize("torn", [False, True])
def test_the_process_ends_and_tidies_up_when_nobody_sends_frames_any_more(tmp_path, torn):
    """As after the end of the command by a signal that it cannot catch."""
    path = tmp_path / ".1.0.series.vtkhdf"
    process = series_process._started()
    assert series_process._heard(process) is None
    assert series_process._sent(process, (list(range(9)), path))
    for number in range(3):
        assert series_process._sent(process, series_process._packed(frame(number)))
    deadline = time.monotonic() + 20.0
    while not path.exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert path.exists()
    if torn:
        process.stdin.write(pickle.dumps(series_process._packed(frame(3)))[:1000])
    process.stdin.close()
    assert isinstance(series_process._heard(process), str)
    assert process.wait(timeout=20.0) == 0
    process.stdout.close()
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("signals_heard")
def test_the_process_does_not_hear_ctrl_c(tmp_path, processes):
    def frames():
        for number in range(3):
            if number == 1:
                processes[0].send_signal(signal.SIGINT)
            yield frame(number)

    path = write_series_aside(frames(), range(3), tmp_path / "series.vtkhdf")
    assert read_series(path)[0] == [0.0, 1.0, 2.0]


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="a process cannot be stopped there")
def test_frames_that_the_process_has_no_time_for_are_not_made(tmp_path, processes):
    """Those that wait do so in the pipe, which is small."""
    made, made_meanwhile = [], []

    def go_on():
        made_meanwhile.extend(made[2:])
        processes[0].send_signal(signal.SIGCONT)

    def frames():
        for number, mesh in enumerate(noisy(40)):
            if number == 1:
                processes[0].send_signal(signal.SIGSTOP)
                threading.Timer(0.3, go_on).start()
            made.append(number)
            yield mesh

    path = write_series_aside(frames(), range(40), tmp_path / "series.vtkhdf")
    assert len(read_series(path)[0]) == len(made) == 40
    assert len(made_meanwhile) <= 1 + series_process.PIPE // 500_000


def test_the_process_loads_neither_simulation_nor_command_line():
    program = (
        "import sys, facewrinkle.export.series_process\n"
        "print(*(name for name in sys.modules if name.startswith(('facewrinkle', 'numba', 'scipy'))))"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert set(run.stdout.split()) == {
        "facewrinkle",
        "facewrinkle.disk",
        "facewrinkle.export",
        "facewrinkle.export.series_file",
        "facewrinkle.export.series_process",
        "facewrinkle.processes",
    }
