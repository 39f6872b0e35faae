"""A real WebRTC client against the station."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from aiortc import rtcrtpreceiver
from whep_peer import Camera, bench, until

from freelook.media.annexb import split_nals


@pytest.fixture
def received(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, bytes]]:
    """(rtp time stamp, Annex B) of each coded picture a client got, before decoding."""
    units: list[tuple[int, bytes]] = []
    make = rtcrtpreceiver.get_decoder

    def tapped(codec: Any) -> Any:
        decoder = make(codec)
        decode = decoder.decode

        def record(unit: Any) -> Any:
            units.append((unit.timestamp, unit.data))
            return decode(unit)

        decoder.decode = record
        return decoder

    monkeypatch.setattr(rtcrtpreceiver, "get_decoder", tapped)
    return units


def test_h264_arrives_untouched_and_decodes(received: list[tuple[int, bytes]]) -> None:
    async def run() -> None:
        async with bench() as station:
            viewer = await station.viewer()
            with Camera(station.source) as camera:
                await until(lambda: len(viewer.frames) > 20, "20 decoded frames")
            await viewer.close()
            sent = [list(split_nals(unit.data)) for unit in camera.sent]
            first = sent.index(list(split_nals(received[0][1])))
            for (_, data), nals in zip(received, sent[first:], strict=False):
                assert list(split_nals(data)) == nals
            assert (viewer.frames[0].width, viewer.frames[0].height) == (320, 320)

    asyncio.run(run())
