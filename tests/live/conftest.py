"""A studio on the built-in face, and a browser where there is one."""

from pathlib import Path

import pytest
from judging import path_of_chromium

pytest.importorskip("aiohttp", reason="the studio needs aiohttp")

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--enable-unsafe-swiftshader",
)  # fmt: skip


@pytest.fixture(scope="package")
def saved(tmp_path_factory) -> Path:
    """The folder that the studio may write to."""
    return tmp_path_factory.mktemp("saved")


@pytest.fixture(scope="package")
def studio_of_package(face, saved):
    from facewrinkle.live import Studio

    with Studio(face, browser=False, save_to=saved) as studio:
        yield studio


@pytest.fixture
def studio(studio_of_package):
    """A studio in which nothing is set."""
    from facewrinkle.session.session import START

    stage = studio_of_package.stage
    stage.live({})
    stage.play(False)
    stage.go_to(0.0)
    studio_of_package.session = START
    studio_of_package.frame()
    return studio_of_package


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window; skips where there is none. Its driver keeps an event loop running in this thread, so
    it ends with its module: other tests run loops of their own.
    """
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = path_of_chromium()
    with playwright.sync_playwright() as driver:
        try:
            chromium = driver.chromium.launch(executable_path=path, args=list(FLAGS))
        except playwright.Error as error:
            pytest.skip(f"chromium does not start: {str(error).splitlines()[0]}")
        yield chromium
        chromium.close()


@pytest.fixture
def opened(browser):
    """Opens pages of a studio, and closes them after the test; `before` is called with a page that is still empty."""
    pages = []

    def opened(url, before=lambda page: None, width=1180, height=560, **options):
        page = browser.new_page(viewport={"width": width, "height": height}, **options)
        pages.append(page)
        before(page)
        page.goto(url)
        page.wait_for_selector("body[data-step]", timeout=60_000)
        return page

    yield opened
    for page in pages:
        page.close()


@pytest.fixture
def page(opened, studio):
    """The page of the studio, small, with the errors of its console collected."""
    errors = []

    def listen(page):
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))

    yield opened(studio.url, listen)
    assert not errors
