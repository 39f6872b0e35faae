"""One viewer's video: coded pictures handed to aiortc without touching them.

aiortc's own encoder is never run: its `pack` splits our Annex B data into RTP payloads.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import av
from aiortc import MediaStreamTrack

from ..types import AccessUnit, Counters
from .units import Hub, UnitQueue

RTP_HZ = 90_000
RTP_TIME_BASE = Fraction(1, RTP_HZ)
# Time stamps that jump back by more than this start anew, smaller steps wait for time to pass.
LARGEST_STEP_BACK = RTP_HZ
FRAME_STEP = RTP_HZ // 30
# Replayed pictures are a tick apart, so that the browser shows the last one at once, and leave
# at this pace, so that they fit into the receiver's socket buffer.
REPLAY_BYTES_PER_S = 6_000_000

FrameListener = Callable[[int, int], None]


class RtpClock:
    """RTP time stamps from capture times: 90 kHz, strictly increasing."""

    def __init__(self) -> None:
        self._offset = 0
        self.last: int | None = None

    def stamp(self, capture_ns: int) -> int:
        """Ticks for a picture; not wrapped to 32 bits, aiortc does that."""
        ticks = capture_ns * RTP_HZ // 1_000_000_000 + self._offset
        if self.last is not None and ticks <= self.last:
            if ticks < self.last - LARGEST_STEP_BACK:
                self._offset += self.last + FRAME_STEP - ticks
                ticks = self.last + FRAME_STEP
            else:
                ticks = self.last + 1
        self.last = ticks
        return ticks

    def stamp_replayed(self, newest_capture_ns: int, still_to_come: int) -> int:
        """Ticks for a picture sent late, just before those of the newest one."""
        if self.last is None:
            ticks = newest_capture_ns * RTP_HZ // 1_000_000_000 + self._offset
            self.last = ticks - still_to_come - 1
        self.last += 1
        return self.last


class UnitTrack(MediaStreamTrack):
    """The pictures of a hub, from the last key picture on.

    `on_frame(rtp, capture_ns)` is called for each picture as it goes out, with the time stamp
    as it is on the wire; not before the first packet has gone, see `last_rtp_timestamp`.
    """

    kind = "video"

    def __init__(self, hub: Hub, counters: Counters, on_frame: FrameListener) -> None:
        super().__init__()
        self.sender: Any = None
        self._hub = hub
        self._counters = counters
        self._on_frame = on_frame
        self._clock = RtpClock()
        self._queue = UnitQueue(counters=counters)
        self._replay: deque[AccessUnit] = deque()
        self._newest_replayed_ns = 0
        self._ready = asyncio.Event()
        self._origin: int | None = None
        self._unsubscribe: Callable[[], None] | None = None

    async def recv(self) -> av.Packet[Any]:
        """The next coded picture; called by aiortc once the viewer is connected."""
        self._learn_origin()
        if self._unsubscribe is None:
            self._unsubscribe = self._hub.subscribe(self._deliver)
            self._start_replay()
        while True:
            if self._replay:
                return await self._replayed()
            if (unit := self._queue.take()) is not None:
                return self._packet(unit, self._clock.stamp(unit.capture_ns))
            self._ready.clear()
            await self._ready.wait()

    def resend(self) -> None:
        """Send again from the last key picture, if it is still here."""
        if not self._replay:
            self._start_replay()
            self._ready.set()

    def stop(self) -> None:
        super().stop()
        if self._unsubscribe is not None:
            self._unsubscribe()

    def _deliver(self, unit: AccessUnit) -> None:
        self._queue.put(unit)
        self._ready.set()

    def _start_replay(self) -> None:
        units = self._hub.replay.units()
        if not units:
            return
        self._replay.extend(units)
        self._newest_replayed_ns = units[-1].capture_ns
        self._queue.follow()
        self._counters.add("replays")

    async def _replayed(self) -> av.Packet[Any]:
        unit = self._replay.popleft()
        await asyncio.sleep(len(unit.data) / REPLAY_BYTES_PER_S)
        ticks = self._clock.stamp_replayed(self._newest_replayed_ns, len(self._replay))
        return self._packet(unit, ticks)

    def _packet(self, unit: AccessUnit, ticks: int) -> av.Packet[Any]:
        packet = av.Packet(unit.data)
        packet.pts = packet.dts = ticks
        packet.time_base = RTP_TIME_BASE
        self._counters.add("sent")
        if self._origin is not None:
            self._on_frame((self._origin + ticks) & 0xFFFFFFFF, unit.capture_ns)
        return packet

    def _learn_origin(self) -> None:
        if self._origin is None and self._clock.last is not None:
            on_wire = last_rtp_timestamp(self.sender)
            if on_wire is not None:
                self._origin = (on_wire - self._clock.last) & 0xFFFFFFFF


def last_rtp_timestamp(sender: Any) -> int | None:
    """The time stamp of the last RTP packet a sender sent; None when it cannot be told.

    aiortc adds a random origin to the time stamps and keeps it to itself, so this reads two of
    its private fields. Without it the page cannot tell the age of the video, nothing worse.
    """
    if not getattr(sender, "_RTCRtpSender__packet_count", 0):
        return None
    value = getattr(sender, "_RTCRtpSender__rtp_timestamp", None)
    return value if isinstance(value, int) else None
