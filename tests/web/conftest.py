"""Headless Chromium, and pages opened in it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from page_station import PageStation, PageView

from freelook.camera import Camera, make_camera
from freelook.lens import Equidistant

FLAGS = [
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--autoplay-policy=no-user-gesture-required",
    "--force-color-profile=srgb",
    "--disable-features=WebRtcHideLocalIpsWithMdns",  # a page that calls itself must find itself
]
# Mesa's software GL draws three times as fast as Chromium's own, where it is installed.
MESA = ["--use-angle=gl-egl", "--ignore-gpu-blocklist"]
CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "chrome")


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    sync_api = pytest.importorskip("playwright.sync_api")
    path = next(filter(None, map(shutil.which, CHROMIUM)), None)
    if path is None:
        pytest.skip("Chromium is not installed; scripts/test installs it")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS + MESA)
        if not _has_webgl2(browser):
            browser.close()
            browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


def _has_webgl2(browser: Any) -> bool:
    page = browser.new_page()
    found = page.evaluate("!!document.createElement('canvas').getContext('webgl2')")
    page.close()
    return bool(found)


@pytest.fixture(scope="session")
def page_station() -> Iterator[PageStation]:
    with PageStation(default_camera()) as station:
        yield station


def default_camera() -> Camera:
    return make_camera((320, 240), Equidistant(f=70.0), field_deg=188)


OpenPage = Callable[..., PageView]
WINDOW = {"width": 640, "height": 480}


@pytest.fixture(scope="session")
def plain_context(browser: Any) -> Iterator[Any]:
    """Keeps the page's files in its cache, so that most pages open quickly."""
    context = browser.new_context(viewport=WINDOW)
    yield context
    context.close()


@pytest.fixture
def open_page(browser: Any, plain_context: Any, page_station: PageStation) -> Iterator[OpenPage]:
    """`open_page(camera, trackers=[...], query="", **context)`: a page of its own; errors on it
    fail the test."""
    pages: list[Any] = []
    errors: list[str] = []

    def open_it(
        camera: Camera | None = None,
        *,
        trackers: list[str] | None = None,
        query: str = "",
        ready: bool = True,
        script: str | None = None,
        **options: Any,
    ) -> PageView:
        page_station.camera = camera or default_camera()
        page_station.trackers = trackers or []
        page_station.controls.clear()
        page_station.requests.clear()
        context = (
            browser.new_context(**{"viewport": WINDOW, **options}) if options else plain_context
        )
        page = context.new_page()
        pages.append(page)
        page.set_default_timeout(15000)
        page.on("pageerror", lambda error: errors.append(str(error)))
        if script:
            page.add_init_script(script)
        page.goto(page_station.url + query)
        view = PageView(page)
        if ready:
            view.until("window.freelook?.ready")
        return view

    yield open_it
    for page in pages:
        page.evaluate("localStorage.clear()")
        page.close()
        if page.context is not plain_context:
            page.context.close()
    page_station.token = None
    page_station.control_answer = 204
    assert not errors


@pytest.fixture
def view(open_page: OpenPage) -> PageView:
    """A page with the default camera and no trackers."""
    return open_page()
