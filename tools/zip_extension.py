"""PYTHON tools/zip_extension.py [FILE]: the extension for Blender as a file to install, by default in dist/."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def main(target: Path) -> None:
    """Zip the extension with the licence."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as whole:
        for path in [*sorted((ROOT / "blender").glob("*.*")), ROOT / "LICENSE"]:
            whole.write(path, path.name)
    print(target)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "dist" / "facewrinkle-blender.zip")
