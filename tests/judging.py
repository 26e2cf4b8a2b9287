"""Judges in JavaScript: FACEWRINKLE_NODE_MODULES names a folder with gltf-validator, three and puppeteer-core."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

JUDGES = Path(__file__).parent / "rigging" / "judges"
NODE_MODULES = os.environ.get("FACEWRINKLE_NODE_MODULES", "")


def judged(script, *arguments):
    """What a judge in JavaScript prints."""
    if shutil.which("node") is None or not Path(NODE_MODULES, "gltf-validator").exists():
        pytest.skip("FACEWRINKLE_NODE_MODULES names no folder with gltf-validator, three and puppeteer-core")
    command = ["node", JUDGES / script, NODE_MODULES, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
