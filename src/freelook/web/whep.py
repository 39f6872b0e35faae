"""WHEP: a viewer posts an SDP offer, gets an answer, and H.264 comes by WebRTC.

Follows draft-ietf-wish-whep: POST makes a session, DELETE ends it, no trickle ICE.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, Protocol

from aiortc import RTCConfiguration, RTCPeerConnection, RTCRtpSender, RTCSessionDescription
from aiortc.exceptions import InvalidStateError, OperationError
from aiortc.sdp import SessionDescription, candidate_from_sdp

from ..types import Counters
from .track import UnitTrack
from .units import Hub

CONNECT_S = 20.0
CLOSE_S = 5.0
# Room for one status and some poses; a channel that holds more is not keeping up.
FULL_BYTES = 2_000
# How soon after a lost picture the next one is answered.
LOST_PAUSE_S = 0.5


class Refused(Exception):  # noqa: N818 - an answer, not a failure
    """An offer that cannot be taken: the HTTP status and why, in words."""

    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.status = status


class ViewerEvents(Protocol):
    """What a viewer tells the station; all on the event loop."""

    def opened(self, viewer: Viewer) -> None: ...

    def heard(self, viewer: Viewer, message: object) -> None: ...

    def frame_sent(self, viewer: Viewer, rtp: int, capture_ns: int) -> None: ...

    def wants_key(self, viewer: Viewer) -> bool: ...

    def gone(self, viewer: Viewer) -> None: ...


class Viewer:
    """One connected browser: its video track and its data channel."""

    def __init__(self, hub: Hub, events: ViewerEvents) -> None:
        self.id = secrets.token_urlsafe(12)
        self.counters = Counters()
        self._events = events
        self._channel: Any = None
        self._lost_again_s = 0.0
        self._closing: asyncio.Task[None] | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._pc = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self._track = UnitTrack(hub, self.counters, self._frame_sent)
        self._pc.on("datachannel", self._channel_made)
        self._pc.on("connectionstatechange", self._state_changed)
        self._add_video()

    def _add_video(self) -> None:
        """Before the offer is looked at, or aiortc answers with VP8 and sends H.264 as that."""
        transceiver = self._pc.addTransceiver(self._track, direction="sendonly")
        codecs = RTCRtpSender.getCapabilities("video").codecs
        transceiver.setCodecPreferences(
            [c for c in codecs if c.mimeType in ("video/H264", "video/rtx")]
        )
        self._track.sender = transceiver.sender
        transceiver.sender._send_keyframe = self._picture_lost

    async def answer(self, offer: str) -> str:
        """The SDP answer; Refused when aiortc cannot make one."""
        now, later = split_mdns(offer)
        try:
            await self._pc.setRemoteDescription(RTCSessionDescription(now, "offer"))
            await self._pc.setLocalDescription(await self._pc.createAnswer())
        except OperationError as error:
            raise Refused(
                406, f"no codec in common; H.264 comes as profile 42e01f, mode 1 ({error})"
            ) from error
        except Exception as error:  # aiortc raises all kinds for offers that make no sense
            raise Refused(400, f"this offer cannot be answered: {error!r}") from error
        self._spawn(self._expect_connection())
        if later:
            self._spawn(self._add_candidates(later))
        return str(self._pc.localDescription.sdp)

    @property
    def listening(self) -> bool:
        return self._channel is not None and self._channel.readyState == "open"

    def send(self, text: str) -> bool:
        """Send a message that may be lost; False (and counted) when the channel is full."""
        if not self.listening:
            return False
        if self._channel.bufferedAmount > FULL_BYTES:
            self.counters.add("messages_skipped")
            return False
        try:
            self._channel.send(text)
        except (InvalidStateError, ConnectionError):  # closing at this moment
            return False
        return True

    async def close(self) -> None:
        """End the session; safe to call twice, and then waits for the first call."""
        if self._closing is None:
            self._closing = asyncio.ensure_future(self._close())
        await asyncio.shield(self._closing)

    async def _close(self) -> None:
        self._track.stop()
        for task in self._tasks:
            task.cancel()
        try:
            with contextlib.suppress(Exception):  # aiortc, half set up by an offer it choked on
                await asyncio.wait_for(self._pc.close(), CLOSE_S)
        finally:
            self._events.gone(self)

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _expect_connection(self) -> None:
        await asyncio.sleep(CONNECT_S)
        if self._pc.connectionState != "connected":
            self._closing = self._closing or asyncio.ensure_future(self._close())

    async def _add_candidates(self, lines: list[str]) -> None:
        """Browsers hide their addresses behind mDNS names, which take a second to look up.

        Mostly they reach us first, and these are not needed.
        """
        for line in lines:
            with contextlib.suppress(Exception):
                candidate = candidate_from_sdp(line)
                candidate.sdpMLineIndex = 0
                await self._pc.addIceCandidate(candidate)

    async def _state_changed(self) -> None:
        if self._pc.connectionState in ("failed", "closed"):
            await self.close()

    def _channel_made(self, channel: Any) -> None:
        if channel.label != "head":
            self.counters.add("unknown_channels")
            return
        self._channel = channel
        channel.on("message", lambda message: self._events.heard(self, message))
        self._events.opened(self)

    def _frame_sent(self, rtp: int, capture_ns: int) -> None:
        self._events.frame_sent(self, rtp, capture_ns)

    def _picture_lost(self) -> None:
        self.counters.add("pictures_lost")
        now_s = asyncio.get_running_loop().time()
        if now_s < self._lost_again_s:
            return
        self._lost_again_s = now_s + LOST_PAUSE_S
        if not self._events.wants_key(self):
            self._track.resend()


def check_offer(offer: str) -> None:
    """Refused, with the reason, unless the offer is for H.264 video towards the viewer."""
    try:
        description = SessionDescription.parse(offer)
    except Exception as error:  # the parser raises what it stumbles over
        raise Refused(400, f"this is not an SDP offer: {error!r}") from error
    videos = [media for media in description.media if media.kind == "video"]
    if not videos:
        raise Refused(400, "the offer has no video section; WHEP needs one, recvonly")
    if videos[0].direction not in ("recvonly", "sendrecv"):
        raise Refused(400, f"the offer's video is {videos[0].direction}; it must be recvonly")
    names = sorted({str(codec.name) for codec in videos[0].rtp.codecs})
    if "h264" not in (name.lower() for name in names):
        offered = ", ".join(names) or "none"
        raise Refused(406, f"only H.264 is sent here, and the offer lists: {offered}")


def split_mdns(offer: str) -> tuple[str, list[str]]:
    """(the offer without .local candidates, those candidates)."""
    kept, hidden = [], []
    for line in offer.splitlines():
        if line.startswith("a=candidate:") and ".local " in line:
            hidden.append(line.removeprefix("a=candidate:"))
        else:
            kept.append(line)
    if hidden:
        kept = [line for line in kept if line != "a=end-of-candidates"]
    return "\r\n".join(kept) + "\r\n", hidden


def add_counts(total: Counters, more: Counters) -> None:
    for name, value in more.values.items():
        total.add(name, value)


class Viewers:
    """All WHEP sessions of a station."""

    def __init__(
        self,
        hub: Hub,
        events: ViewerEvents,
        limit: int = 16,
        on_change: Callable[[int], None] = lambda _count: None,
    ) -> None:
        self._hub = hub
        self._events = events
        self._limit = limit
        self._on_change = on_change
        self._past = Counters()
        self._sessions: dict[str, Viewer] = {}

    def __len__(self) -> int:
        return len(self._sessions)

    def __iter__(self) -> Iterator[Viewer]:
        return iter(tuple(self._sessions.values()))

    async def add(self, offer: str) -> tuple[str, str]:
        """(session id, SDP answer); Refused with 400, 406 or 503."""
        check_offer(offer)
        if len(self) >= self._limit:
            raise Refused(503, f"{self._limit} viewers are watching already; try again later")
        viewer = Viewer(self._hub, self._events)
        self._sessions[viewer.id] = viewer
        try:
            answer = await viewer.answer(offer)
        except BaseException:
            await viewer.close()
            raise
        self._on_change(len(self))
        return viewer.id, answer

    async def remove(self, session: str) -> bool:
        """False when there is no such session."""
        viewer = self._sessions.get(session)
        if viewer is None:
            return False
        await viewer.close()
        return True

    def forget(self, viewer: Viewer) -> None:
        if self._sessions.pop(viewer.id, None) is not None:
            add_counts(self._past, viewer.counters)
            self._on_change(len(self))

    def counters(self) -> Counters:
        """Summed over all viewers there are and were."""
        total = Counters()
        for counters in (self._past, *(viewer.counters for viewer in self)):
            add_counts(total, counters)
        return total

    async def close(self) -> None:
        await asyncio.gather(*(viewer.close() for viewer in self))
