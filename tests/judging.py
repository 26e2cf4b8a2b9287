"""Judges in JavaScript, and what browsers show.

FACEWRINKLE_NODE_MODULES names a folder with gltf-validator, three and puppeteer-core.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

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


def path_of_chromium():
    """The path of a browser; skips where there is none."""
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    return path or pytest.skip("there is no chromium")


def shot(page, picture, hash_="", size=(800, 500)):
    """What chromium shows of the page of a rig once it is at rest."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = path_of_chromium()
    flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    width, height = size
    with (
        playwright.sync_playwright() as driver,
        driver.chromium.launch(executable_path=path, args=flags) as browser,
    ):
        tab = browser.new_page(viewport={"width": width, "height": height})
        tab.goto(f"{page.as_uri()}{hash_}")
        tab.wait_for_function("window.rig?.still()", timeout=60_000)
        tab.screenshot(path=picture)
    return np.asarray(Image.open(picture).convert("RGB"), dtype=float)[:, : width - 320]
