"""Movies: what ffmpeg reads back must be what was written."""

import numpy as np
import pytest
from command_files import movie_frames
from PIL import Image as Pillow

from facewrinkle.errors import OutputError, ParameterError
from facewrinkle.export import write_movie


def pictures(count: int, height: int, width: int, channels: int = 3):
    """A light bar that wanders down; every picture differs from the one before."""
    for number in range(count):
        image = np.zeros((height, width, channels), np.uint8)
        image[number * height // count : (number + 1) * height // count] = 255
        yield image


@pytest.mark.parametrize("ending", [".mp4", ".gif"])
@pytest.mark.parametrize("channels", [3, 4])
def test_movie(tmp_path, ending, channels):
    path = write_movie(pictures(12, 48, 64, channels), tmp_path / "new" / f"movie{ending}", fps=10)
    read = movie_frames(path, 48, 64)
    assert len(read) == 12
    assert pytest.importorskip("imageio_ffmpeg").count_frames_and_secs(str(path)) == (12, pytest.approx(1.2, abs=0.01))
    for image, original in zip(read, pictures(12, 48, 64), strict=True):
        assert np.abs(image.astype(int) - original).mean() < 4.0  # H.264 loses a little at the bar's edges


@pytest.mark.parametrize("fps", [1.0, 12.5, 24.0, 30.0, 48.0, 50.0])
def test_gifs_play_at_the_rate_that_was_asked_for(tmp_path, fps):
    images = [np.full((8, 8, 3), 3 * number, np.uint8) for number in range(50)]
    with Pillow.open(write_movie(images, tmp_path / "a.gif", fps=fps)) as read:
        durations = []
        for number in range(read.n_frames):
            read.seek(number)
            durations.append(read.info["duration"])
    assert len(durations) == len(images)
    np.testing.assert_allclose(np.cumsum(durations), 1000.0 / fps * np.arange(1, 51), atol=5.0 + 1e-9)


def test_gifs_that_programs_would_slow_down_are_refused(tmp_path):
    with pytest.raises(ParameterError, match=r"\[1, 50\], received 60. For more than 50, write .mp4"):
        write_movie(pictures(3, 8, 8), tmp_path / "a.gif", fps=60)


def test_odd_pictures_are_not_rescaled(tmp_path):
    read = movie_frames(write_movie(pictures(3, 33, 47), tmp_path / "odd.mp4"), 34, 48)
    assert len(read) == 3
    assert np.abs(read[0, :33, :47].astype(int) - next(pictures(3, 33, 47))).mean() < 4.0
    read = movie_frames(write_movie(pictures(3, 33, 47), tmp_path / "odd.gif"), 33, 47)
    assert len(read) == 3


@pytest.mark.parametrize(
    ("images", "message"),
    [
        ([], "at least one picture"),
        ([np.zeros((4, 4), np.uint8)], r"received uint8 of \(4, 4\)"),
        ([np.zeros((4, 4, 3))], "received float64"),
        (
            [np.zeros((4, 4, 3), np.uint8), np.zeros((4, 6, 3), np.uint8)],
            r"must have the size of the first, \(4, 4\); picture 1 has \(4, 6\)",
        ),
    ],
)
def test_movie_checks_its_pictures(tmp_path, images, message):
    with pytest.raises(ParameterError, match=message):
        write_movie(images, tmp_path / "movie.gif")
    with pytest.raises(ParameterError, match="fps must lie in"):
        write_movie(images, tmp_path / "movie.gif", fps=0)


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


@pytest.mark.filterwarnings("ignore:unclosed file")  # imageio forgets the pipe to an ffmpeg that has ended already
@pytest.mark.parametrize(("ending", "count"), [("mp4", 70), ("gif", 30)])
@pytest.mark.parametrize("side", [150, pytest.param(180, marks=pytest.mark.slow)])
def test_a_full_disk_keeps_the_old_film(small_disk, ending, count, side, capfd):
    """ffmpeg tells nobody that it could not finish."""
    pytest.importorskip("imageio_ffmpeg")
    (small_disk / "rest").write_bytes(bytes(7_900_000))
    path = write_movie(pictures(3, 16, 16), small_disk / f"movie.{ending}")
    before = path.read_bytes()
    generator = np.random.default_rng(0)
    noise = (generator.integers(0, 256, (side, side, 3), dtype=np.uint8) for _ in range(count))
    with pytest.raises(OutputError, match=r"no space left on its disk \(.* MB are free\). What was there before is"):
        write_movie(noise, path)
    assert path.read_bytes() == before
    assert sorted(file.name for file in small_disk.iterdir()) == [path.name, "rest"]
    assert capfd.readouterr() == ("", "")


def test_a_film_that_ffmpeg_did_not_finish(tmp_path, monkeypatch):
    import imageio.plugins.ffmpeg as plugin

    def cut_off(writer):
        original(writer)
        with open(writer.request.get_local_filename(), "r+b") as file:
            file.truncate(600)

    original = plugin.FfmpegFormat.Writer._close
    monkeypatch.setattr(plugin.FfmpegFormat.Writer, "_close", cut_off)
    with pytest.raises(OutputError, match="ffmpeg could not finish it. Name a file that you may write"):
        write_movie(pictures(12, 48, 64), tmp_path / "movie.mp4")
    assert not list(tmp_path.iterdir())
