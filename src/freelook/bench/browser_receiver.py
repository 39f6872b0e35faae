"""Chromium as the other end of WHIP: a page that answers the offer and shows the video."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from ..clock import NS_PER_MS, now_ns
from ..errors import FreelookError
from ..latency import BLOCK_PX, time_of
from .page_latency import FLAGS, browser_path
from .receivers import SIZE, Seen, Stream

ANSWER_S = 20.0
POLL_MS = 100
PINGS = 20

# The stamp is read where a viewer sees it: from what the <video> element shows.
PAGE = """<!doctype html><video muted autoplay playsinline></video>"""
ANSWER = """async ([offer, width, rows, block]) => {
  const peer = window.peer = new RTCPeerConnection(), seen = window.seen = [];
  const video = document.querySelector('video');
  const canvas = new OffscreenCanvas(width, rows), options = { willReadFrequently: true };
  const context = canvas.getContext('2d', options), across = Math.floor(width / block);
  const shown = () => {
    context.drawImage(video, 0, 0);
    const data = context.getImageData(0, 0, width, rows).data, bits = [];
    for (let i = 0; i < 56; i++) {
      const x = (i % across + 0.5) * block, y = (Math.floor(i / across) + 0.5) * block;
      bits.push(data[4 * (y * width + x)] > 124 ? 1 : 0);
    }
    seen.push([performance.now(), bits.join('')]);
    video.requestVideoFrameCallback(shown);
  };
  video.requestVideoFrameCallback(shown);
  peer.ontrack = ({ track, receiver }) => {
    receiver.jitterBufferTarget = 0;
    video.srcObject = new MediaStream([track]);
  };
  await peer.setRemoteDescription({ type: 'offer', sdp: offer });
  await peer.setLocalDescription(await peer.createAnswer());
  if (peer.iceGatheringState !== 'complete') {
    await new Promise((done) => peer.addEventListener('icegatheringstatechange',
      () => peer.iceGatheringState === 'complete' && done()));
  }
  return peer.localDescription.sdp;
}"""


class Chromium:
    """Headless Chromium; its jitter buffer is asked to be as short as possible."""

    name = "Chromium"
    streams: Sequence[str] = ("whip",)

    def __init__(self) -> None:
        self._page: Any = None
        self._endpoint: Endpoint | None = None

    def missing(self) -> str | None:
        if browser_path() is None:
            return "no Chromium or Chrome here"
        try:
            import playwright.sync_api  # noqa: F401
        except ImportError:
            return "playwright is not installed (pip install 'freelook[bench]')"
        return None

    @contextmanager
    def ready(self) -> Iterator[str]:
        """Yields the address to publish to."""
        from playwright.sync_api import sync_playwright

        flags = [*FLAGS, "--disable-features=WebRtcHideLocalIpsWithMdns"]
        with Endpoint() as endpoint, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=browser_path(), args=flags)
            self._endpoint, self._page = endpoint, browser.new_page()
            self._page.set_content(PAGE)
            yield endpoint.url
            browser.close()

    @contextmanager
    def receive(self, stream: Stream, seconds: float) -> Iterator[tuple[int, Seen]]:
        """From when the offer came. FreelookError when none comes."""
        assert self._endpoint is not None
        try:
            offered_ns, offer = self._endpoint.offers.get(timeout=ANSWER_S)
        except queue.Empty:
            raise FreelookError(f"nothing was offered by WHIP in {ANSWER_S:g} s") from None
        self._endpoint.answers.put(answer(self._page, offer, SIZE[0]))
        yield offered_ns, seen(self._page, seconds)


class Endpoint:
    """WHIP's HTTP: takes one offer after the other, and waits for what answers them."""

    def __init__(self) -> None:
        self.offers: queue.Queue[tuple[int, str]] = queue.Queue()
        self.answers: queue.Queue[str] = queue.Queue()
        handler = type("Handler", (_Handler,), {"endpoint": self})
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
        self.url = f"whip+http://127.0.0.1:{self._server.server_port}/whip"

    def __enter__(self) -> Endpoint:
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()


class _Handler(BaseHTTPRequestHandler):
    endpoint: Endpoint

    def do_POST(self) -> None:
        offered_ns = now_ns()
        offer = self.rfile.read(int(self.headers["Content-Length"])).decode()
        self.endpoint.offers.put((offered_ns, offer))
        text = self.endpoint.answers.get(timeout=ANSWER_S).encode()
        self.send_response(201)
        for key, value in {
            "Location": "/whip/1",
            "Content-Type": "application/sdp",
            "Content-Length": str(len(text)),
        }.items():
            self.send_header(key, value)
        self.end_headers()
        self.wfile.write(text)

    def do_DELETE(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        pass


def answer(page: Any, offer: str, width: int) -> str:
    """The page's answer; from now on it shows the video, and notes when it showed which stamp."""
    rows = -(-56 // (width // BLOCK_PX)) * BLOCK_PX
    return str(page.evaluate(ANSWER, [offer, width, rows, BLOCK_PX]))


def seen(page: Any, seconds: float) -> Seen:
    """What the page noted, until so many seconds from now."""
    offset_ns, until_ns = _clock_offset_ns(page), now_ns() + round(seconds * 1e9)
    while now_ns() < until_ns:
        page.wait_for_timeout(POLL_MS)
        for page_ms, bits in page.evaluate("window.seen.splice(0)"):
            yield round(page_ms * NS_PER_MS) + offset_ns, time_of(int(bits[::-1], 2))


def _clock_offset_ns(page: Any) -> int:
    """What leads from the page's clock to ours: of the quickest of some answers."""
    found = []
    for _ in range(PINGS):
        before_ns = now_ns()
        page_ms = page.evaluate("performance.now()")
        after_ns = now_ns()
        middle_ns = (before_ns + after_ns) // 2
        found.append((after_ns - before_ns, middle_ns - round(page_ms * NS_PER_MS)))
    return min(found)[1]
