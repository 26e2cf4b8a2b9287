"""Build the source distribution and, from it, the wheel; install the wheel into a bare environment; run it elsewhere.

python -m tools.check_package
"""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import tempfile
import venv
from pathlib import Path
from zipfile import ZipFile

REPOSITORY = Path(__file__).parents[1]
NEEDED = ("facewrinkle/py.typed", "facewrinkle/__init__.pyi", "facewrinkle/anatomy/data/atlas.toml")


def main() -> None:
    """Build, install, run; an error ends it."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        build, bare = _environment(place / "build"), _environment(place / "bare")
        _run(build, "-m", "pip", "install", "--quiet", "build")
        _run(build, "-m", "build", "--outdir", str(place / "dist"), str(REPOSITORY))
        (wheel,), (source,) = (place / "dist").glob("*.whl"), (place / "dist").glob("*.tar.gz")
        names = ZipFile(wheel).namelist()
        assert set(NEEDED) <= set(names), names
        assert {name.split("/")[0].partition("-")[0] for name in names} == {"facewrinkle"}, names
        with tarfile.open(source) as archive:
            assert any(name.endswith("atlas.toml") for name in archive.getnames())
        _run(bare, "-m", "pip", "install", "--quiet", f"{wheel}[export]")
        where = "import facewrinkle, sys; assert facewrinkle.__file__.startswith(sys.prefix), facewrinkle.__file__"
        _run(bare, "-c", where, cwd=place)
        for arguments in (["--version"], ["info", "expressions"], ["express", "surprise", "--frames", "6"]):
            out = ["--size", "160", "--out", "out"] if "express" in arguments else []
            _run(bare, "-m", "facewrinkle", *arguments, *out, cwd=place)
        written = sorted(path.name for path in (place / "out").iterdir())
        assert {"surprise.mp4", "surprise.png"} <= set(written), written
        print(f"{wheel.name} ({wheel.stat().st_size / 1e6:.1f} MB) runs by itself")


def _environment(folder: Path) -> Path:
    """Make an empty environment, and return its Python."""
    venv.create(folder, with_pip=True)
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _run(python: Path, *arguments: str, cwd: Path | None = None) -> None:
    """Run a Python without what points to the repository."""
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    print(f"{python.parent.parent.name}: {' '.join(arguments)}", file=sys.stderr)
    subprocess.run([python, *arguments], check=True, cwd=cwd, env=environment)


if __name__ == "__main__":
    main()
