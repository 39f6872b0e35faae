"""`freelook fly` and `freelook demo` as a person starts them."""

from __future__ import annotations

import json
import socket
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from commands import running, stop

from freelook.cli import main
from freelook.datagrams import free_port


def status_of(arguments: list[str]) -> int:
    """In a thread of its own: Playwright's event loop, once started, stays in the tests' thread."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(main, arguments).result()


def test_fly_serves_its_page_and_ends_with_ctrl_c() -> None:
    with running("fly", f"rtp://127.0.0.1:{free_port()}", "--lens", "demo") as (process, url):
        with urllib.request.urlopen(url) as page:
            assert b"<html" in page.read()
        with urllib.request.urlopen(url + "api/station") as about:
            assert json.load(about)["demo"] is False
        status, out, err = stop(process)
    assert (status, err) == (0, "")
    assert "connecting" in out


def test_fly_with_everything(shared_data: Path) -> None:
    video = str(shared_data / "lilyth_video" / "cam2.mp4")
    options = ["--tracker", "wander", "--tracker", "wander", "--mount=0,-30,0", "--hold", "2"]
    with running("fly", video, "--lens", "demo", "--loop", *options) as (process, url):
        with urllib.request.urlopen(url + "api/station") as reply:
            about = json.load(reply)
        status, out, err = stop(process)
    assert about["trackers"] == ["wander", "wander2"]
    assert about["hold_s"] == 2
    # the camera looks down: straight ahead is up in its picture (y down, so y < 0)
    assert [row[2] for row in about["camera"]["camera_from_head"]] == pytest.approx(
        [0, -0.5, 0.75**0.5]
    )
    assert (status, err) == (0, "")
    assert "wander2 tracking" in out


RTP = "rtp://127.0.0.1:0"


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["fly", "no-such-file.mp4"], "no-such-file.mp4"),
        (["fly", RTP, "--lens", "demo", "--fov", "180"], "--fov is for when there is no --lens"),
        (["fly", RTP, "--lens", "none"], "lens profile none: "),
        (["fly", "no-such-file.mp4", "--lens", "demo"], "no-such-file.mp4"),
        (["fly", __file__, "--lens", "demo"], "test_cli_fly.py"),
        (["fly", RTP, "--lens", "demo", "--tracker", "owl"], "unknown tracker 'owl'"),
        (["fly", RTP, "--lens", "demo", "--hfov", "200"], "10 to 150"),
        (["fly", RTP, "--lens", "demo", "--hold", "-1"], "hold_s must be"),
        (["fly", RTP, "--lens", "demo", "--mount", "nan,0,0"], "--mount takes three angles"),
        (["fly", RTP, "--lens", "demo", "--port", "99999"], "0 to 65535"),
        (["fly", RTP, "--lens", "demo", "--cert", "none.pem"], "none.pem"),
    ],
)
def test_what_is_wrong_is_said(
    arguments: list[str], why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    port = [] if "--port" in arguments else ["--port", "0"]
    assert status_of([*arguments, *port, "--no-browser"]) == 2
    out, err = capsys.readouterr()
    assert err.startswith("freelook fly: ")
    assert why in err
    assert "view:" not in out


def test_a_port_in_use_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert status_of(["fly", RTP, "--lens", "demo", "--port", str(port), "--no-browser"]) == 2
    assert f"port {port} on 127.0.0.1 is in use" in capsys.readouterr().err


def test_help_lists_the_kinds_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["fly", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    for kind in ("rtp", "rtsp", "opentrack", "wander"):
        assert kind in text
