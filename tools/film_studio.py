"""Film a walk through the studio, and take its picture, without a window.

``python -m tools.film_studio docs/_static/studio.mp4 docs/images/studio.png`` needs chromium and playwright, as the
tests of the page do. Each picture is taken when the face is at rest or has moved on a little, so that the film is as
long on any computer.
"""

from __future__ import annotations

import io
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import facewrinkle as fw
from facewrinkle.export import write_movie
from facewrinkle.live import Studio

FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--enable-unsafe-swiftshader"]
FPS = 12.0


class Film:
    """Pictures of a page, and where the pointer is in them."""

    def __init__(self, page: Any, studio: Studio) -> None:
        self.page, self.studio, self.pictures = page, studio, list[np.ndarray]()
        self.pointer = (640.0, 380.0)

    def shoot(self, count: int = 1, still: bool = False) -> None:
        """Take pictures; `still` waits until the face is at rest, and shows one picture `count` times."""
        if still:
            self.studio.frame()
            self.page.wait_for_timeout(700)
        for _ in range(1 if still else count):
            image = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
            self._point(image)
            picture = np.asarray(image.resize((960, 570), Image.Resampling.LANCZOS))
            self.pictures += [picture] * (count if still else 1)

    def _point(self, image: Image.Image) -> None:
        from PIL import ImageDraw

        x, y = self.pointer
        arrow = [(0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12)]
        ImageDraw.Draw(image).polygon([(x + a, y + b) for a, b in arrow], fill="white", outline="black")

    def move(self, x: float, y: float, steps: int = 5) -> None:
        """Lead the pointer somewhere."""
        start = self.pointer
        for k in range(1, steps + 1):
            self.pointer = (start[0] + (x - start[0]) * k / steps, start[1] + (y - start[1]) * k / steps)
            self.page.mouse.move(*self.pointer)
            self.shoot()

    def to(self, selector: str, steps: int = 5) -> None:
        """Lead the pointer to the middle of something."""
        box = self.page.locator(selector).first.bounding_box()
        self.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps)

    def click(self, selector: str) -> None:
        """Lead the pointer to something, and click."""
        self.to(selector)
        self.page.mouse.click(*self.pointer)
        self.shoot(2)

    def pull(self, label: str, share: float, steps: int = 8) -> None:
        """Pull a slider to a share of its length."""
        selector = f"input[type=range][aria-label='{label}']"
        self.page.locator(selector).scroll_into_view_if_needed()
        box = self.page.locator(selector).bounding_box()
        now = self.page.evaluate("(e) => (e.value - e.min) / (e.max - e.min)", self.page.query_selector(selector))
        at = [box["x"] + 6 + (box["width"] - 12) * part for part in (now, share)]
        self.move(at[0], box["y"] + box["height"] / 2, 4)
        self.page.mouse.down()
        self.move(at[1], self.pointer[1], steps)
        self.page.mouse.up()
        self.shoot(10, still=True)

    def on_face(self, name: str) -> tuple[float, float]:
        """Return the pixel at which a landmark is seen."""
        at = self.page.evaluate("(n) => { const l = app.face.landmarks[n]; return app.view.project(l.place); }", name)
        box = self.page.locator("#canvas").bounding_box()
        return box["x"] + at["x"], box["y"] + at["y"]


def walk(film: Film) -> None:
    """Pull a muscle, smile, deepen crow's feet on one side, put a dimple, let a tear run, look aside, take it back."""
    page = film.page
    film.shoot(10, still=True)
    film.move(640.0, 330.0)
    for _ in range(6):
        page.mouse.wheel(0, -45)
        film.shoot()
    film.shoot(3, still=True)
    film.click("#muscles")
    film.to("[data-handle=zygomaticus_major_l]")
    x, y = film.pointer
    way = page.evaluate("app.overlay.handles.find((each) => each.name === 'zygomaticus_major_l').way()")
    page.mouse.down()
    film.move(x + 0.8 * way["x"], y + 0.8 * way["y"], 8)
    page.mouse.up()
    film.shoot(6, still=True)
    film.click("#undo")
    film.click("#muscles")
    film.pull("Happiness", 1.0)
    film.pull("Folds: Left side", 0.6)
    x, y = film.on_face("eye_l_outer")
    film.move(x + 32, y + 6)
    page.mouse.click(*film.pointer)
    film.shoot(18, still=True)
    page.keyboard.press("Escape")
    film.click("#tab-patterns")
    film.click("button:text-is('Dimple')")
    x, y = film.on_face("mouth_l")
    film.move(x + 42, y - 8)
    page.mouse.click(*film.pointer)
    film.shoot(12, still=True)
    film.click("#tab-tears")
    film.click("button:text-is('Place a tear')")
    film.move(*film.on_face("malar_r"))
    page.mouse.click(film.pointer[0] + 14, film.pointer[1] - 16)
    for _ in range(10):
        page.wait_for_timeout(250)
        film.shoot()
    film.shoot(8, still=True)
    x, y = film.on_face("eye_l_outer")
    film.move(x - 27, y - 4)
    page.mouse.down()
    film.move(x - 9, y - 8, 7)
    page.mouse.up()
    film.shoot(10, still=True)
    film.click("#undo")
    film.shoot(4, still=True)
    film.click("#reset")
    film.shoot(12, still=True)


def smile(page: Any, studio: Studio) -> None:
    """Show a smile from aside, with what made a fold beside the eye."""
    warm = {"AU6": 1.0, "AU12": 0.8}
    studio.change(mixture=warm, mixtures={"Warm smile": warm}, folds={"left": 1.8})
    page.set_viewport_size({"width": 1280, "height": 800})
    page.locator("#tab-folds").click()
    page.evaluate("""() => {
      app.view.take("front");
      app.view.camera.turn(-0.65, 0.03);
      app.view.camera.zoom(0.75);
      app.view.camera.pan(-0.08, 0);
      app.turned();
      app.view.request();
      [...document.querySelectorAll("#sliders h2")].find((title) => title.textContent === "Eyes").scrollIntoView();
    }""")
    studio.frame()
    page.wait_for_timeout(2500)
    at = page.evaluate("app.view.project(app.face.landmarks.eye_l_outer.place)")
    box = page.locator("#canvas").bounding_box()
    page.mouse.click(box["x"] + at["x"] + 45, box["y"] + at["y"] + 6)
    page.wait_for_timeout(3000)


def main() -> None:
    """Write the film and the picture to the paths that are given."""
    from playwright.sync_api import sync_playwright

    path = shutil.which("chromium") or shutil.which("google-chrome")
    with Studio(fw.default_face(), browser=False) as studio, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=FLAGS)
        page = browser.new_page(viewport={"width": 1280, "height": 760})
        page.goto(studio.url)
        page.wait_for_selector("body[data-step]", timeout=60_000)
        film = Film(page, studio)
        walk(film)
        smile(page, studio)
        page.screenshot(path=sys.argv[2])
        browser.close()
    write_movie(film.pictures, Path(sys.argv[1]), fps=FPS)
    print(f"{len(film.pictures)} pictures, {Path(sys.argv[1]).stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
