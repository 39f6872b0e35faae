"""The whole way, as flown: camera, station and a real browser, each in its own process."""

from __future__ import annotations

import os
import signal
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import running, stop
from numpy.typing import NDArray
from page_station import PageView

from freelook.color import rgb_from_picture
from freelook.datagrams import free_port
from freelook.formats import load_camera
from freelook.media.decoder import Decoder
from freelook.renderers.cpu import CpuRenderer
from freelook.rotations import body_from_view
from freelook.sources import open_source
from freelook.viewport import Viewport

pytestmark = pytest.mark.browser

WaitUntil = Callable[..., None]
VIEW = Viewport((480, 360), 80.0)


@contextmanager
def opened(browser: Any, url: str) -> Iterator[PageView]:
    """The station's page; whatever it complains about fails the test."""
    context = browser.new_context(viewport={"width": 640, "height": 480})
    page = context.new_page()
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    try:
        page.goto(url)
        yield PageView(page)
    finally:
        context.close()
    assert complaints == []


@contextmanager
def head(port: int, yaw_deg: float, pitch_deg: float, roll_deg: float) -> Iterator[None]:
    """A head that OpenTrack reports 250 times a second (with its sign of roll)."""
    done = threading.Event()
    packet = struct.pack("<6d", 0, 0, 0, yaw_deg, pitch_deg, -roll_deg)

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not done.wait(1 / 250):
                sender.sendto(packet, ("127.0.0.1", port))

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    yield
    done.set()
    thread.join()


def drawn(page: PageView) -> int:
    return int(page.js("window.freelook?.stats().drawn ?? 0"))


def is_near(page: PageView, angles: tuple[float, float, float]) -> bool:
    return bool(np.allclose(page.head(), angles, atol=1e-3))


def test_demo_shows_a_moving_world_and_a_moving_head(browser: Any, wait_until: WaitUntil) -> None:
    with running("demo") as (process, url), opened(browser, url) as page:
        wait_until(lambda: drawn(page) > 10, 90, "pictures in the page")
        stats = page.stats()
        assert stats["head"] == "wander"
        assert stats["size"] in ([720, 720], [960, 960])  # few cores, or more
        first = page.head()
        wait_until(lambda: not is_near(page, first), 5, "another direction")
        page.set_head(0, 0)
        page.set_view(320, 240, 90)
        before = page.view().astype(int)
        count = drawn(page)
        assert before.std() > 10
        wait_until(lambda: drawn(page) > count + 5, 20, "more pictures")
        assert np.abs(page.view() - before).mean() > 1
        status, _, errors = stop(process)
    assert (status, errors) == (0, "")


def test_demo_says_why_when_its_camera_dies(wait_until: WaitUntil) -> None:
    with running("demo") as (process, _):
        os.kill(wait_for_child(process.pid, wait_until), signal.SIGKILL)
        assert process.wait(20) == 2
        assert process.stderr is not None
        assert "the simulated camera ended" in process.stderr.read()


def wait_for_child(parent: int, wait_until: WaitUntil) -> int:
    children = Path(f"/proc/{parent}/task/{parent}/children")
    wait_until(lambda: children.read_text().split(), 20, "a child process")
    return int(children.read_text().split()[0])


@pytest.mark.data
def test_real_video_turns_by_the_angles_of_the_head(
    browser: Any, wait_until: WaitUntil, shared_data: Path
) -> None:
    """The picture in the page is the one the CPU renderer makes of the same frame and pose."""
    video = shared_data / "lilyth_video" / "cam2.mp4"
    lens = shared_data / "lilyth_video" / "author_calibration.json"
    port = free_port()
    tracker = ["--tracker", f"opentrack:{port}"]
    angles = (30.0, 10.0, -5.0)
    with (
        running("fly", str(video), "--lens", str(lens), "--loop", *tracker) as (_, url),
        head(port, *angles),
        opened(browser, url) as page,
    ):
        wait_until(lambda: drawn(page) > 3, 60, "pictures in the page")
        wait_until(lambda: is_near(page, angles), 10, f"the head at {angles}")
        page.set_view(*VIEW.size, VIEW.hfov_deg)
        view = page.view() / 255.0
    right, mirrored, off = (
        best_psnr(view, video, lens, turned)
        for turned in (angles, (-30.0, 10.0, -5.0), (31.0, 10.0, -5.0))
    )
    print(f"page against CPU renderer: {right:.1f} dB; 1 degree off {off:.1f} dB")
    assert right > 35
    assert mirrored < off < right - 6


def best_psnr(
    view: NDArray[np.float64], video: Path, lens: Path, angles: tuple[float, float, float]
) -> float:
    """Over all frames of the video, since nobody knows which one the page showed."""
    camera = load_camera(lens)
    camera_from_view = camera.camera_from_body * body_from_view(*angles)
    renderer, decoder = CpuRenderer(), Decoder()
    best = 0.0
    for unit in open_source(str(video), pace=False).units():
        for frame in decoder.decode(unit):
            own = rgb_from_picture(renderer.render(frame.picture, camera, camera_from_view, VIEW))
            best = max(best, float(-10 * np.log10(np.mean((own - view) ** 2))))
    return best
