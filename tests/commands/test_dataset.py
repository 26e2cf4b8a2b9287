"""``facewrinkle dataset``: what it makes, checks and prints; samples themselves are not drawn here."""

from dataclasses import asdict

import numpy as np
import pytest
from PIL import Image

from facewrinkle.cli import main
from facewrinkle.dataset import Sample, SampleMaker, Spec, generation, shards
from facewrinkle.dataset.plan import person_of, plan_of
from facewrinkle.dataset.spec import DEFAULT

pytest.importorskip("pyarrow", reason="data sets need pyarrow")


GAP = 4
"""Pixels between the pictures of a sheet."""


class Gray(SampleMaker):
    """Makes gray samples, as bright as their number, at once; the second draw of every third is the good one."""

    def pictures(self, index):
        plan = plan_of(self.spec, index, attempt=int(index % 3 == 2))
        facts = {"plan": asdict(plan), "person": asdict(person_of(self.spec, plan.person)), "landmarks": {}}
        facts |= {"furrows": [], "action_units": {}, "contractions": {}, "files": {}, "refused": []}
        facts |= {"size": list(self.spec.size), "spec": self.spec.digest}
        shape = self.spec.size[::-1]
        labels = {"depth": np.zeros(shape, np.uint16), "part": np.zeros(shape, np.uint8)}
        return [Sample(index, np.full((*shape, 3), index, np.uint8), labels, facts)]


@pytest.fixture
def gray(tmp_path, monkeypatch):
    """A specification of gray samples."""
    for module in (generation, shards):
        monkeypatch.setattr(module, "SampleMaker", Gray)
    path = tmp_path / "gray.toml"
    path.write_text("size = [16, 16]\nshard = 2\n", encoding="utf-8")
    return path


def test_a_set_is_made_and_checked(gray, tmp_path, run):
    out = tmp_path / "set"
    told = " ".join(run("dataset", str(gray), "--out", str(out), "--count", "6").out.split())
    assert "6 pictures of 6 samples; " in told
    assert "2 were drawn anew" in told
    assert "33.3% were drawn again" in " ".join((out / "README.md").read_text(encoding="utf-8").split())
    assert "all is well" in run("dataset", "check", str(out)).out
    (out / "shard-000001.tar").unlink()
    out_text, err = run("dataset", "check", str(out), code=1)
    assert "shard-000001.tar is missing" in out_text
    assert "Remove the shards that are named, with their tables in index/, and run" in " ".join(err.split())
    assert main(["dataset", str(gray), "--out", str(out), "--count", "6", "--quiet"]) == 0
    assert main(["dataset", "check", str(out)]) == 0


def test_a_preview_shows_24_people(gray, tmp_path):
    assert main(["dataset", str(gray), "--out", str(tmp_path / "set"), "--preview"]) == 0
    with Image.open(tmp_path / "set.png") as sheet:
        assert sheet.size == (6 * 16 + 5 * GAP, 4 * 16 + 3 * GAP)
        shown = np.asarray(sheet.convert("L"))[8 :: 16 + GAP, 8 :: 16 + GAP].ravel()
    assert shown.tolist() == [10 * person for person in range(24)]
    assert not (tmp_path / "set").exists()


def test_the_default_is_printed_as_a_file_to_edit(tmp_path, capsys):
    assert main(["dataset", "spec"]) == 0
    path = tmp_path / "mine.toml"
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    assert path.read_text(encoding="utf-8") == DEFAULT.read_text(encoding="utf-8")
    assert Spec.read(path).digest == Spec.of().digest


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["check"], "name the folder of the set"),
        (["check", "nowhere"], "holds no data set"),
        (["nothing.toml"], "cannot be read"),
        (["spec.toml", "folder"], "a folder is named with check only"),
        (["spec", "folder"], "a folder is named with check only"),
        (["--preview", "--out", "."], "--out must name the folder of the set, received '.'"),
        (["--preview", "--out", ".."], "--out must name the folder of the set, received '..'"),
    ],
)
def test_what_makes_no_sense_is_told_in_a_line(arguments, message, run):
    assert message in " ".join(run("dataset", *arguments, code=1).err.split())
