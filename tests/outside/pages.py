"""Run the Python of README and of the pages of the site, each from a folder of its own: python pages.py [page ...]

The code blocks of a page run in turn, with fewer people, frames, shapes and texels. A page is named by its file, such
as "start"; default: all.
"""

import itertools
import re
import sys
import tempfile
import textwrap
import time
import warnings
from contextlib import ExitStack, chdir
from importlib.util import find_spec
from pathlib import Path
from unittest import mock

import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.export import write_series
from facewrinkle.mesh import to_polydata

DOCS = Path(__file__).parents[2] / "docs"
README = DOCS.parent / "README.md"
PAGES = sorted(page for folder in (DOCS, DOCS / "howto", DOCS / "theory") for page in folder.glob("*.rst"))

FEWER = {
    r"sim\.run\(\d+\)": "sim.run(3)",
    r"for i in range\(\d+\)": "for i in range(3)",
    r"for seed in range\(100\)": "for seed in range(1)",
    r"fw\.rig\((face|fw\.fit_face\([^)]*\))": r'fw.rig(\1, "browInnerUp+jawOpen"',
    r'"browInnerUp\+jawOpen", "[^"]*"': '"browInnerUp+jawOpen"',
    r"set_active_time_value\(0\.5\)": "set_active_time_value(0.02)",
    "size=2048": "size=256",
    r"000000\.\.000009": "000000..000000",
    "window.wait()": "",
    r"clip\.glb": "clip.vtkhdf",
}
"""What makes the code of pages shorter: frames, people, shapes, texels, shards and waiting."""

ELSEWHERE = re.compile(r"\bimport (bpy|maya)\b|\bhou\.")
"""In blocks for the Python of other programs: these only compile."""


def main() -> None:
    """Run the pages in turn; the first that does not do what it says ends it."""
    assert fw.__file__.startswith(sys.prefix), f"{fw.__file__} is not that of {sys.prefix}"
    pv.OFF_SCREEN = True
    for page in [README, *PAGES]:
        blocks = [block for block in code_of(page) if not ELSEWHERE.search(block)]
        if find_spec("torch") is None:
            blocks = [block for block in blocks if "torch" not in block]
        if not blocks or (sys.argv[1:] and page.stem not in sys.argv[1:]):
            continue
        began = time.monotonic()
        with tempfile.TemporaryDirectory() as folder, chdir(folder):
            run(page, "\n".join(blocks))
        print(f"{time.monotonic() - began:5.1f} s  {page.relative_to(DOCS.parent)}", flush=True)


def code_of(page: Path) -> list[str]:
    """Return the Python of a page, in blocks."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".md":
        return re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    blocks = []
    for part in text.split(".. code-block:: python\n\n")[1:]:
        dent = re.match(" +", part)[0]  # type: ignore[index]
        block = itertools.takewhile(lambda line, dent=dent: not line or line.startswith(dent), part.splitlines())
        blocks.append(textwrap.dedent("\n".join(block)))
    return blocks


def run(page: Path, code: str) -> None:
    """Run code in the present folder, with the files that pages name, and look at what came of it."""
    prepare(page.stem)
    for long, short in FEWER.items():
        code = re.sub(long, short, code)
    space = {"__name__": page.stem, "print": lambda *_: None}
    with ExitStack() as windows, warnings.catch_warnings():
        warnings.simplefilter("error")
        for kind in (DeprecationWarning, ResourceWarning):  # of other packages
            warnings.simplefilter("ignore", kind)
        if "fw.studio" in code:  # it needs an extra
            studio = fw.studio
            quiet = mock.patch.object(
                fw, "studio", lambda face, **_: windows.enter_context(studio(face, browser=False))
            )
            windows.enter_context(quiet)
        exec(compile(code, str(page), "exec"), space)
    look(page.stem, space)


def prepare(page: str) -> None:
    """Write the files that pages name."""
    face = fw.default_face()
    for name in ("scan.obj", "head.obj"):
        pv.PolyData.from_regular_faces(0.1 * face.points, face.triangles).save(name)
    names = [name for name in face.landmarks if not name.endswith("_centre")]
    fw.anatomy.landmarks.write_landmarks({name: 0.1 * face.landmarks[name] for name in names}, "landmarks.json")
    Path("take.csv").write_text("time,mouthSmileLeft\n0,0\n0.1,0.4\n")
    frames = [to_polydata(face.points + shift, face.triangles) for shift in (0.0, 0.1)]
    write_series(frames, [0.0, 0.1], "clip.vtkhdf")
    if page == "dataset":
        fw.dataset.generate({"size": [64, 64], "shard": 2}, "dataset", count=2)


def look(page: str, space: dict) -> None:
    """See that pages made what they say."""
    if page == "scan":
        assert abs(space["face"].unit / 10.0 - 1.0) < 0.02
        assert np.abs(space["frame"]["W"]).max() > 0.3
    if page == "expression":
        assert "procerus" in space["sim"].face.muscles
    if page == "animation":
        assert abs(space["take"].duration - 0.1) < 1e-6
    if page in ("start", "README"):
        assert Path("surprise.png").stat().st_size > 10_000


if __name__ == "__main__":
    main()
