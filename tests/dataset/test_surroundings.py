"""One's own pictures behind faces, and environment maps that light them."""

import io
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import binary_erosion

from facewrinkle.dataset import SampleMaker, Spec, generate
from facewrinkle.dataset.plan import plan_of
from facewrinkle.dataset.surroundings import covering, lamps_in
from facewrinkle.errors import MeshError, ParameterError
from facewrinkle.mesh.formats.radiance import radiance_of
from tests.dataset.conftest import SPEC

SIZE = 64
STILL = {**SPEC, "size": [SIZE, SIZE], "expression": {"neutral": 1.0, "named": 0.0}}
FRONT = {"yaw": 0.0, "pitch": 0.0, "roll": 0.0, "height": 5.0, "aside": 0.0, "above": 0.0}
EVEN = {"key": 1.0, "turn": 0.0, "warmth": 0.0}


@pytest.fixture
def folder(tmp_path):
    """A folder with three pictures of noise, as large as a sample."""
    random = np.random.default_rng(3)
    for name in "abc":
        Image.fromarray(random.integers(0, 256, (SIZE, SIZE, 3), np.uint8)).save(tmp_path / f"{name}.png")
    return tmp_path


def with_map(folder, place, size=4, light=50.0):
    """Write a map of a dim room with a lamp at a row and a column, and return a specification that is lit by it."""
    room = np.full((64, 128, 3), 0.02, np.float32)
    row, column = place
    room[row - size : row + size, column - size : column + size] = light
    cv2.imwrite(str(folder / "room.hdr"), room)
    return {**STILL, "camera": FRONT, "lights": {**EVEN, "environment": "*.hdr"}}


def made(spec, index=0):
    with SampleMaker(spec) as maker:
        return maker.sample(index)


def test_a_picture_is_seen_behind_the_face_as_it_is(folder):
    sample, plain = made(Spec.of({**STILL, "background": {"pictures": "*.png"}}, folder)), made(Spec.of(STILL))
    whole = np.asarray(Image.open(folder / sample.facts["files"]["background"]))
    behind = cv2.erode((sample.labels["part"] == 0).astype(np.uint8), np.ones((5, 5))) > 0  # edges are blended
    assert behind.mean() > 0.1
    assert np.array_equal(sample.image[behind], whole[behind])
    assert all(np.array_equal(sample.labels[name], plain.labels[name]) for name in plain.labels)
    inside = cv2.erode((sample.labels["part"] == 1).astype(np.uint8), np.ones((5, 5))) > 0
    assert np.array_equal(sample.image[inside], plain.image[inside])


def test_pictures_are_scaled_and_cut_to_cover(tmp_path):
    """Red on the left and blue on the right, twice as wide as it is high."""
    flag = np.zeros((30, 60, 3), np.uint8)
    flag[:, :30, 0] = flag[:, 30:, 2] = 255
    Image.fromarray(flag).save(tmp_path / "flag.png")
    (file,) = Spec.of({"background": {"pictures": "flag.png"}}, tmp_path).backgrounds
    for across, color in ((0.0, [255, 0, 0]), (1.0, [0, 0, 255])):
        seen = covering(file, {"across": across, "down": 0.5}, (20, 20))
        assert seen.shape == (20, 20, 3)
        assert (seen[:, 2:-2] == color).all()


@pytest.mark.slow
def test_edges_are_blended_with_the_picture(tmp_path):
    """What black, gray and white behind it makes of a pixel is a straight line: its share of the background."""
    seen = []
    for level in (0, 128, 255):
        Image.new("RGB", (8, 8), (level,) * 3).save(tmp_path / "plain.png")
        spec = {**STILL, "quick": False, "background": {"pictures": "plain.png"}}
        seen.append(made(Spec.of(spec, tmp_path)).image.astype(float))
    share = (seen[2] - seen[0]) / 255.0
    assert np.abs(seen[1] - seen[0] - 128.0 * share).max() <= 2.0
    assert ((share > 0.1) & (share < 0.9)).mean() > 0.01  # edges and hair
    assert ((share == 0.0) | (share == 1.0)).mean() > 0.8


def test_all_pictures_are_drawn(folder):
    spec = Spec.of({**STILL, "background": {"pictures": "*.png"}}, folder)
    shares = np.bincount([plan_of(spec, index).background["picture"] for index in range(300)]) / 300
    assert len(shares) == 3
    assert np.abs(shares - 1.0 / 3.0).max() < 4.0 * (2.0 / 9.0 / 300) ** 0.5
    assert plan_of(spec, 5).lights == plan_of(Spec.of(STILL), 5).lights  # nothing else is drawn otherwise


def test_pictures_are_known_by_their_contents(folder, tmp_path_factory):
    written = {**STILL, "background": {"pictures": "*.png"}}
    first = Spec.of(written, folder)
    other = tmp_path_factory.mktemp("other")
    for path in folder.iterdir():
        (other / path.name).write_bytes(path.read_bytes())
    assert Spec.of(written, other).digest == first.digest == Spec.of(first.written).digest
    (other / "b.png").write_bytes((other / "a.png").read_bytes())
    assert Spec.of(written, other).digest != first.digest
    (folder / "c.png").unlink()
    assert Spec.of(written, folder).digest != first.digest


@pytest.mark.parametrize(("change", "told"), [("changed", "has changed"), ("removed", "cannot be read")])
def test_a_picture_that_changes_meanwhile_stops_the_run(folder, tmp_path_factory, change, told):
    pytest.importorskip("pyarrow", reason="data sets need pyarrow")
    out = tmp_path_factory.mktemp("sets") / "set"
    spec = Spec.of({**STILL, "background": {"pictures": "a.png"}}, folder)
    if change == "changed":
        Image.new("RGB", (8, 8)).save(folder / "a.png")
    else:
        (folder / "a.png").unlink()
    with pytest.raises(ParameterError, match=told):
        generate(spec, out, count=1)
    assert not list(out.glob("shard*"))


def test_lamps_are_where_the_light_comes_from(tmp_path):
    """The middle of a map is behind the camera; what is to the right of it there is to the left in the picture."""
    seen = {}
    for side, column in (("left", 92), ("right", 36)):
        sample = made(Spec.of(with_map(tmp_path, (24, column)), tmp_path))
        skin = sample.labels["part"] == 1
        half = np.arange(SIZE) < SIZE / 2
        brightness = [sample.image[skin & own].mean() for own in (half, ~half)]
        seen[side] = brightness[0] / brightness[1]
    assert seen["left"] > 1.3
    assert seen["right"] < 1.0 / 1.3


def test_lamps_light_a_surface_as_the_map_does():
    """Of a lamp of half a radian, against the integral over all directions, on surfaces that face it about."""
    rows, columns = 128, 256
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)[:, None]
    azimuth = 2.0 * np.pi * (0.5 - (np.arange(columns) + 0.5) / columns)
    towards = np.stack(
        np.broadcast_arrays(
            np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)
        ),
        axis=-1,
    )
    lamp = np.array([0.6, 0.5, 0.62])
    lamp /= np.linalg.norm(lamp)
    radiance = np.where((towards @ lamp > np.cos(0.25))[..., None], [8.0, 4.0, 2.0], 0.0)
    area = np.cos(elevation) * (np.pi / rows) * (2.0 * np.pi / columns)
    for normal in (lamp, np.array([0.0, 0.6, 0.8]), np.array([0.6, 0.0, 0.8])):
        wanted = (radiance * (area * np.maximum(towards @ normal, 0.0))[..., None]).sum(axis=(0, 1)) / np.pi
        found = sum(
            max(float(np.dot(direction, normal)), 0.0) * intensity * np.array(color)
            for direction, color, intensity in lamps_in(radiance)
        )
        assert found == pytest.approx(wanted, rel=0.03)


@pytest.mark.slow
def test_the_environment_is_seen_behind(tmp_path):
    """A bright window at the left border of a map is behind the head, and to its right in the picture."""
    written = with_map(tmp_path, (31, 2), size=2)
    right = np.arange(SIZE) >= SIZE / 2
    for turn, factor in ((0.0, 2.0), (90.0, 0.0)):
        sample = made(Spec.of({**written, "lights": {**written["lights"], "turn": turn}}, tmp_path))
        behind = binary_erosion(sample.labels["part"] == 0)  # not at tips of hairs that cover a part of a pixel
        assert sample.image[behind & right].mean() > factor * sample.image[behind & ~right].mean()
    assert np.ptp(sample.image[behind]) <= 1  # turned out of sight: the plain room


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ({"background": {"pictures": "none/*.jpg"}}, r"pictures: no file is like '.*none.\*\.jpg'. .* relative to"),
        ({"background": {"pictures": 3}}, "pictures must be a text"),
        ({"lights": {"environment": "*.hdr"}}, "no file is like"),
    ],
)
def test_wrong_values(tmp_path, written, message):
    with pytest.raises(ParameterError, match=message):
        Spec.of(written, tmp_path)


HEADER = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n"


@pytest.mark.parametrize("size", [(5, 8), (3, 200), (2, 7)])
def test_radiance_is_read_as_opencv_reads_it(tmp_path, size):
    """Packed rows with runs and without, and those that are too narrow for it."""
    room = np.random.default_rng(5).uniform(0.0, 9.0, (*size, 3)).astype(np.float32)
    room[:, : size[1] // 2] = room[0, 0]
    room[0, -1] = 0.0
    cv2.imwrite(str(tmp_path / "a.hdr"), room)
    data = (tmp_path / "a.hdr").read_bytes()
    known = cv2.imread(str(tmp_path / "a.hdr"), cv2.IMREAD_UNCHANGED)[..., ::-1]
    np.testing.assert_array_equal(radiance_of(data, "a.hdr"), known)
    for cut in range(data.index(b"\n", data.index(b"+X")) + 1, len(data)):
        with pytest.raises(MeshError, match="a.hdr cannot be read as Radiance HDR: its data do not hold"):
            radiance_of(data[:cut], "a.hdr")


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (HEADER % (100_000, 100_000), "100000 x 100000 pixels"),
        (HEADER % (0, 0), "0 x 0 pixels"),
        (HEADER % (10**7, 1), "do not hold"),
        (HEADER.replace(b"-Y", b"+Y") % (1, 1) + bytes(4), "no header"),
        (HEADER.replace(b"rgbe", b"xyze") % (1, 1) + bytes(4), "no header"),
        (HEADER % (1, 1) + bytes([1, 1, 1, 9]), "do not hold"),
        (HEADER % (1, 8) + bytes([2, 2, 0, 8, 0] + [9] * 40), "do not hold"),
        (HEADER % (1, 8) + bytes([2, 2, 0, 8] + 4 * [255, 9] + [9] * 40), "do not hold"),
        (b"", "no header"),
        (b"\x89PNG\r\n", "no header"),
    ],
)
def test_radiance_that_is_damaged_is_refused(data, reason):
    with pytest.raises(MeshError, match=f"a.hdr cannot be read as Radiance HDR: .*{reason}"):
        radiance_of(data, "a.hdr")


def test_a_picture_that_pillow_gives_up_on_ends_the_set(tmp_path):
    """With words, and not as a sample that failed."""
    data = io.BytesIO()
    Image.new("RGB", (8, 8)).save(data, "PNG")
    chunk = b"zTXt" + b"a\0\0" + zlib.compress(b" " * 2**21)
    chunk = (len(chunk) - 4).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big")
    (tmp_path / "long.png").write_bytes(data.getvalue()[:33] + chunk + data.getvalue()[33:])
    spec = Spec.of({**STILL, "background": {"pictures": "long.png"}}, tmp_path)
    with pytest.raises(ParameterError, match="long.png' cannot be read as a picture: .*Decompressed data too large"):
        generate(spec, tmp_path / "set", count=1)


def test_pictures_stand_as_the_camera_was_held(tmp_path):
    flag = np.zeros((20, 40, 3), np.uint8)
    flag[:, :20, 0] = 255
    turned = Image.Exif()
    turned[0x0112] = 6  # the left side was up
    Image.fromarray(flag).save(tmp_path / "flag.png", exif=turned)
    (file,) = Spec.of({**STILL, "background": {"pictures": "flag.png"}}, tmp_path).backgrounds
    np.testing.assert_array_equal(covering(file, {"across": 0.5, "down": 0.5}, (20, 40)), np.rot90(flag, -1))


@pytest.mark.parametrize("pattern", ["**/**/*.png", "/".join(["**"] * 200)])
def test_patterns_end(tmp_path, pattern):
    with pytest.raises(ParameterError, match=r"pictures: \*\* may stand once in a pattern"):
        Spec.of({**STILL, "background": {"pictures": pattern}}, tmp_path)


@pytest.mark.parametrize(("table", "key"), [("background", "pictures"), ("lights", "environment")])
def test_files_that_are_no_pictures(tmp_path, table, key):
    (tmp_path / "letter.hdr").write_text("dear")
    with pytest.raises(ParameterError, match="letter.hdr' cannot be read as"):
        made(Spec.of({**STILL, table: {key: "letter.hdr"}}, tmp_path))
