"""A check finds what was done to a set: the kinds of tampering, each with the shard and the sample that it names."""

from __future__ import annotations

import hashlib
import io
import json
import re
import shutil
import tarfile

import numpy as np
import pytest
from PIL import Image

from facewrinkle.cli import main
from facewrinkle.dataset import check, generate
from facewrinkle.errors import OutputError
from tests.dataset.conftest import SPEC

pq = pytest.importorskip("pyarrow.parquet", reason="data sets need pyarrow")
pa = pytest.importorskip("pyarrow")

SHARD, OTHER = "shard-000000.tar", "shard-000001.tar"
FIRST, SECOND, THIRD = "000000000", "000000001", "000000002"


# --- What is done to a set ---


def rewritten(change, shard=SHARD):
    """Write a shard anew with other members: a function of the list of names and contents."""

    def tamper(folder):
        with tarfile.open(folder / shard) as tar:
            members = [(member.name, tar.extractfile(member).read()) for member in tar]
        with tarfile.open(folder / shard, "w") as tar:
            for name, content in change(members):
                member = tarfile.TarInfo(name)
                member.size = len(content)
                tar.addfile(member, io.BytesIO(content))

    return tamper


def changed(name, change):
    """Change the content of one member."""
    return rewritten(
        lambda members: [(each, change(content) if each == name else content) for each, content in members]
    )


def swapped(*names):
    """Swap the contents of two members."""

    def change(members):
        contents = dict(members)
        other = dict(zip(names, names[::-1], strict=True))
        return [(name, contents[other.get(name, name)]) for name, _ in members]

    return rewritten(change)


def picture(change):
    def tamper(content):
        file = io.BytesIO()
        Image.fromarray(change(np.array(Image.open(io.BytesIO(content))))).save(file, "PNG")
        return file.getvalue()

    return changed(f"{SECOND}.png", tamper)


def arrays(change):
    def tamper(content):
        file = io.BytesIO()
        np.savez_compressed(file, **change(dict(np.load(io.BytesIO(content)))))
        return file.getvalue()

    return changed(f"{SECOND}.npz", tamper)


def facts(change):
    def tamper(content):
        known = json.loads(content)
        change(known)
        return json.dumps(known).encode()

    return changed(f"{SECOND}.json", tamper)


def table(change, shard=SHARD):
    """Change the rows of a table."""

    def tamper(folder):
        path = folder / "index" / shard.replace(".tar", ".parquet")
        pq.write_table(change(pq.read_table(path)), path)

    return tamper


def cell(column, change):
    """Change one cell of the second row."""

    def tamper(rows):
        values = rows[column].to_pylist()
        values[1] = change(values[1])
        return rows.set_column(rows.column_names.index(column), column, pa.array(values))

    return table(tamper)


def file(name, change):
    """Change the bytes of a file."""

    def tamper(folder):
        (folder / name).write_bytes(change((folder / name).read_bytes()))

    return tamper


def removed(name):
    return lambda folder: (folder / name).unlink()


def moved(source, target):
    return lambda folder: shutil.copy(folder / source, folder / target)


def moved_landmark(known):
    known["landmarks"]["nose_tip"]["pixel"][0] += 1.0


def turned_camera(known):
    known["plan"]["camera"]["yaw"] += 1e-9


def flipped(content):
    place = content.find(b"IDAT") + 40
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


INDEX = "index/shard-000000.parquet"

TAMPERING = {
    "a pixel is brighter": (picture(lambda image: image ^ (np.indices(image.shape).sum(axis=0) == 9)), SHARD, SECOND),
    "a picture is mirrored": (picture(lambda image: image[:, ::-1]), SHARD, SECOND),
    "a picture is smaller": (picture(lambda image: image[::2, ::2]), SHARD, SECOND),
    "a bit is flipped": (file(SHARD, flipped), SHARD, FIRST),
    "pictures are swapped": (swapped(f"{FIRST}.png", f"{SECOND}.png"), SHARD, SECOND),
    "labels are swapped": (swapped(f"{FIRST}.npz", f"{SECOND}.npz"), SHARD, SECOND),
    "facts are swapped": (swapped(f"{FIRST}.json", f"{SECOND}.json"), SHARD, SECOND),
    "a map is zeroed": (arrays(lambda maps: maps | {"height": 0 * maps["height"]}), SHARD, SECOND),
    "a map is missing": (arrays(lambda maps: {k: v for k, v in maps.items() if k != "furrow"}), SHARD, SECOND),
    "a map is of another type": (arrays(lambda maps: maps | {"depth": maps["depth"].astype(float)}), SHARD, SECOND),
    "a part has another label": (arrays(lambda maps: maps | {"part": maps["part"] ^ 1}), SHARD, SECOND),
    "a landmark is moved": (facts(moved_landmark), SHARD, SECOND),
    "the camera is turned": (facts(turned_camera), SHARD, SECOND),
    "furrows are dropped": (facts(lambda known: known.update(furrows=[])), SHARD, SECOND),
    "an expression is renamed": (facts(lambda known: known["plan"].update(expression={"anger": 1.0})), SHARD, SECOND),
    "facts are no JSON": (changed(f"{SECOND}.json", lambda content: content[:-9]), SHARD, SECOND),
    "a file is empty": (changed(f"{SECOND}.png", lambda content: b""), SHARD, SECOND),
    "a file is gone": (rewritten(lambda members: [m for m in members if m[0] != f"{SECOND}.npz"]), SHARD, SECOND),
    "a file is there twice": (rewritten(lambda members: [*members, members[-1]]), SHARD, SECOND),
    "a sample is there twice": (rewritten(lambda members: [*members, *members[:3]]), SHARD, FIRST),
    "a sample is gone": (rewritten(lambda members: members[:3]), SHARD, SECOND),
    "samples are in another order": (rewritten(lambda members: members[3:] + members[:3]), SHARD, SECOND),
    "samples have each other's names": (
        rewritten(lambda members: [(m[0], n[1]) for m, n in zip(members, members[3:] + members[:3], strict=True)]),
        SHARD,
        FIRST,
    ),
    "a file is added": (rewritten(lambda members: [*members, (f"{THIRD}.txt", b"dear")]), SHARD, THIRD),
    "a shard is cut off": (file(SHARD, lambda content: content[: len(content) // 2]), SHARD, SECOND),
    "a shard is cut off after its last file": (file(SHARD, lambda content: content[:-512]), SHARD, SECOND),
    "bytes are appended to a shard": (file(SHARD, lambda content: content + b"dear"), SHARD, SECOND),
    "zeros are appended to a shard": (file(SHARD, lambda content: content + bytes(10240)), SHARD, SECOND),
    "a shard is appended to a shard": (file(SHARD, lambda content: 2 * content), SHARD, SECOND),
    "a shard is no tar": (file(SHARD, lambda content: b"nothing" * 200), SHARD, SECOND),
    "a shard is that of other samples": (moved(OTHER, SHARD), SHARD, THIRD),
    "a shard is gone": (removed(SHARD), SHARD, SHARD),
    "a shard too many": (moved(SHARD, "shard-000007.tar"), "dataset.json", "shard-000007.tar"),
    "a number in the table": (cell("deepest", lambda value: value + 1.0), SHARD, SECOND),
    "a word in the table": (cell("expression", lambda value: "{}"), SHARD, SECOND),
    "a hash in the table": (cell("sha256", lambda value: value[::-1]), SHARD, SECOND),
    "a key in the table": (cell("key", lambda value: THIRD), SHARD, SECOND),
    "an empty cell": (cell("person", lambda value: None), SHARD, SECOND),
    "a column is gone": (table(lambda rows: rows.drop_columns(["camera_yaw"])), SHARD, SECOND),
    "the hashes are gone": (table(lambda rows: rows.drop_columns(["sha256"])), SHARD, SECOND),
    "the keys are gone": (table(lambda rows: rows.drop_columns(["key"])), SHARD, SECOND),
    "columns have each other's names": (
        table(lambda rows: rows.rename_columns({"light_key": "light_fill", "light_fill": "light_key"})),
        SHARD,
        SECOND,
    ),
    "a row is gone": (table(lambda rows: rows.slice(0, 1)), SHARD, SECOND),
    "a row is there twice": (table(lambda rows: pa.concat_tables([rows, rows.slice(1)])), SHARD, SECOND),
    "rows are in another order": (table(lambda rows: rows.take([1, 0])), SHARD, SECOND),
    "a table is that of other samples": (moved("index/shard-000001.parquet", INDEX), SHARD, SECOND),
    "a table is gone": (removed(INDEX), SHARD, "shard-000000.parquet"),
    "a table is cut off": (file(INDEX, lambda content: content[: len(content) // 2]), SHARD, "shard-000000.parquet"),
    "bytes are appended to a table": (file(INDEX, lambda content: content + b"dear"), SHARD, "shard-000000.parquet"),
    "a table is empty": (file(INDEX, lambda content: b""), SHARD, "shard-000000.parquet"),
    "a table has other bytes": (
        file(INDEX, lambda content: content[:4] + bytes(100) + content[104:]),
        SHARD,
        "shard-000000.parquet",
    ),
    "a table too many": (moved(INDEX, "index/more.parquet"), "dataset.json", "more.parquet"),
    "a list of failures that are none": (
        lambda folder: (folder / "shard-000000.failed.json").write_text('[{"index": 1, "error": "no"}]'),
        SHARD,
        SECOND,
    ),
    "a list of failures is cut off": (
        lambda folder: (folder / "shard-000000.failed.json").write_text('[{"index": '),
        SHARD,
        "shard-000000.failed.json",
    ),
    "the specification has another seed": (
        file("dataset.json", lambda content: content.replace(b'"seed": 0', b'"seed": 1')),
        "dataset.json",
        "specification",
    ),
    "the number of samples is another": (
        file("dataset.json", lambda content: content.replace(b'"count": 3', b'"count": 2')),
        "dataset.json",
        OTHER,
    ),
}
"""What is done, and the shard (or file) and the sample (or file) that are named."""


@pytest.mark.parametrize(("tamper", "shard", "sample"), TAMPERING.values(), ids=TAMPERING)
def test_tampering_is_found_and_named(small, tmp_path, tamper, shard, sample):
    folder = tmp_path / "set"
    shutil.copytree(small, folder)
    tamper(folder)
    found = dict(check(folder, remade=0))
    assert any(sample in problem for problem in found[shard]), found
    whole = {"dataset.json", SHARD, OTHER} & {*found} - {shard}
    assert not any(found[name] for name in whole)  # nothing else is wrong


def test_what_was_not_touched_is_well(small):
    assert {name: problems for name, problems in check(small, remade=0) if problems} == {}


def test_a_sample_of_another_set_is_found(small, tmp_path):
    """Its hash is right: that of its files in their order, each after a line with its ending and size."""
    folder = tmp_path / "set"
    shutil.copytree(small, folder)
    facts(lambda known: known.update(spec="0123456789abcdef"))(folder)
    with tarfile.open(folder / SHARD) as tar:
        files = {ending: tar.extractfile(f"{SECOND}.{ending}").read() for ending in ("png", "npz", "json")}
    whole = b"".join(f"{ending} {len(content)}\n".encode() + content for ending, content in files.items())
    cell("sha256", lambda value: hashlib.sha256(whole).hexdigest())(folder)
    assert dict(check(folder, remade=0))[SHARD] == [f"{SECOND} is of another set"]


@pytest.mark.parametrize(
    ("tamper", "sentence"),
    [
        (
            file(SHARD, lambda content: content + b"dear"),
            f"is damaged after {SECOND}: bytes were appended or are missing",
        ),
        (
            lambda folder: (folder / "shard-000000.failed.json").write_text('[{"index": 1, "error": "no"}]'),
            f"shard-000000.failed.json lists {SECOND}, which its table has",
        ),
    ],
    ids=["bytes are appended to a shard", "a list of failures that are none"],
)
def test_one_sentence_tells_what_is_wrong(small, tmp_path, tamper, sentence):
    folder = tmp_path / "set"
    shutil.copytree(small, folder)
    tamper(folder)
    assert dict(check(folder, remade=0))[SHARD] == [sentence]


def test_shards_of_two_sets_are_not_mixed(small, tmp_path):
    """A whole shard with its table, as another version or another seed makes it."""
    folder = tmp_path / "set"
    shutil.copytree(small, folder)
    other = generate({**SPEC, "seed": 1}, tmp_path / "other", count=2)
    for name in (SHARD, INDEX):
        shutil.copy(other / name, folder / name)
    assert dict(check(folder, remade=0))[SHARD] == [f"{key} is of another set" for key in (FIRST, SECOND)]


def test_a_damaged_table_is_told_in_a_line(small, tmp_path, capsys):
    folder = tmp_path / "set"
    shutil.copytree(small, folder)
    (folder / INDEX).write_bytes(b"PAR1")
    assert main(["dataset", "check", str(folder)]) == 1
    out, err = capsys.readouterr()
    assert "shard-000000.parquet" in out
    assert "Remove the shards" in err
    with pytest.raises(OutputError, match=re.escape("shard-000000.parquet")):
        generate(SPEC, folder, count=3)
