"""Hardware encoders: what makes one fit for live use, and what is used where none is."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import av
import numpy as np
import pytest

from freelook.errors import RenderError
from freelook.media import hardware
from freelook.media.encoder import By, Encoder
from freelook.types import ColorSpace, Frame, Picture

SIZE = (64, 48)
LIVE = {"preset": "ultrafast", "tune": "zerolatency", "forced-idr": "1"}


def grey(index: int) -> Frame:
    planes = [np.full(s, 90 + index, np.uint8) for s in (SIZE[::-1], (24, 32), (24, 32))]
    return Frame(Picture("i420", (planes[0], planes[1], planes[2]), ColorSpace()), index)


@pytest.fixture
def pretended(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, str]]:
    """libx264 as if it were a piece of hardware, with these options."""
    options = dict(LIVE)
    create = av.CodecContext.create

    def pretend(name: str, mode: Any) -> Any:
        return create("libx264" if name == "h264_pretended" else name, mode)

    monkeypatch.setattr(hardware, "FAMILIES", ("pretended",))
    monkeypatch.setitem(hardware.OPTIONS, "pretended", options)
    monkeypatch.setattr(hardware, "_broken", set())
    monkeypatch.setattr(av.CodecContext, "create", pretend)
    hardware.why_not.cache_clear()
    yield options
    hardware.why_not.cache_clear()


@pytest.mark.parametrize("by", ["auto", "hardware"])
def test_what_works_is_used(by: By, pretended: dict[str, str]) -> None:
    encoder = Encoder(SIZE, by=by)
    assert encoder.library == "h264_pretended"
    units = [encoder.encode(grey(index), key=index == 3) for index in range(5)]
    assert [[unit.key for unit in some] for some in units] == [
        [index in (0, 3)] for index in range(5)
    ]
    assert Encoder(SIZE).library == "libx264"
    assert Encoder(SIZE, codec="h265", by="auto").library == "libx265"


def test_what_keeps_pictures_back_is_not(pretended: dict[str, str]) -> None:
    pretended.clear()
    pretended["preset"] = "medium"
    assert hardware.why_not("h264_pretended", SIZE) == "keeps pictures back"
    assert Encoder(SIZE, by="auto").library == "libx264"
    with pytest.raises(RenderError, match="no hardware encodes h264 of 64 x 48"):
        Encoder(SIZE, by="hardware")


def test_what_is_not_there_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hardware, "FAMILIES", ("no_such_thing",))
    monkeypatch.setitem(hardware.OPTIONS, "thing", {})
    assert Encoder(SIZE, by="auto").library == "libx264"


def test_hardware_that_fails_in_flight_is_given_up(
    pretended: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Gone:
        pix_fmt = "yuv420p"
        time_base = Fraction(1, 30)

        def encode(self, _picture: object) -> None:
            raise av.FFmpegError(5, "Input/output error")

    encoder = Encoder(SIZE, by="auto")
    monkeypatch.setattr(encoder, "_context", Gone())
    with pytest.raises(RenderError, match="h264_pretended failed: Input/output error"):
        encoder.encode(grey(0))
    assert Encoder(SIZE, by="auto").library == "libx264"


KEY = b"\0\0\1\x67a\0\0\1\x68b\0\0\1\x65c"


@pytest.mark.parametrize(
    ("packets", "why"),
    [
        ({}, ""),
        ({1: []}, "keeps pictures back"),
        ({1: [(b"\0\0\1\x41d", False)] * 2}, "keeps pictures back"),
        ({2: [(KEY, False)]}, "gives no key picture when asked"),
        ({0: [(b"\0\0\1\x65c", True)]}, "gives key pictures without parameter sets"),
        ({2: [(b"\0\0\0\2gc", True)]}, "gives key pictures without parameter sets"),
    ],
)
def test_what_a_live_stream_needs(packets: dict[int, list[tuple[bytes, bool]]], why: str) -> None:
    good = [[(KEY, True)], [(b"\0\0\1\x41d", False)], [(KEY, True)], [(b"\0\0\1\x41d", False)]]
    coded = [packets.get(index, good[index]) for index in range(4)]
    assert hardware.judged("h264", coded) == why
