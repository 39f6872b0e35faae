"""`--show`: how outputs are written down, and what is said about mistakes."""

from __future__ import annotations

import pytest

from freelook.errors import SinkError
from freelook.outputs.spec import KINDS, OutputSpec, parse


def test_everything_that_can_be_said_of_a_stream() -> None:
    text = (
        "stream:rtp://192.168.1.5:5600,size=640x360,hfov=75,head=observer,fps=25,"
        "bitrate=1.5M,codec=h265,encoder=software,sdp=view.sdp"
    )
    assert parse(text) == OutputSpec(
        "stream",
        "rtp://192.168.1.5:5600",
        text,
        size=(640, 360),
        hfov_deg=75,
        head="observer",
        rate_hz=25,
        bitrate=1_500_000,
        codec="h265",
        encoder="software",
        sdp="view.sdp",
    )


def test_a_fixed_direction_and_other_words() -> None:
    assert parse("file:a.mp4,yaw=-90,overwrite").look_deg == (-90, 0, 0)
    assert parse("file:a.mp4,yaw=-90,overwrite").overwrite
    assert parse("terminal,pitch=20,roll=5").look_deg == (0, 20, 5)
    assert parse("snapshot:shots/,every=4").rate_hz == 0.25
    assert parse("stream:udp://[::1]:5,bitrate=800k").bitrate == 800_000
    assert parse("virtual-camera:/dev/video9").name == "virtual-camera:/dev/video9"
    assert parse("file:a.mp4,layout=quad").layout == "quad"
    assert parse("file:a.mp4,hud=night").hud == "night"
    assert parse("snapshot:a.png,hud=on").hud == "day"
    assert parse("file:a.mp4").hud is None
    assert parse("page") == OutputSpec("page", text="page")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "unknown kind ''"),
        ("screen", f"known: {', '.join(KINDS)}"),
        ("stream", "say where to: stream:rtp://"),
        ("terminal:x", "terminal takes no 'x'"),
        ("page,size=10x10", "page has no option 'size'; its options: none"),
        ("window,fps=3", "window has no option 'fps'; its options: size, hfov"),
        ("file:a.mp4,bitrate=4M", "file has no option 'bitrate'"),
        ("terminal,fast", "'fast' is not key=value"),
        ("terminal,fps=5,fps=6", "'fps' is given twice"),
        ("terminal,fps=quick", "fps=quick: not a number"),
        ("terminal,fps=nan", "fps=nan: not a number"),
        ("terminal,fps=0", "0.1 to 240 views a second"),
        ("terminal,hfov=400", "10 to 360 degrees"),
        ("terminal,projection=fishy", "known: perspective, pannini, stereographic"),
        ("file:a.mp4,size=640", "not WIDTHxHEIGHT"),
        ("stream:rtp://h:1,bitrate=fast", "bits per second, such as 800k or 4M"),
        ("stream:rtp://h:1,bitrate=4", "bits per second"),
        ("stream:rtp://h:1,codec=av1", "known: h264, h265"),
        ("file:a.mp4,overwrite=no", "write just 'overwrite'"),
        ("terminal,head=", "is empty"),
        ("file:a.mp4,hud=dusk", "known: on, day, night, plain"),
        ("terminal,hud=on", "terminal has no option 'hud'"),
        ("file:a.mp4,hud=on,layout=pip", "a HUD belongs to one view"),
        ("terminal,head=a,yaw=1", "either a head or yaw"),
    ],
)
def test_mistakes_say_what_and_what_else(text: str, why: str) -> None:
    with pytest.raises(SinkError, match=r"(?s)^--show ") as raised:
        parse(text)
    assert why in str(raised.value)


@pytest.mark.parametrize(
    "text",
    [
        "stream:{},size=640",
        "stream:{},fps=5,fps=6",
        "stream:{},fast",
        "stream:{},overwrite",
        "screen:{}",
        "page:{}",
        "stream:{},hud=on,layout=pip",
    ],
)
def test_mistakes_are_told_without_passwords(text: str) -> None:
    with pytest.raises(SinkError, match="://host:8554/view") as raised:
        parse(text.format("rtsp://pilot:secret@host:8554/view"))
    assert "pilot" not in str(raised.value)
    assert "secret" not in str(raised.value)
