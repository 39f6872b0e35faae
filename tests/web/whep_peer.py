"""Stand-ins for the tests of the station: a scripted ingest, and a real WHEP client."""

from __future__ import annotations

import asyncio
import json
import queue
import threading
import time
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from typing import Any, TypeVar

import aiohttp
import numpy as np
import pytest
from aiohttp.test_utils import TestServer
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription

from freelook.clock import now_ns
from freelook.errors import SourceError
from freelook.formats import load_camera
from freelook.head import Head
from freelook.ingest import Ingest
from freelook.mailbox import Mailbox
from freelook.media.encoder import Encoder
from freelook.types import AccessUnit, Counters, Frame, Picture, Pose
from freelook.web.security import Guard
from freelook.web.server import make_app
from freelook.web.station import About, Station

SIZE = (320, 320)
T = TypeVar("T")


async def until(condition: Callable[[], Any], what: str, seconds: float = 10.0) -> Any:
    """The first true value of `condition`, polled; fails when it does not come."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        if time.monotonic() > deadline:
            pytest.fail(f"after {seconds} s still no: {what}")
        await asyncio.sleep(0.005)
    return value


def run(work: Coroutine[Any, Any, T]) -> T:
    """`asyncio.run` on a thread of its own: Playwright keeps a loop running on the main one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


def flown(test: Callable[[Bench], Awaitable[None]], *trackers: str, **options: Any) -> None:
    """Run a test against a running station."""

    async def fly() -> None:
        async with bench(*trackers, **options) as station:
            await test(station)

    run(fly())


class ScriptedSource:
    """A source whose coded pictures, and whose end, the test makes."""

    def __init__(self) -> None:
        self.counters = Counters()
        self._queue: queue.Queue[AccessUnit | SourceError | None] = queue.Queue()

    def units(self) -> Iterator[AccessUnit]:
        while (item := self._queue.get()) is not None:
            if isinstance(item, SourceError):
                raise item
            yield item

    def close(self) -> None:
        self._queue.put(None)

    def arrive(self, unit: AccessUnit) -> None:
        self._queue.put(unit)

    def fail(self, why: str) -> None:
        self._queue.put(SourceError(why, retry=True))


class ScriptedTracker:
    """A tracker whose poses the test makes."""

    message = "no poses yet"

    def __init__(self) -> None:
        self.counters = Counters()
        self._box: Mailbox[Pose] = Mailbox()

    def pose(self, pose: Pose) -> None:
        self._box.put(pose)

    def poses(self) -> Iterator[Pose]:
        while not self._box.closed:
            if (pose := self._box.take(1.0)) is not None:
                yield pose

    def close(self) -> None:
        self._box.close()


class Camera:
    """Makes real coded pictures of moving noise, and sends them from its own thread."""

    def __init__(
        self, source: ScriptedSource, codec: str = "h264", size: tuple[int, int] = SIZE
    ) -> None:
        self.sent: list[AccessUnit] = []
        self._source = source
        self._encoder = Encoder(size, codec=codec)
        self._texture = np.random.default_rng(1).integers(16, 235, (size[1] // 8, size[0] // 8))
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Camera:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def send(self, *, key: bool = False) -> AccessUnit:
        """Encode and send one picture now."""
        [unit] = self._encoder.encode(self._frame(), key=key)
        self.sent.append(unit)
        self._source.arrive(unit)
        return unit

    def _run(self) -> None:
        while not self._stop.wait(1 / 30):
            self.send()

    def _frame(self) -> Frame:
        shift = len(self.sent)
        luma = np.kron(np.roll(self._texture, shift, 1), np.ones((8, 8))).astype(np.uint8)
        chroma = np.full((luma.shape[0] // 2, luma.shape[1] // 2), 128, np.uint8)
        return Frame(Picture("i420", (luma, chroma, chroma)), now_ns())


class Peer:
    """A WHEP viewer on aiortc. `units` has every coded picture that came, as (rtp, Annex B)."""

    def __init__(self, http: aiohttp.ClientSession, base: str) -> None:
        self.pc = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self.messages: list[dict[str, Any]] = []
        self.frames: list[Any] = []
        self.location = ""
        self.channel: Any = None
        self._http = http
        self._base = base
        self._reader: asyncio.Task[None] | None = None

    async def offer(self, *, channel: str = "head") -> str:
        transceiver = self.pc.addTransceiver("video", direction="recvonly")
        del transceiver
        self.channel = self.pc.createDataChannel(channel, ordered=False, maxRetransmits=0)
        self.channel.on("message", lambda text: self.messages.append(json.loads(text)))
        self.pc.on("track", self._read)
        await self.pc.setLocalDescription(await self.pc.createOffer())
        return str(self.pc.localDescription.sdp)

    async def watch(self) -> Peer:
        offer = await self.offer()
        reply = await self._http.post(
            f"{self._base}/whep", data=offer, headers={"Content-Type": "application/sdp"}
        )
        text = await reply.text()
        assert reply.status == 201, text
        self.location = reply.headers["Location"]
        await self.pc.setRemoteDescription(RTCSessionDescription(text, "answer"))
        await until(lambda: self.channel.readyState == "open", "open data channel")
        return self

    def of_type(self, kind: str) -> list[dict[str, Any]]:
        return [m for m in self.messages if m["type"] == kind]

    def last(self, kind: str) -> dict[str, Any]:
        found = self.of_type(kind)
        return found[-1] if found else {}

    async def more(self, kind: str, than: int) -> None:
        """Wait for the next message of a kind."""
        await until(lambda: len(self.of_type(kind)) > than, f"{kind} message", 2.0)

    async def close(self) -> None:
        await self.pc.close()
        if self._reader is not None:
            self._reader.cancel()

    def _read(self, track: Any) -> None:
        async def read() -> None:
            while True:
                self.frames.append(await track.recv())

        self._reader = asyncio.ensure_future(read())
        self._reader.add_done_callback(lambda task: task.cancelled() or task.exception())


class Bench:
    """A running station, its scripted inputs, and viewers."""

    def __init__(self, heads: dict[str, ScriptedTracker], **options: Any) -> None:
        self.sources: list[ScriptedSource] = []
        self.trackers = heads
        self.station = Station(
            Ingest(self._open, retry_s=(0.05, 0.1)),
            load_camera("demo"),
            {name: Head(name, tracker) for name, tracker in heads.items()},
            About("rtsp://pilot:secret@camera/scripted"),
            **options,
        )
        self.base = ""
        self.http: Any = None

    @property
    def source(self) -> ScriptedSource:
        """The one that is open now."""
        return self.sources[-1]

    def _open(self) -> ScriptedSource:
        self.sources.append(ScriptedSource())
        return self.source

    async def viewer(self) -> Peer:
        return await Peer(self.http, self.base).watch()


@asynccontextmanager
async def bench(*trackers: str, guard: Guard | None = None, **options: Any) -> Any:
    made = Bench({name: ScriptedTracker() for name in trackers}, **options)
    server = TestServer(make_app(made.station, guard or Guard()))
    async with server, aiohttp.ClientSession() as http:
        made.http = http
        made.base = str(server.make_url("")).rstrip("/")
        yield made
