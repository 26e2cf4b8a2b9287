"""Sets: the same bytes whoever makes them, whole or absent, read by others' loaders, with the same entries for all."""

import hashlib
import io
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tarfile
import time
import warnings
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
import pytest
from PIL import Image

import facewrinkle as fw
from facewrinkle.dataset import SampleMaker, Spec, check, generate, generation, preview
from facewrinkle.dataset import shards as shards_module
from facewrinkle.dataset.labels import PARTS
from facewrinkle.dataset.sample import mixture_text
from facewrinkle.dataset.shards import Shard, shards_of, write_shard
from facewrinkle.errors import FaceWrinkleError, FaceWrinkleWarning, OutputError, ParameterError
from tests.dataset.conftest import SPEC

pytest.importorskip("pyarrow", reason="data sets need pyarrow")


def hashes(folder):
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def kept_in(done):
    """Progress that keeps what was done in a list."""

    def progress(samples, what, total):
        for sample in samples:
            done.append(sample)
            yield sample
        assert len(done) == total

    return progress


def test_a_sample_is_the_same_in_any_order(small, backwards):
    for index, sample in backwards.items():
        with tarfile.open(small / f"shard-{index // 2:06d}.tar") as tar:
            for ending, content in sample.files().items():
                assert tar.extractfile(f"{index:09d}.{ending}").read() == content


@pytest.mark.slow
def test_what_a_scene_showed_before_does_not_show():
    """Lamps, the shader of skin, a texture and tears, in one scene: each sample comes once first and once second."""
    expression = {"neutral": 0.0, "named": 1.0, "names": ["happiness", "sadness"]}
    drawn = {"size": [128, 128], "quick": False, "tears": {"share": 1.0}}  # in which the thin film of tears shows
    spec = Spec.of({**SPEC, **drawn, "expression": expression})
    made = []
    for order in ((0, 1), (1, 0)):
        with SampleMaker(spec) as maker:
            made.append({index: maker.sample(index) for index in order})
            assert maker.simulation_of(0)[1].face.texture is not None
    for index, sample in made[0].items():
        assert made[1][index].files() == sample.files()
        assert (sample.labels["part"] == PARTS.index("tear")).any()
    views = [sample.facts["plan"]["camera"] for sample in made[0].values()]
    assert views[0] != views[1]


@pytest.mark.slow
def test_workers_make_the_same_bytes(small, tmp_path):
    done = []
    other = generate(SPEC, tmp_path / "other", count=3, workers=2, progress=kept_in(done))
    assert hashes(other) == hashes(small)
    assert sorted(done) == [0, 1, 2]


@pytest.mark.parametrize(
    ("problem", "told"),
    [(RuntimeError("A process was terminated."), "A process was terminated"), (None, "the scheduler was lost")],
)
def test_a_worker_that_is_lost_is_told_and_the_same_again_goes_on(
    small, tmp_path, remembered, monkeypatch, problem, told
):
    lost = Future()
    if problem is None:
        lost.cancel()
        lost.set_running_or_notify_cancel()
    else:
        lost.set_exception(problem)

    class Unlucky(ThreadPoolExecutor):
        def submit(self, function, *arguments):
            return lost if arguments[1].number == 0 else super().submit(function, *arguments)

    monkeypatch.setattr(generation, "_executor", lambda *_: Unlucky(1))
    with pytest.raises(FaceWrinkleError, match=f"1 of 2 shards are missing: {told}. Run the same again"):
        generate(SPEC, tmp_path / "other", count=3, workers=2)
    generate(SPEC, tmp_path / "other", count=3)
    assert hashes(tmp_path / "other") == hashes(small)


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A set of one clip of three pictures, with meshes. Not to be changed."""
    spec = {
        **SPEC,
        "clip": {"frames": 3, "interval": 0.06},
        "mesh": "npz",
        "expression": {"neutral": 0.0, "named": 1.0},
    }
    spec["expression"] |= {"names": ["surprise"], "intensity": 1.0}
    return generate(spec, tmp_path_factory.mktemp("set") / "clip", count=1)


@pytest.mark.slow
def test_a_clip_goes_from_rest_into_the_expression(clip):
    assert [problems for _, problems in check(clip, remade=1)] == [[], [], []]
    rates, units, meshes = [], [], []
    with tarfile.open(clip / "shard-000000.tar") as tar:
        assert len(tar.getnames()) == 12
        for k in range(3):
            read = {ending: tar.extractfile(f"000000000-{k:04d}.{ending}").read() for ending in ("json", "mesh.npz")}
            facts = json.loads(read["json"])
            rates.append(facts["contractions"]["frontalis_inner_l"])
            assert facts["action_units"].keys() == fw.ACTION_UNITS.keys()
            units.append({unit: weight for unit, weight in facts["action_units"].items() if weight > 0.0})
            meshes.append(np.load(io.BytesIO(read["mesh.npz"])))
    assert 0.0 < rates[0] < rates[1] == rates[2] == 1.0  # the ramp takes three fifths of the clip
    assert units[0] == pytest.approx(
        {"AU1": rates[0], "AU2": rates[0], "AU5": 0.7 * rates[0], "AU26": rates[0]}, abs=1e-6
    )
    assert units[1] == units[2] == {"AU1": 1.0, "AU2": 1.0, "AU5": 0.7, "AU26": 1.0}
    assert all(mesh["triangles"].max() == len(mesh["points"]) - 1 for mesh in meshes)
    moved = [np.abs(mesh["points"] - mesh["rest"]).max() for mesh in meshes]
    assert moved[0] < min(moved[1:])  # from then on the skin only comes to rest


@pytest.mark.slow
def test_meshes_for_other_programs(backwards):
    with SampleMaker(Spec.of({**SPEC, "mesh": "glb"})) as maker:
        sample = maker.sample(2)
    model = sample.mesh["mesh.glb"]
    size, content = (int.from_bytes(model[at : at + 4], "little") for at in (8, 12))
    names = {mesh["name"] for mesh in json.loads(model[20 : 20 + content])["meshes"]}
    assert model[:4] == b"glTF"
    assert size == len(model)
    assert {"face", "eye_l", "eye_r"} <= names
    assert sample.files().keys() == {"png", "npz", "json", "mesh.glb"}
    assert np.array_equal(sample.image, backwards[2].image)


def test_what_is_missing_is_made_again(small, tmp_path, remembered):
    other = tmp_path / "other"
    shutil.copytree(small, other)
    kept = (other / "shard-000000.tar").stat().st_mtime_ns
    (other / "shard-000001.tar").unlink()
    done = []
    generate(SPEC, other, count=3, progress=kept_in(done))
    assert hashes(other) == hashes(small)
    assert (other / "shard-000000.tar").stat().st_mtime_ns == kept
    assert done == [0, 1, 2]


SLOW = """
import pickle, time
from facewrinkle.dataset import SampleMaker, generate, shards
samples = pickle.load(open({kept!r}, "rb"))
class Slow(SampleMaker):
    def pictures(self, index):
        time.sleep(60.0 if index == 2 else 0.0)
        return [samples[index]]
shards.SampleMaker = Slow
"""
"""Python that makes the second shard slow, and the first without drawing."""


@pytest.mark.slow
def test_a_killed_run_goes_on(small, tmp_path, backwards, remembered):
    other, kept = tmp_path / "other", tmp_path / "samples"
    kept.write_bytes(pickle.dumps(backwards))
    code = f"{SLOW.format(kept=str(kept))}generate({SPEC!r}, {str(other)!r}, count=3)"
    process = subprocess.Popen([sys.executable, "-c", code])
    end = time.monotonic() + 120.0
    while not (other / "shard-000000.sha256").exists() and time.monotonic() < end:
        time.sleep(0.02)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    assert sorted(path.name for path in other.glob("shard*")) == ["shard-000000.sha256", "shard-000000.tar"]
    generate(SPEC, other, count=3)
    found = {name: value for name, value in hashes(other).items() if not os.path.basename(name).startswith(".")}
    assert found == hashes(small)


@pytest.mark.slow
def test_workers_of_a_scheduler_make_the_same_bytes(small, tmp_path):
    distributed = pytest.importorskip("distributed", reason="schedulers are Dask's")
    with (
        warnings.catch_warnings(),
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster,
    ):
        warnings.simplefilter("ignore")  # of sockets that Dask leaves open
        generate(SPEC, tmp_path / "other", count=3, scheduler=cluster.scheduler_address)
    assert hashes(tmp_path / "other") == hashes(small)


def test_two_runs_in_one_folder_make_the_same_set(small, tmp_path, remembered):
    """Whole shards take the place of each other: the second run begins when the first has made a sample."""
    other = tmp_path / "other"

    def progress(samples, what, total):
        for number, sample in enumerate(samples):
            if number == 0:
                generate(SPEC, other, count=3)
            yield sample

    generate(SPEC, other, count=3, progress=progress)
    assert hashes(other) == hashes(small)


def test_a_sample_that_fails_is_listed_and_left_out(tmp_path, backwards, monkeypatch):
    class Stubborn(SampleMaker):
        def pictures(self, index):
            if index == 1:
                raise ZeroDivisionError("never")
            return [backwards[index]]

    monkeypatch.setattr(shards_module, "SampleMaker", Stubborn)
    spec = Spec.of(SPEC)
    assert list(write_shard(spec, Shard(0, 0, 3), tmp_path)) == [0, 1, 2]
    (failure,) = json.loads((tmp_path / "shard-000000.failed.json").read_text())
    assert failure == {"index": 1, "error": "ZeroDivisionError: never"}
    _, parquet = shards_module.arrow()
    assert parquet.read_table(tmp_path / "index" / "shard-000000.parquet")["index"].to_pylist() == [0, 2]
    monkeypatch.setattr(Stubborn, "pictures", lambda _, index: [backwards[index]])
    assert list(write_shard(spec, Shard(0, 0, 3), tmp_path)) == [0, 1, 2]  # made again, and now all is well
    assert not list(tmp_path.glob("*.failed.json"))


def test_a_set_that_other_code_began_is_not_mixed(small, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(small, other)
    state = json.loads((other / "dataset.json").read_text())
    state["code"] = "0123456789abcdef"
    (other / "dataset.json").write_text(json.dumps(state))
    *stored, (_, remade) = check(other)
    assert [problems for _, problems in stored] == [[], [], []]
    assert len(remade) == 1
    (other / "dataset.json").write_text(json.dumps(state | {"digest": "of that code"}))
    with pytest.raises(OutputError, match="with other code .*0123456789abcdef"):
        generate(SPEC, other, count=3)


def test_a_shard_that_was_begun_again_is_not_done(small, tmp_path, remembered, backwards):
    other, spec = tmp_path / "other", Spec.of(SPEC)
    shutil.copytree(small, other)
    failures = other / "shard-000001.failed.json"
    failures.write_text('[{"index": 2, "error": "of before"}]')
    (other / "shard-000001.tar").unlink()
    made = write_shard(spec, Shard(1, 2, 3), other)
    next(made)
    made.close()
    assert not Shard(1, 2, 3).done(other)
    assert not failures.exists()
    generate(SPEC, other, count=3)
    assert hashes(other) == hashes(small)


def test_more_processes_than_shards_are_told(small, tmp_path, remembered):
    other = tmp_path / "other"
    shutil.copytree(small, other)
    with pytest.warns(FaceWrinkleWarning, match="8 processes, and 2 of them at work.* shard = 1"):
        generate(SPEC, other, count=3, workers=8)


@pytest.mark.parametrize(("count", "size"), [(1, 1), (10, 3), (9, 3)])
def test_shards_cover_all_samples_once(count, size):
    assert [k for shard in shards_of(count, size) for k in range(shard.first, shard.last)] == list(range(count))


READING = """
import json, sys, webdataset
read = list(webdataset.WebDataset(sys.argv[1:], shardshuffle=False).decode("rgb8"))
first = read[0]
keys = [sample["__key__"] for sample in read]
print(json.dumps([keys, first["png"].shape, first["npz"]["depth"].shape, first["json"]["plan"]["index"]]))
"""


@pytest.mark.slow
def test_webdataset_reads_it(small):
    pytest.importorskip("webdataset")
    urls = [str(small / f"shard-{k:06d}.tar") for k in range(2)]
    out = subprocess.run(
        [sys.executable, "-c", READING, *urls], capture_output=True, check=True
    )  # it leaves files open
    assert json.loads(out.stdout) == [[f"{k:09d}" for k in range(3)], [48, 48, 3], [48, 48], 0]


def test_pandas_reads_the_table(small):
    table = pytest.importorskip("pandas").read_parquet(small / "index")
    assert sorted(table["index"]) == list(range(3))
    assert table["person"].nunique() == 2
    assert table["identity_age"].between(-0.9, 1.0).all()


def test_the_card_tells_what_it_is(small):
    text = (small / "README.md").read_text(encoding="utf-8")
    assert "3 of 3 samples, a picture each of 48 x 48 pixels" in text
    assert json.loads(text.split("```json")[1].split("```")[0])["per_person"] == 2


def test_the_card_tells_means_and_shares(small):
    """Against the pictures and labels themselves, of all shards."""
    pictures, parts, facts = [], [], []
    for path in sorted(small.glob("*.tar")):
        with tarfile.open(path) as tar:
            read = {member.name: tar.extractfile(member).read() for member in tar}
        pictures += [np.array(Image.open(io.BytesIO(read[name]))) for name in read if name.endswith("png")]
        parts += [np.load(io.BytesIO(read[name]))["part"] for name in read if name.endswith("npz")]
        facts += [json.loads(read[name]) for name in read if name.endswith("json")]
    stack = np.array(pictures, float)
    text = (small / "README.md").read_text(encoding="utf-8")
    mean, deviation = (", ".join(f"{x:.1f}" for x in f(stack, axis=(0, 1, 2))) for f in (np.mean, np.std))
    assert f"mean {mean}, standard deviation {deviation} over all pixels" in text
    shares = np.bincount(np.ravel(parts), minlength=len(PARTS)) / np.size(parts)
    assert f"Pixels: {', '.join(f'{name} {share:.1%}' for name, share in zip(PARTS, shares, strict=True))}." in text
    for tone in range(1, 11):
        assert f"{tone}: {np.mean([each['person']['monk'] == tone for each in facts]):.1%}" in text
    shown = np.array(Image.open(small / "mean.png"), float)
    assert np.abs(shown[:, :48] - stack.mean(axis=0)).max() <= 0.5
    assert np.abs(shown[:, -48:] - stack.std(axis=0)).max() <= 0.5


def test_a_preview_shows_different_people(remembered):
    assert [sample.facts["person"]["number"] for sample in preview(SPEC, count=2)] == [0, 1]


def test_wrong_folders(small, tmp_path, monkeypatch):
    (tmp_path / "letter.txt").write_text("dear")
    for message, spec, folder, count in (
        ("another specification", {**SPEC, "seed": 1}, small, 3),
        ("same count", SPEC, small, 2),
        ("same count", SPEC, small, 9),
        ("other files", SPEC, tmp_path, 3),
        ("a file stands there", SPEC, tmp_path / "letter.txt", 3),
    ):
        with pytest.raises(OutputError, match=message):
            generate(spec, folder, count=count)
    with pytest.raises(OutputError, match="holds no data set"):
        list(check(tmp_path))
    assert (tmp_path / "letter.txt").read_text() == "dear"
    monkeypatch.setattr(generation, "code_digest", lambda: "later")
    with pytest.raises(OutputError, match="with other code"):
        generate({**SPEC, "seed": 1}, small, count=3)


def test_a_scheduler_that_is_not_there(tmp_path):
    dask = pytest.importorskip("dask", reason="schedulers are Dask's")
    short = dask.config.set({"distributed.comm.timeouts.connect": "0.5s"})
    with short, pytest.raises(ParameterError, match="cannot be reached"):
        generate(SPEC, tmp_path / "set", count=3, scheduler="tcp://127.0.0.1:1")


# --- what is told of pictures ----------------------------------------------------------------------


def shape_of(value):
    """The names and types in JSON, but not its numbers; lists by their first entry."""
    if isinstance(value, dict):
        return {name: shape_of(each) for name, each in value.items()}
    if isinstance(value, list):
        return [shape_of(value[0])]
    return type(value).__name__


@pytest.mark.slow
def test_a_scan_and_the_head_have_the_same_entries(tmp_path):
    fw.write_face(fw.default_face(), tmp_path / "anna.face")
    scans = [{"path": str(tmp_path / "anna.face"), "weight": 1.0, "licence": "CC0"}]
    shapes, names = [], []
    for built_in, crying in ((0.0, 0.0), (1.0, 1.0)):
        faces = {"built_in": built_in, "scans": [] if built_in else scans}
        spec = Spec.of({"size": [48, 48], "quick": True, "faces": faces, "tears": {"share": crying}})
        with SampleMaker(spec) as maker:
            record = json.loads(maker.sample(0).files()["json"])
        shapes.append(shape_of(record))
        names.append((record["person"]["scan"], record["person"]["monk"] > 0, record["plan"]["tears"] >= 0.0))
    assert shapes[0] == shapes[1]
    assert "NoneType" not in str(shapes[0])
    assert names == [("anna.face", False, False), ("", True, True)]


def test_mixtures_are_texts_that_expressions_take(face):
    mixture = {"AU9": 0.25, "happiness": 0.5}
    assert face.atlas.contractions(mixture_text(mixture)) == face.atlas.contractions(mixture)
