"""Make data sets of one's own heads by the command line, check them, and read them in each way.

python read_dataset.py

Readers that are not installed are named.
"""

import re
import runpy
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import facewrinkle as fw

COUNT, SIZE = 10, 32
SHARES = {"own": 0.0, "mixed": 0.5}
"""Names of sets, and how often each shows the built-in head."""

DOCS = Path(__file__).parents[2] / "docs" / "howto" / "dataset.rst"


def command(*words: str) -> None:
    """Run a command; what it prints is that of this script."""
    subprocess.run([sys.executable, "-m", "facewrinkle", *words], check=True)


def make() -> None:
    """Make both sets; the first samples of neither have all that later ones have."""
    fw.write_face(fw.default_face(fw.Identity.random(3)), "anna.face")
    for name, share in SHARES.items():
        scans = f'built_in = {share}\nscans = [{{ path = "anna.face", weight = {1 - share}, licence = "CC0" }}]'
        Path(f"{name}.toml").write_text(f"size = [{SIZE}, {SIZE}]\nshard = 5\nper_person = 1\n[faces]\n{scans}\n")
        command("dataset", f"{name}.toml", "--count", str(COUNT), "--out", name)
        command("dataset", "check", name)


def webdataset(name: str) -> None:
    """All samples, with arrays and facts."""
    from webdataset import WebDataset

    samples = list(WebDataset(f"{name}/shard-{{000000..000001}}.tar", shardshuffle=False).decode("rgb8"))
    assert len(samples) == COUNT
    assert all(sample["png"].shape == (SIZE, SIZE, 3) for sample in samples)
    entries = {tuple(sorted(sample["json"]["person"])) for sample in samples}
    assert len(entries) == 1, "all have the same entries"
    scans = {sample["json"]["person"]["scan"] for sample in samples}
    assert scans == ({"anna.face"} if name == "own" else {"anna.face", ""})


def pandas(name: str) -> None:
    """All rows, with a column for each action unit, and none empty."""
    from pandas import read_parquet

    table = read_parquet(f"{name}/index")
    assert len(table) == COUNT
    assert not table.isna().to_numpy().any()
    assert (table["AU12"] > 0.0).any()
    assert set(table.dtypes[["AU12", "identity_age"]].astype(str)) == {"float64"}


def datasets(name: str) -> None:
    """As people call it, as a stream, and by the card in the folder."""
    from datasets import load_dataset

    files, cache = f"{name}/shard-*.tar", f"cache_{name}"
    whole = load_dataset("webdataset", data_files=files, split="train", cache_dir=cache)
    for pictures in (whole, load_dataset("webdataset", data_files=files, split="train", streaming=True)):
        facts = [sample["json"] for sample in pictures]
        assert len(facts) == COUNT
        assert {fact["furrows"][0]["number"] for fact in facts} == {0}
    assert load_dataset(f"./{name}", split="train", cache_dir=cache).num_rows == COUNT
    table = load_dataset("parquet", data_files=f"{name}/index/*.parquet", split="train", cache_dir=cache)
    assert table.num_rows == COUNT


def torch(name: str) -> None:
    """The class of the page on data sets, in the loader of PyTorch."""
    block = next(part for part in re.split(r"\.\. code-block:: python\n\n", DOCS.read_text()) if "torch.utils" in part)
    lines = [line.removeprefix("   ") for line in block.split("\n") if not line.strip() or line.startswith("   ")]
    script = Path("faces.py")
    script.write_text("\n".join(lines).replace("dataset/", f"{name}/"))
    made = runpy.run_path(str(script))
    assert tuple(made["pictures"].shape) == (4, 3, SIZE, SIZE)
    assert tuple(made["heights"].shape) == (4, 1, SIZE, SIZE)
    assert np.abs(made["heights"].numpy()).max() > 0.1


def main() -> None:
    """Make and read."""
    make()
    for reader in (webdataset, pandas, datasets, torch):
        if find_spec(reader.__name__) is None:
            print(f"{reader.__name__} is not installed: it was not tried.")
            continue
        for name in SHARES:
            reader(name)
        print(f"{reader.__name__} reads both sets.")


if __name__ == "__main__":
    main()
