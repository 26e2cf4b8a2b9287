"""Layers of maps for a whole rig.

what        checked against
normals     the map of one expression, blended as an engine does it
layers      a naive count of the wrinkles that lie on each other
files       Pillow
played      a rig whose mesh has the wrinkles, in three.js, also with a head of others', and on a page
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from judging import judged, path_of_chromium, shot
from PIL import Image
from real_faces import built_in
from scipy.ndimage import gaussian_filter

import facewrinkle as fw
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.rigging.wrinkle_layers import _colored, tiled

SIZE = 1024
SHAPES = {
    "browInnerUp": "AU1",
    "browDownLeft": "AU4",
    "browDownRight": "AU4",
    "noseSneerLeft": "AU9",
    "noseSneerRight": "AU9",
    "mouthClose": "",
}


@pytest.fixture(scope="module")
def face(request, real_face):
    """Somebody whose lines are seen on a page, as those of the young are faint: built in, or a real one by its name."""
    stem = getattr(request, "param", None)
    return replace(real_face(stem) if stem else built_in(), age=0.4)


@pytest.fixture(scope="module")
def smooth(face):
    return fw.rig(face, "+".join(SHAPES), wrinkles="maps")


@pytest.fixture(scope="module")
def layers(smooth):
    return fw.bake_layers(smooth, SIZE)


def shown(layers, weights):
    """Normals as a shader blends them: each layer by the sum of its masks, added to the flat one."""
    total = np.tile([0.0, 0.0, 1.0], (SIZE, SIZE, 1))
    for k, normal in enumerate(layers.normals):
        share = sum(w**2 * layers.masks[name] / 255.0 for name, w in weights.items() if layers.layer[name] == k)
        total += np.clip(share, 0.0, 1.0)[..., None] * (normal / 127.5 - 1.0 - [0.0, 0.0, 1.0])
    return total / np.linalg.norm(total, axis=-1, keepdims=True)


@pytest.mark.parametrize("unit", ["AU4", *(pytest.param(unit, marks=pytest.mark.slow) for unit in ("AU1", "AU9"))])
def test_layers_show_the_wrinkles_of_a_shape(face, layers, unit):
    single = fw.bake_maps(face, unit, size=SIZE)
    ours = shown(layers, {name: 1.0 for name, each in SHAPES.items() if each == unit})
    theirs = single.normal / 127.5 - 1.0
    folded = np.abs(single.height / 32768.0 - 1.0) * single.most > 0.1
    assert folded.sum() > 200
    angles = [
        np.degrees(np.arccos(np.clip((n * theirs).sum(axis=-1) / np.linalg.norm(theirs, axis=-1), -1, 1)))
        for n in (ours, np.broadcast_to([0.0, 0.0, 1.0], theirs.shape))
    ]
    assert angles[0][folded].mean() < 5.0
    assert angles[0][folded].mean() < 0.6 * angles[1][folded].mean()


def test_masks_of_a_side_stay_there(layers):
    left, right = (layers.masks[f"noseSneer{side}"].astype(float) for side in ("Left", "Right"))
    assert layers.layer["noseSneerLeft"] == layers.layer["noseSneerRight"]
    column = np.arange(SIZE)[None]
    places = [(mask * column).sum() / mask.sum() for mask in (left, right)]
    assert abs(places[0] - places[1]) > 0.05 * SIZE
    assert np.minimum(left, right).sum() < 0.2 * left.sum()  # the band in the middle
    assert "mouthClose" not in layers.masks


def test_what_lies_on_each_other_is_in_other_layers(layers):
    assert layers.layer["noseSneerLeft"] != layers.layer["browDownLeft"]
    assert layers.layer["browInnerUp"] != layers.layer["browDownLeft"]
    random = np.random.default_rng(2)
    depths = [(random.random((8, 8)) > 0.8).astype(np.float32) for _ in range(12)]

    def clashes(number):
        return sum(
            float(np.minimum(depths[i], depths[k]).sum()) for i in range(12) for k in range(i) if number[i] == number[k]
        )

    assert clashes(_colored(depths, 4)) < np.median([clashes(random.integers(0, 4, 12)) for _ in range(50)])


def test_files_hold_the_maps_and_masks(layers, tmp_path):
    assert all(path.exists() for path in fw.write_layers(layers, tmp_path / "head.glb"))
    table = json.loads((tmp_path / "head_wrinkles.json").read_text())
    assert table["unit_mm"] == 1.0
    assert table["texture_coordinates"] == "own"
    for each in table["layers"]:
        assert np.asarray(Image.open(tmp_path / each["normal"])).shape == (SIZE, SIZE, 3)
        assert np.asarray(Image.open(tmp_path / each["height"])).dtype == np.uint16
    picture = np.asarray(Image.open(tmp_path / table["masks"]["picture"]))
    columns, rows = table["masks"]["columns"], table["masks"]["rows"]
    tile = picture.shape[1] // columns
    assert picture.shape == (rows * tile, columns * tile, 3)
    assert list(table["shapes"]) == list(layers.masks)
    for name, row in table["shapes"].items():
        down, across = divmod(row["tile"], columns)
        small = picture[down * tile :, across * tile :, "rgb".index(row["channel"])][:tile, :tile]
        mean = Image.fromarray(layers.masks[name]).resize((tile, tile), Image.Resampling.BOX)
        assert np.abs(small - np.asarray(mean, float)).max() <= 1.0  # rounded elsewhere
        assert row["layer"] == layers.layer[name] + 1


@pytest.mark.parametrize(("width", "tile"), [(64, 64), (256, 256), (512, 256), (2048, 512)])
def test_masks_keep_a_quarter_of_their_width_or_what_is_small(width, tile):
    bright = np.zeros((width, width), np.uint8)
    bright[: width // 2] = 200
    picture = tiled([bright] * 14)
    assert picture.shape == (2 * tile, 4 * tile, 3)
    assert (picture[: tile // 2, :tile] == 200).all()
    assert not picture[tile // 2 : tile].any()
    assert picture[tile : tile + tile // 2, :tile, :2].all()
    assert not picture[tile:, :tile, 2].any()


WEIGHTS = {"browInnerUp": 1.0, "noseSneerLeft": 0.8, "noseSneerRight": 0.8}


@pytest.fixture(scope="module")
def folded(face):
    """A rig whose mesh has the wrinkles."""
    return fw.rig(face, "+".join(WEIGHTS), level=3)


def in_three(folder, smooth, layers, folded):
    fw.write_layers(layers, fw.write_rig(smooth, folder / "smooth.glb"))
    fw.write_rig(folded, folder / "folded.glb")
    assert judged("wrinkles.mjs", path_of_chromium(), str(folder), json.dumps(WEIGHTS), "700") == {"said": []}
    return [np.asarray(Image.open(folder / f"{name}.png").convert("L"), float) for name in ("smooth", "maps", "folded")]


def on_pages(folder, smooth, layers, folded):
    shapes = "#" + "&".join(f"{name}={weight}" for name, weight in WEIGHTS.items())
    seen = []
    for made, maps in ((smooth, None), (smooth, layers), (folded, None)):
        page = fw.rigging.write_page(made, folder / "rig.html", maps)
        forehead = shot(page, folder / f"{len(seen)}.png", shapes, (1500, 1200))[290:360, 420:760].mean(axis=2)
        seen.append(gaussian_filter(forehead, 1.5))  # edges may have stairs in one and none in another
    return seen


@pytest.mark.slow
@pytest.mark.parametrize(
    ("face", "played", "least"),
    [
        (None, in_three, 6.0),
        ("makehuman_head_male", in_three, 6.0),
        (None, on_pages, 1.5),  # these are lit more softly
    ],
    indirect=["face"],
)
def test_maps_play_as_wrinkles_of_the_mesh_do(played, least, smooth, layers, folded, tmp_path):
    bare, maps, truth = played(tmp_path, smooth, layers, folded)
    wrinkled = np.abs(truth - bare) > least
    assert wrinkled.sum() > 1000
    assert np.corrcoef((truth - bare)[wrinkled], (maps - bare)[wrinkled])[0, 1] > 0.8
    assert np.abs(truth - maps)[wrinkled].mean() < 0.5 * np.abs(truth - bare)[wrinkled].mean()


@pytest.mark.slow
def test_a_rig_that_folds_nothing_has_no_maps(face):
    with pytest.raises(ParameterError, match="folds the skin"):
        fw.bake_layers(fw.rig(replace(face, age=0.0), "eyeLookUpLeft", wrinkles="maps"), 64)


@pytest.mark.slow
def test_a_face_without_texture_gets_a_chart(face):
    bare = face.mesh.copy()
    bare.cell_data.clear()
    bare.point_data.clear()
    made = fw.rig(replace(face, mesh=bare, texture=None), "browInnerUp", wrinkles="maps")
    uv = made.parts["face"].uv
    assert len(uv) == len(made.mesh.points)
    assert 0.0 <= uv.min() < uv.max() <= 1.0
    baked = fw.bake_layers(made, 128)
    assert baked.masks["browInnerUp"].max() > 200
    assert baked.charted


def with_texture_beside(face):
    mesh = face.mesh.copy()
    mesh.active_texture_coordinates = np.asarray(mesh.active_texture_coordinates) + 2.0
    mesh.cell_data.clear()
    return replace(face, mesh=mesh)


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda face, smooth: fw.bake_layers(smooth, 300), ParameterError, "power of two"),
        (
            lambda face, smooth: fw.bake_layers(smooth, 4096),  # 20 bytes a texel and movement
            ParameterError,
            r"size of a map must lie in \[64, 2048\], .*all shapes at once",
        ),
        (
            lambda face, smooth: fw.bake_layers(replace(smooth, wrinkles="baked"), 128),
            ParameterError,
            'made with wrinkles="maps".*received one with wrinkles="baked"',
        ),
        (
            lambda face, smooth: fw.rig(face, "browInnerUp", wrinkles="maps", level=4),
            ParameterError,
            "received level 4: leave level out",
        ),
        (lambda face, smooth: fw.rig(face, wrinkles="map"), UnknownNameError, "kind of wrinkles 'map'"),
        (
            lambda face, smooth: fw.rig(with_texture_beside(face), wrinkles="maps"),
            ParameterError,
            r"texture coordinates in \[0, 1\]",
        ),
        (lambda face, smooth: fw.rig(face, level=9), ParameterError, "level must lie in"),
        (lambda face, smooth: fw.rig(face, correctives=-1), ParameterError, "correctives must lie in"),
        (lambda face, smooth: fw.rig(fw.surface(face.mesh, "mm")), ParameterError, "no landmarks"),
        (
            lambda face, smooth: fw.rig(face, "arkitt"),
            UnknownNameError,
            r"set of shapes 'arkitt'. Did you mean 'arkit'",
        ),
        (
            lambda face, smooth: fw.rig(replace(face, eyes=[]), "eyeWideLeft"),
            ParameterError,
            "can make none of the shapes of 'eyeWideLeft'",
        ),
    ],
)
def test_what_cannot_be_rigged_or_baked_is_refused(face, smooth, call, error, says):
    with pytest.raises(error, match=says):
        call(face, smooth)
