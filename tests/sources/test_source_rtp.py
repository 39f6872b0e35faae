from __future__ import annotations

import socket
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.errors import SourceError
from freelook.media.decoder import Decoder
from freelook.sources import open_source
from video_streams import GOP, rtp_datagrams, transport_stream, with_sequence, with_ssrc, write

PICTURES = 2 * GOP
LOOKS_LIKE_RTP = st.binary(min_size=12, max_size=40).map(lambda b: b"\x80\x60" + b)


def send(port: int, datagrams: list[bytes]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for datagram in datagrams:
            sender.sendto(datagram, ("127.0.0.1", port))


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def open_rtp(argument: str = "rtp://127.0.0.1:0") -> Any:
    return open_source(argument)


@pytest.mark.parametrize("codec", ["h264", "hevc"])
def test_ffmpegs_muxer_straight_into_the_socket(codec: str) -> None:
    source = open_rtp()
    write(f"rtp://127.0.0.1:{source.port}", "rtp", codec=codec, size=(160, 120))
    units, decoder = source.units(), Decoder()
    frames = [frame for _ in range(PICTURES) for frame in decoder.decode(next(units))]
    units.close()
    assert len(frames) == PICTURES
    assert source.counters["lost"] == 0


def test_an_sdp_file_names_port_codec_and_parameter_sets(tmp_path: Path) -> None:
    port = free_port()
    path = tmp_path / "camera.sdp"
    path.write_text(f"v=0\nc=IN IP4 127.0.0.1\nm=video {port} RTP/AVP 96\na=rtpmap:96 H264/90000\n")
    source = open_rtp(str(path))
    assert source.port == port
    send(port, list(rtp_datagrams("h264")))
    units = source.units()
    assert next(units).key
    units.close()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("not sdp", "must begin with"),
        ("v=0\nm=video 0 RTP/AVP 96\na=rtpmap:96 H264/90000\n", "port 0"),
        (None, "No such file"),
    ],
)
def test_a_wrong_sdp_file_is_named_in_the_error(
    tmp_path: Path, text: str | None, says: str
) -> None:
    path = tmp_path / "camera.sdp"
    if text is not None:
        path.write_text(text)
    with pytest.raises(SourceError, match=says) as caught:
        open_rtp(str(path))
    assert "camera.sdp" in str(caught.value)
    assert not caught.value.retry


def test_a_port_in_use_is_said() -> None:
    source = open_rtp()
    with pytest.raises(SourceError, match="another program already receives"):
        open_rtp(f"rtp://127.0.0.1:{source.port}")
    source.close()


def test_a_restarted_sender_comes_back_by_itself() -> None:
    clock_ns = iter(range(0, 10**18, 10**8))  # each packet a tenth of a second later
    source: Any = open_source("rtp://127.0.0.1:0", clock=lambda: next(clock_ns))
    first = list(rtp_datagrams("h264"))
    again = [with_ssrc(with_sequence(d, 40000 + i), 99) for i, d in enumerate(first)]
    send(source.port, first + [again[0]] * 3 + again)
    units = source.units()
    taken = [next(units) for _ in range(2 * PICTURES)]
    units.close()
    assert [u.data for u in taken[:PICTURES]] == [u.data for u in taken[PICTURES:]]
    assert source.counters["restarts"] == 1


def test_the_end_of_a_gap_does_not_wait_for_the_next_packet() -> None:
    """Packets behind a gap are given out after the wait though nothing more arrives."""
    datagrams = list(rtp_datagrams("h264", 4))
    source = open_rtp()
    ends = [i for i, d in enumerate(datagrams) if d[1] & 0x80]
    lost = ends[3] + 1  # the first packet of the fifth picture
    send(source.port, datagrams[:lost] + datagrams[lost + 1 : ends[4] + 1])
    units = source.units()
    taken = [next(units) for _ in range(5)]
    units.close()
    assert len(taken) == 5
    assert source.counters["lost"] == 1


def test_multicast_is_joined() -> None:
    port = free_port()
    try:
        source = open_rtp(f"rtp://239.255.77.7:{port}")
    except SourceError as error:
        pytest.skip(f"no multicast here: {error}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
        try:
            for datagram in rtp_datagrams("h264"):
                sender.sendto(datagram, ("239.255.77.7", port))
        except OSError as error:
            source.close()
            pytest.skip(f"no multicast route here: {error}")
    units = source.units()
    assert next(units).key
    units.close()


@given(st.lists(st.binary(max_size=100) | LOOKS_LIKE_RTP, min_size=1, max_size=10))
def test_garbage_before_the_stream_is_got_over(garbage: list[bytes]) -> None:
    """Even garbage that looks like a sender of its own only delays the stream."""
    clock_ns = iter(range(0, 10**18, 10**8))
    source: Any = open_source("rtp://127.0.0.1:0", clock=lambda: next(clock_ns))
    send(source.port, garbage + list(rtp_datagrams("h264")))
    units = source.units()
    assert any(unit.key for unit in units)
    units.close()
    assert source.counters["packets"] + source.counters["malformed"] > len(garbage)


def test_transport_stream_by_udp() -> None:
    source: Any = open_source("udp://127.0.0.1:0")
    data = transport_stream("h264")
    send(source.port, [b"junk", *(data[i : i + 1316] for i in range(0, len(data), 1316))])
    units, decoder = source.units(), Decoder()
    frames = [frame for _ in range(PICTURES - 1) for frame in decoder.decode(next(units))]
    units.close()
    assert len(frames) == PICTURES - 1
    assert source.counters["malformed"] >= 1
