"""WHIP: an aiortc server takes the offer and decodes what comes."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import numpy as np
import pytest
from aiohttp import web
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription

from freelook.errors import SinkError
from freelook.sinks import open_sink
from freelook.types import ColorSpace, Frame, Picture

SIZE = (160, 96)
ENOUGH = 5


def frame(index: int) -> Frame:
    planes = (np.full(SIZE[::-1], 150, np.uint8), *(np.full((48, 80), 128, np.uint8),) * 2)
    picture = Picture("i420", (planes[0], planes[1], planes[2]), ColorSpace("bt601"))
    return Frame(picture, 10**12 + index * 33_333_333)


class Server:
    """Runs in a thread of its own; remembers the mean of every picture."""

    def __init__(self) -> None:
        self.means: list[float] = []
        self.deleted = threading.Event()
        self._peers: list[Any] = []
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Server:
        self._thread.start()
        assert self._ready.wait(20)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(20)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        app = web.Application()
        app.add_routes([web.post("/whip", self._offered), web.delete("/session", self._deleted)])
        runner = web.AppRunner(app)
        self._loop.run_until_complete(self._start(runner))
        self._ready.set()
        self._loop.run_forever()
        self._loop.run_until_complete(self._end(runner))
        self._loop.close()

    async def _start(self, runner: web.AppRunner) -> None:
        await runner.setup()
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        self.port = runner.addresses[0][1]

    async def _end(self, runner: web.AppRunner) -> None:
        for peer in self._peers:
            await peer.close()
        await runner.cleanup()

    async def _offered(self, request: web.Request) -> web.Response:
        peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self._peers.append(peer)
        peer.on("track", lambda track: asyncio.ensure_future(self._watch(track)))
        await peer.setRemoteDescription(RTCSessionDescription(await request.text(), "offer"))
        await peer.setLocalDescription(await peer.createAnswer())
        answer = {"Location": "/session", "Content-Type": "application/sdp"}
        return web.Response(status=201, text=peer.localDescription.sdp, headers=answer)

    async def _watch(self, track: Any) -> None:
        while len(self.means) < ENOUGH:
            picture = await track.recv()
            self.means.append(float(picture.to_ndarray()[: SIZE[1]].mean()))

    async def _deleted(self, _request: web.Request) -> web.Response:
        self.deleted.set()
        return web.Response()


def test_pictures_arrive_and_the_session_is_ended() -> None:
    pause = threading.Event()
    with Server() as server:
        address = f"whip+http://127.0.0.1:{server.port}/whip"
        sink = open_sink(address, size=SIZE, color=ColorSpace("bt601"))
        count = 0
        while len(server.means) < ENOUGH:
            sink.write(frame(count))
            count += 1
            pause.wait(0.02)
            assert count < 1500, "nothing was received in 30 s"
        sink.close()
        assert server.deleted.wait(10)
    assert server.means == pytest.approx([150] * ENOUGH, abs=2)  # coded flat grey


def test_a_server_that_knows_nothing_of_it_says_so() -> None:
    with Server() as server, pytest.raises(SinkError, match="404 Not Found"):
        open_sink(f"whip+http://127.0.0.1:{server.port}/other", size=SIZE)


@pytest.mark.parametrize(
    ("argument", "codec", "why"),
    [("whip+http:///path", "h264", "give host"), ("whip+http://h/x", "h265", "WebRTC takes H.264")],
)
def test_what_cannot_be_is_said_at_once(argument: str, codec: str, why: str) -> None:
    with pytest.raises(SinkError, match=why):
        open_sink(argument, size=SIZE, codec=codec)
