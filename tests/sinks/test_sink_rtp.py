"""The live stream, received by a plain socket and decoded by PyAV."""

from __future__ import annotations

import socket
from pathlib import Path

import av
import numpy as np
import pytest
from av.video.codeccontext import VideoCodecContext

from freelook.color import i420_from_rgb
from freelook.latency import draw_stamp, read_stamp
from freelook.media.annexb import ParameterSets
from freelook.media.depacketise import CodedPicture, Depacketiser
from freelook.media.planes import picture_from_av
from freelook.media.rtp import parse_packet
from freelook.media.sdp import parse_sdp
from freelook.sinks import open_sink
from freelook.sinks.rtp import RtpStream
from freelook.types import ColorSpace, Counters, Frame

SIZE = (320, 192)
COLOR = ColorSpace("bt601", full_range=True)


def frame(index: int) -> Frame:
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    waves = (np.sin((x + 7 * index) / 19), np.sin(y / 13), np.sin((x + y) / 31))
    picture = i420_from_rgb(0.5 + 0.4 * np.stack(waves, axis=-1), COLOR)
    draw_stamp(picture.planes[0], 33_000_000 * index)
    return Frame(picture, 10**12 + 33_000_000 * index)


@pytest.mark.parametrize("codec", ["h264", "h265"])
def test_what_is_sent_is_received_and_decoded(codec: str, tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        port = receiver.getsockname()[1]
        sdp = tmp_path / "camera.sdp"
        sink = open_sink(
            f"rtp://127.0.0.1:{port}", size=SIZE, color=COLOR, codec=codec, sdp=str(sdp)
        )
        description = parse_sdp(sdp.read_text())
        assert (description.port, description.codec) == (port, codec.replace("h265", "hevc"))
        depacketiser = Depacketiser(description.codec, ParameterSets(description.codec), Counters())
        decoder = av.CodecContext.create(description.codec, "r")
        assert isinstance(decoder, VideoCodecContext)
        timestamps, stamps = [], []
        for index in range(8):
            sink.write(frame(index))
            units: list[CodedPicture] = []
            while not units:
                packet = parse_packet(receiver.recv(2000), 0)
                assert packet is not None
                units = depacketiser.push(packet)
            assert not units[0].damaged
            timestamps.append(units[0].timestamp)
            for decoded in decoder.decode(av.Packet(units[0].data)):
                picture = picture_from_av(decoded)
                assert picture.color == COLOR
                stamps.append(read_stamp(picture.planes[0]))
        sink.close()
    assert len(stamps) >= 5
    assert stamps == [33_000_000 * i for i in range(len(stamps))]
    steps = np.diff(np.array(timestamps, dtype=np.uint32))
    assert steps.tolist() == [2970] * 7  # 33 ms at 90 kHz


def test_nobody_needs_to_listen() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    sink = open_sink(f"rtp://127.0.0.1:{port}", size=SIZE, color=COLOR)
    assert isinstance(sink, RtpStream)
    for index in range(3):
        sink.write(frame(index))
    sink.close()
    assert sink.counters["sent"] == 3
    assert sink.counters["packets"] >= 3


def bound(port: int = 0) -> socket.socket:
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", port))
    receiver.settimeout(5)
    return receiver


def test_a_receiver_that_vanishes_and_another_in_its_place() -> None:
    """The system says of every packet that nobody is there; none of it comes back to the sender."""
    with bound() as receiver:
        port = receiver.getsockname()[1]
        sink = open_sink(f"rtp://127.0.0.1:{port}", size=SIZE, color=COLOR)
        assert isinstance(sink, RtpStream)
        sink.write(frame(0))
        assert receiver.recv(2000)
    for index in range(1, 32):
        sink.write(frame(index))
    assert (sink.counters["sent"], sink.counters["unsent"]) == (32, 0)
    with bound(port) as receiver:
        sink.write(frame(32))
        assert receiver.recv(2000)
    sink.close()


def test_a_receiver_that_asks_gets_a_key_picture() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5)
        sink = open_sink(f"rtp://127.0.0.1:{receiver.getsockname()[1]}", size=SIZE, color=COLOR)
        assert isinstance(sink, RtpStream)
        keys = []
        for index in range(6):
            sink.write(frame(index))
            kinds, marker = set(), False
            while not marker:
                data, sender = receiver.recvfrom(2000)
                kinds.add(data[12] & 31)
                marker = bool(data[1] & 0x80)
            keys.append(7 in kinds)  # a sequence parameter set
            if index == 2:
                receiver.sendto(bytes.fromhex("81ce00020000000100000002"), sender)
        sink.close()
    assert keys == [True, False, False, True, False, False]
    assert sink.counters["keys_asked"] == 1
