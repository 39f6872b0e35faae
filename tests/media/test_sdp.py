from __future__ import annotations

import base64

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.errors import SourceError
from freelook.media.sdp import VideoDescription, parse_sdp

SPS, PPS = b"\x67\x42\0\x1e", b"\x68\xce"
H264 = """v=0
o=- 0 0 IN IP4 127.0.0.1
s=camera
c=IN IP4 239.1.2.3/16
t=0 0
m=audio 5006 RTP/AVP 97
a=rtpmap:97 opus/48000/2
m=video 5004 RTP/AVP 26 96
a=rtpmap:96 H264/90000
a=fmtp:96 packetization-mode=1; sprop-parameter-sets={sets}; profile-level-id=42001e
"""
H264 = H264.format(sets=",".join(base64.b64encode(n).decode() for n in (SPS, PPS)))
H265 = "v=0\nm=video 5600 RTP/AVP 98\nc=IN IP6 ::1\na=rtpmap:98 h265/90000\n"


def test_h264_with_parameter_sets() -> None:
    assert parse_sdp(H264) == VideoDescription("h264", 96, 5004, "239.1.2.3", 90000, (SPS, PPS))


def test_h265_with_its_own_connection_line() -> None:
    sets = "a=fmtp:98 sprop-vps=QAE=; sprop-sps=QgE=; sprop-pps=RAE=\n"
    assert parse_sdp((H265 + sets).replace("\n", "\r\n")) == VideoDescription(
        "hevc", 98, 5600, "::1", 90000, (b"\x40\1", b"\x42\1", b"\x44\1")
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "must begin with the line 'v=0'"),
        ("just some text", "must begin with the line 'v=0'"),
        ("v=0\nm=audio 1 RTP/AVP 0\n", "no video"),
        ("v=0\nm=video 5004 RTP/AVP 26\n", "only H264 and H265"),
        ("v=0\nm=video 5004 RTP/AVP 96\na=rtpmap:96 VP8/90000\n", "is VP8/90000"),
        (H264.replace("m=video 5004", "m=video five"), "line 8"),
        (H264.replace("m=video 5004", "m=video 70000"), "a number up to 65535"),
        (H264.replace("239.1.2.3", "somewhere"), "line 4"),
        (H264.replace("RTP/AVP 26 96", "RTP/SAVP 26 96"), "RTP/SAVP"),
        (H264.replace("mode=1", "mode=2"), "interleaved"),
        (H264.replace("sets=", "sets=!"), "not base64"),
        (H265 + "a=fmtp:98 sprop-max-don-diff=3\n", "interleaved"),
        (H265.replace("/90000", "/fast"), "clock rate"),
    ],
)
def test_errors_say_what_is_wrong(text: str, says: str) -> None:
    with pytest.raises(SourceError, match=says) as caught:
        parse_sdp(text)
    assert not caught.value.retry


@given(st.text(max_size=300), st.integers(0, len(H264)))
def test_any_text_gives_a_description_or_a_source_error(noise: str, at: int) -> None:
    for text in (noise, "v=0\n" + noise, H264[:at] + noise + H264[at:]):
        try:
            parse_sdp(text)
        except SourceError:
            continue


def test_ffmpegs_own_description_is_understood() -> None:
    text = (
        "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=No Name\r\nc=IN IP4 127.0.0.1\r\nt=0 0\r\n"
        "a=tool:libavformat 59.27.100\r\nm=video 5004 RTP/AVP 96\r\nb=AS:200\r\n"
        "a=rtpmap:96 H264/90000\r\na=fmtp:96 packetization-mode=1\r\n"
    )
    assert parse_sdp(text) == VideoDescription("h264", 96, 5004, "127.0.0.1", 90000)
