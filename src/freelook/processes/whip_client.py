"""Publishes the coded pictures from its input (see sinks/_child.py) by WHIP (RFC 9725).

python -m freelook.processes.whip_client

The address is in the environment (FREELOOK_ADDRESS), as there may be a password in it.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from fractions import Fraction
from typing import Any

import aiohttp
import av
from aiortc import (
    MediaStreamTrack,
    RTCConfiguration,
    RTCPeerConnection,
    RTCRtpSender,
    RTCSessionDescription,
)
from aiortc.mediastreams import MediaStreamError
from yarl import URL

from ..addresses import without_password
from ..sinks._child import ADDRESS, HEADER

CLOCK_HZ = 90_000
CONNECT_S = 15.0
MOST_WAITING = 8  # pictures; then all go, and the next key picture is the next


class Pictures(MediaStreamTrack):
    """What comes through the pipe, never much of it: late pictures are worth nothing."""

    kind = "video"

    def __init__(self) -> None:
        super().__init__()
        self._waiting: asyncio.Queue[tuple[int, bytes] | None] = asyncio.Queue()
        self._need_key = True
        self._last = -1

    def offer(self, t_ns: int, key: bool, data: bytes) -> None:
        if self._waiting.qsize() >= MOST_WAITING:
            while not self._waiting.empty():
                self._waiting.get_nowait()
                tell("unread")
            self._need_key = True
        if key or not self._need_key:
            self._need_key = False
            self._waiting.put_nowait((t_ns, data))
        else:
            tell("unread")
            tell("key")

    def end(self) -> None:
        self._waiting.put_nowait(None)

    async def recv(self) -> av.Packet[Any]:
        item = await self._waiting.get()
        if item is None:
            raise MediaStreamError
        packet: av.Packet[Any] = av.Packet(item[1])
        self._last = max(self._last + 1, item[0] * CLOCK_HZ // 1_000_000_000)
        packet.pts, packet.time_base = self._last, Fraction(1, CLOCK_HZ)
        return packet


async def publish(url: str) -> None:
    connection, pictures = RTCPeerConnection(RTCConfiguration(iceServers=[])), Pictures()
    transceiver = connection.addTransceiver(pictures, direction="sendonly")
    codecs = RTCRtpSender.getCapabilities("video").codecs
    transceiver.setCodecPreferences(
        [c for c in codecs if c.mimeType in ("video/H264", "video/rtx")]
    )
    transceiver.sender._send_keyframe = lambda: tell("key")
    states: asyncio.Queue[str] = asyncio.Queue()
    connection.on("connectionstatechange", lambda: states.put_nowait(connection.connectionState))
    await connection.setLocalDescription(await connection.createOffer())
    async with aiohttp.ClientSession() as http:
        place = await _offered(http, url, connection)
        try:
            while await asyncio.wait_for(states.get(), CONNECT_S) != "connected":
                if connection.connectionState in ("failed", "closed"):
                    raise ConnectionError("the server's WebRTC does not connect")
            tell("ready")
            await _feed(pictures, states)
        finally:
            await connection.close()
            if place is not None:
                async with http.delete(place):
                    pass


async def _offered(
    http: aiohttp.ClientSession, url: str, connection: RTCPeerConnection
) -> str | None:
    """Offer and answer; the session's address, to be deleted at the end."""
    headers = {"Content-Type": "application/sdp"}
    offer = connection.localDescription.sdp
    async with http.post(url, data=offer, headers=headers) as reply:
        answer = await reply.text()
        if reply.status != 201:
            raise ConnectionError(f"{reply.status} {reply.reason}: {answer[:200]}")
        place = reply.headers.get("Location")
        where = str(reply.url.join(URL(place))) if place else None
    await connection.setRemoteDescription(RTCSessionDescription(answer, "answer"))
    return where


async def _feed(pictures: Pictures, states: asyncio.Queue[str]) -> None:
    """Until the pipe ends or the server leaves."""
    loop = asyncio.get_running_loop()
    ended = asyncio.Event()

    def read() -> None:
        pipe = sys.stdin.buffer
        while len(header := pipe.read(HEADER.size)) == HEADER.size:
            t_ns, key, length = HEADER.unpack(header)
            data = pipe.read(length)
            loop.call_soon_threadsafe(pictures.offer, t_ns, bool(key), data)
        loop.call_soon_threadsafe(ended.set)

    threading.Thread(target=read, daemon=True).start()
    pipe_ended = asyncio.ensure_future(ended.wait())
    while not pipe_ended.done():
        state = asyncio.ensure_future(states.get())
        await asyncio.wait({pipe_ended, state}, return_when=asyncio.FIRST_COMPLETED)
        if state.done() and state.result() in ("failed", "closed", "disconnected"):
            raise ConnectionError("the server left")
        state.cancel()
    pictures.end()


def tell(words: str) -> None:
    os.write(1, f"{words}\n".encode())


def main(url: str) -> int:
    try:
        asyncio.run(publish(url))
    except (aiohttp.ClientError, OSError, TimeoutError) as error:
        print(
            without_password(str(error)) or "the server does not answer",
            file=sys.stderr,
            flush=True,
        )
        return 1
    return 0


if __name__ == "__main__":
    status = main(os.environ[ADDRESS])
    sys.stderr.flush()
    os._exit(status)  # the thread that waits at the pipe would be in the way of an orderly end
