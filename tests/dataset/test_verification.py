"""A check finds what was done to a set, and names the shard and the file; so does a program that others wrote."""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import replace

import pytest

from facewrinkle.cli import main
from facewrinkle.dataset import SampleMaker, check, generate, shards
from facewrinkle.errors import FaceWrinkleError, OutputError
from tests.dataset.conftest import SPEC

pq = pytest.importorskip("pyarrow.parquet", reason="data sets need pyarrow")

SHARD, OTHER, SUMS = "shard-000000.tar", "shard-000001.tar", "shard-000000.sha256"
TABLE, OTHER_TABLE = "index/shard-000000.parquet", "index/shard-000001.parquet"
STATISTICS, OTHER_STATISTICS = "statistics/shard-000000.npz", "statistics/shard-000001.npz"


@pytest.fixture
def folder(small, tmp_path):
    """A copy of the set, to be changed."""
    return shutil.copytree(small, tmp_path / "set")


def file(name, change):
    """Change the bytes of a file."""

    def tamper(folder):
        (folder / name).write_bytes(change((folder / name).read_bytes()))

    return tamper


def flipped(content):
    place = content.find(b"IDAT") + 40
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def table(folder):
    rows = pq.read_table(folder / TABLE)
    pq.write_table(rows.rename_columns({"light_key": "light_fill", "light_fill": "light_key"}), folder / TABLE)


def removed(name):
    return lambda folder: (folder / name).unlink()


def copied(source, target):
    return lambda folder: shutil.copy(folder / source, folder / target)


TAMPERING = {
    "a bit is flipped": (file(SHARD, flipped), SHARD, f"{SHARD} is not what was made"),
    "a shard is cut off": (file(SHARD, lambda content: content[:-512]), SHARD, f"{SHARD} is not what was made"),
    "zeros are appended": (file(SHARD, lambda content: content + bytes(10240)), SHARD, f"{SHARD} is not what was made"),
    "a shard is that of other samples": (copied(OTHER, SHARD), SHARD, f"{SHARD} is not what was made"),
    "a shard is gone": (removed(SHARD), SHARD, f"{SHARD} is missing"),
    "a shard too many": (
        copied(SHARD, "shard-000007.tar"), "dataset.json", "shard-000007.tar is no file of the set",
    ),
    "columns have each other's names": (table, SHARD, f"{TABLE} is not what was made"),
    "a table is that of other samples": (copied(OTHER_TABLE, TABLE), SHARD, f"{TABLE} is not what was made"),
    "a table is gone": (removed(TABLE), SHARD, f"{TABLE} is missing"),
    "a table too many": (
        copied(TABLE, "index/more.parquet"), "dataset.json", "more.parquet is no file of the set",
    ),
    "statistics are those of other samples": (
        copied(OTHER_STATISTICS, STATISTICS), SHARD, f"{STATISTICS} is not what was made",
    ),
    "statistics are gone": (removed(STATISTICS), SHARD, f"{STATISTICS} is missing"),
    "a list of failures that are none": (
        copied("dataset.json", "shard-000000.failed.json"), SHARD, "shard-000000.failed.json is not what was made",
    ),
    "the sums are gone": (removed(SUMS), SHARD, f"{SUMS} is missing"),
    "the sums are those of another set": (
        file(SUMS, lambda content: b"# 0123456789abcdef" + content[content.index(b"\n") :]), SHARD, "is of another set",
    ),
    "the specification has another seed": (
        file("dataset.json", lambda content: content.replace(b'"seed": 0', b'"seed": 1')),
        "dataset.json",
        "its specification is not that of the set",
    ),
    "the number of samples is another": (
        file("dataset.json", lambda content: content.replace(b'"count": 3', b'"count": 2')),
        "dataset.json",
        f"{OTHER} is no file of the set",
    ),
}  # fmt: skip
"""What is done, the shard (or file) that is named, and what is said of it."""


@pytest.mark.parametrize(("tamper", "shard", "said"), TAMPERING.values(), ids=TAMPERING)
def test_tampering_is_found_and_named(folder, tamper, shard, said):
    tamper(folder)
    found = dict(check(folder, remade=0))
    assert said in found.pop(shard)
    assert not any(found.values())  # nothing else is wrong


def test_what_was_not_touched_is_well(small):
    assert dict(check(small, remade=0)) == {"dataset.json": [], SHARD: [], OTHER: []}
    sums = sorted(path.name for path in small.glob("*.sha256"))
    told = subprocess.run(["sha256sum", "-c", *sums], cwd=small, capture_output=True, text=True, check=True)
    names = (SHARD, TABLE, STATISTICS, OTHER, OTHER_TABLE, OTHER_STATISTICS)
    assert told.stdout == "".join(f"{name}: OK\n" for name in names)


def test_shards_of_two_sets_are_not_mixed(folder, tmp_path, remembered):
    """A whole shard with its table and sums, as another version or another seed makes it."""
    other = generate({**SPEC, "seed": 1}, tmp_path / "other", count=2)
    for name in (SHARD, TABLE, STATISTICS, SUMS):
        shutil.copy(other / name, folder / name)
    assert dict(check(folder, remade=0))[SHARD] == ["is of another set"]


def test_samples_made_again_are_compared(small, folder, remembered, backwards, monkeypatch):
    assert not any(problems for _, problems in check(small, remade=2))
    monkeypatch.setitem(backwards, 2, replace(backwards[2], image=backwards[2].image | 1))
    assert [problems for _, problems in check(small, remade=2)][-1] == ["000000002 differs from what is stored"]
    (folder / OTHER).write_bytes(b"")  # samples of a shard that is damaged are not looked at
    assert [problems for _, problems in check(folder, remade=2)][-1] == []


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("name", ["dataset.json", SUMS, SHARD, TABLE, STATISTICS])
def test_named_pipes_in_a_set_are_not_waited_for(folder, name):
    (folder / name).unlink()
    os.mkfifo(folder / name)
    if name == "dataset.json":
        with pytest.raises(OutputError, match="holds no data set"):
            list(check(folder, remade=0))
    else:
        assert any(problems for _, problems in check(folder, remade=0))


def test_sets_that_were_signed_again_are_not_believed(folder, remembered):
    """Who changes a table or a shard and its sums can be told only by making samples again."""
    for name, shard in ((TABLE, SHARD), (OTHER, OTHER)):
        (folder / name).write_bytes(b"PAR1")
        sums = folder / shard.replace("tar", "sha256")
        lines = sums.read_text().splitlines()
        new = hashlib.sha256(b"PAR1").hexdigest()
        sums.write_text("".join(f"{new}  {name}\n" if line.endswith(name) else f"{line}\n" for line in lines))
    *stored, (_, remade) = check(folder, remade=9)
    assert [problems for _, problems in stored] == [[], [], []]
    assert remade == [f"{TABLE} is damaged", "000000002 differs from what is stored"]


@pytest.mark.parametrize("count", [10**9, 10**12, 10**400], ids=["9", "12", "400"])
def test_counts_that_no_disk_holds(folder, count):
    state = (folder / "dataset.json").read_text()
    (folder / "dataset.json").write_text(state.replace('"count": 3', f'"count": {count}'))
    with pytest.raises(FaceWrinkleError, match="100,000 are allowed.*set shard = |holds no data set"):
        list(check(folder))
    with pytest.raises(FaceWrinkleError, match="100,000 are allowed.*set shard = |must be a number"):
        generate(SPEC, folder, count=count)


def test_samples_that_failed_are_told(tmp_path, monkeypatch, capsys):
    class Unlucky(SampleMaker):
        def pictures(self, index):
            raise ZeroDivisionError("never")

    monkeypatch.setattr(shards, "SampleMaker", Unlucky)
    (tmp_path / "spec.toml").write_text("size = [48, 48]\nshard = 2\n")
    assert main(["dataset", str(tmp_path / "spec.toml"), "--count", "3", "--out", str(tmp_path / "set")]) == 1
    out, err = capsys.readouterr()
    assert "0 pictures of 3 samples" in out
    assert "3 of 3 samples could not be made" in err
    assert "the first is 000000000: ZeroDivisionError: never" in err
    assert f"3 of 3 samples are missing in '{tmp_path}/set'" in err
    assert main(["dataset", "check", str(tmp_path / "set")]) == 0


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are listed by /proc")
def test_workers_end_with_a_parent_that_is_killed(tmp_path):
    (tmp_path / "spec.toml").write_text("size = [48, 48]\nshard = 1\n")
    words = ["dataset", "spec.toml", "--count", "2000", "--workers", "2", "--quiet"]
    command = [sys.executable, "-m", "facewrinkle", *words]
    reading, writing = os.pipe()  # which stays open as long as a process of them lives
    run = subprocess.Popen(command, cwd=tmp_path, stdout=writing, stderr=writing, pass_fds=[writing])
    os.close(writing)
    try:
        deadline = time.monotonic() + 240
        while not list((tmp_path / "dataset").glob("*.tar")):  # whole, or not yet
            assert time.monotonic() < deadline
            assert run.poll() is None
            time.sleep(0.1)
    finally:
        run.kill()
        run.wait()
    os.set_blocking(reading, False)
    deadline = time.monotonic() + 30
    while True:
        try:
            if os.read(reading, 1024) == b"":
                return
        except BlockingIOError:
            assert time.monotonic() < deadline, "workers go on"
            time.sleep(0.1)


def test_a_damaged_table_is_told_in_a_line(folder, capsys):
    (folder / TABLE).write_bytes(b"PAR1")
    assert main(["dataset", "check", str(folder)]) == 1
    out, err = capsys.readouterr()
    assert TABLE in out
    assert "Remove the shards" in err
    with pytest.raises(OutputError, match=re.escape("shard-000000.parquet")):
        generate(SPEC, folder, count=3)
