"""A stream published by WHIP to a real browser, which shows it in a <video>."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from freelook.bench.browser_receiver import PAGE, Endpoint, answer, seen
from freelook.errors import SinkError
from freelook.latency import draw_stamp
from freelook.sinks import open_sink
from freelook.types import Frame, Picture

SIZE = (320, 192)
STEP_NS = 33_333_000  # stamps are cut to whole microseconds
ENOUGH = 5


class Publisher:
    """Sends stamped pictures from a thread of its own until it is told to stop, or cannot."""

    def __init__(self, address: str) -> None:
        self.stop = threading.Event()
        self.sent: set[int] = set()
        self.failure = ""
        self._address = address
        self._thread = threading.Thread(target=self._run)

    @contextmanager
    def running(self) -> Iterator[None]:
        self._thread.start()
        try:
            yield
        finally:
            self.stop.set()
            self._thread.join(30)

    def wait_for_failure(self) -> str:
        self._thread.join(30)
        return self.failure

    def _run(self) -> None:
        try:
            sink = open_sink(self._address, size=SIZE)
        except SinkError as error:
            self.failure = str(error)
            return
        try:
            while not self.stop.wait(0.03):
                sink.write(self._next())
        except SinkError as error:
            self.failure = str(error)
        finally:
            sink.close()

    def _next(self) -> Frame:
        luma = np.full(SIZE[::-1], 128, np.uint8)
        grey = np.full((SIZE[1] // 2, SIZE[0] // 2), 128, np.uint8)
        time_ns = 10**12 + len(self.sent) * STEP_NS
        draw_stamp(luma, time_ns)
        self.sent.add(time_ns)
        return Frame(Picture("i420", (luma, grey, grey)), time_ns)


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    page = browser.new_page()
    page.set_content(PAGE)
    yield page
    page.close()


def test_a_browser_shows_what_is_published_and_leaves(page: Any) -> None:
    with Endpoint() as endpoint:
        publisher = Publisher(endpoint.url)
        with publisher.running():
            _, offer = endpoint.offers.get(timeout=20)
            endpoint.answers.put(answer(page, offer, SIZE[0]))
            shown = []
            for _, stamp_ns in seen(page, 30):
                shown += [stamp_ns] if stamp_ns is not None else []
                if len(shown) >= ENOUGH:
                    break
            page.evaluate("peer.close()")
            assert "the server left" in publisher.wait_for_failure()
    assert len(shown) >= ENOUGH
    assert shown == sorted(shown)
    assert set(shown) <= publisher.sent
