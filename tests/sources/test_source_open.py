from __future__ import annotations

from pathlib import Path

import pytest

from freelook.errors import SourceError
from freelook.sources import modules, open_source
from video_streams import video_file


@pytest.mark.parametrize(
    ("argument", "kind"),
    [
        ("flight.mp4", "file"),
        ("folder/with:colon.mkv", "file"),
        ("camera.sdp", "rtp"),
        ("rtp://0.0.0.0:5004?codec=h265", "rtp"),
        ("udp://@239.0.0.1:1234", "mpegts"),
        ("rtsp://camera/stream", "rtsp"),
        ("rtsps://camera/stream", "rtsp"),
        ("/dev/video2?size=640x480", "v4l2"),
    ],
)
def test_exactly_one_kind_recognises_an_argument(argument: str, kind: str) -> None:
    assert [name for name, module in modules().items() if module.recognises(argument)] == [kind]


@pytest.mark.parametrize("argument", ["", "gopher://camera", "srt://camera:1"])
def test_an_unknown_argument_lists_the_known_kinds(argument: str) -> None:
    with pytest.raises(SourceError) as caught:
        open_source(argument)
    for kind in modules():
        assert f"  {kind}: " in str(caught.value)
    assert not caught.value.retry
    assert "secret" not in str(caught.value)


def test_a_kind_can_be_forced(tmp_path: Path) -> None:
    path = video_file(tmp_path)
    assert len(list(open_source(f"file:{path}", pace=False).units())) == 16
    with pytest.raises(SourceError, match="no such device"):
        open_source(f"v4l2:{tmp_path / 'none'}")


@pytest.mark.parametrize(
    ("argument", "options", "says"),
    [
        ("rtp://127.0.0.1:0?codek=h264", {}, "unknown option 'codek'; known: codec, pt"),
        ("rtp://127.0.0.1:0", {"size": "1x1"}, "unknown option 'size'"),
        ("rtp://127.0.0.1:0?codec=vp8", {}, "codec must be one of auto, h264, h265"),
        ("rtp://127.0.0.1:0?pt=many", {}, "pt must be a positive number"),
        ("rtp://127.0.0.1:0?pt=200", {}, "below 128"),
        ("rtp://127.0.0.1:99999", {}, "[Pp]ort"),
        ("rtp://[::1", {}, "IPv6"),
        ("rtp://203.0.113.7:5004", {}, "not an address of this machine"),
        ("rtp://no.such.host.invalid:5004", {}, "no.such.host.invalid"),
        ("udp://127.0.0.1", {}, "write the port"),
        ("udp://127.0.0.1:1?fifo_size=3", {}, "known: none"),
        ("rtsp://", {}, "no host"),
        ("rtsp://camera:port/", {}, "RTSP address"),
        ("rtsp://camera/?transport=pigeon", {}, "udp or tcp"),
        ("rtsp://me:secret@camera/?transport=pigeon", {}, "^rtsp://camera/.*udp or tcp"),
        ("rtsp://me:secret@camera/?timeout=-1", {}, "^rtsp://camera/.*timeout must be"),
        ("rtsp://me:secret@camera/", {"size": "1x1"}, "^rtsp://camera/: unknown option"),
        ("rtsp://me:secret@camera:port/", {}, "RTSP address"),
        ("rtsp://camera/?timeout=-1", {}, "timeout must be a positive number"),
        ("/dev/video0?colour=red", {}, "known: format, rate, size, timeout"),
        ("none.mp4", {"fast": "1"}, "unknown option 'fast'"),
    ],
)
def test_wrong_arguments_are_explained(argument: str, options: dict[str, str], says: str) -> None:
    pytest.importorskip("aiortsp")
    with pytest.raises(SourceError, match=says) as caught:
        open_source(argument, options=options)
    assert not caught.value.retry
