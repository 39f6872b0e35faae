"""`freelook fly --show ...` as a person starts it, received by FFmpeg's programs."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import pytest

from freelook.cli import main
from freelook.datagrams import free_port

pytestmark = pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs the ffmpeg program")

FLY = ("fly", "rtp://127.0.0.1:0", "--lens", "demo")


def recorded(folder: Path) -> Path:
    """A second of grey."""
    path = folder / "fisheye.mp4"
    source = ("-f", "lavfi", "-i", "color=0x808080:s=240x240:r=15:d=1", "-pix_fmt", "yuv420p")
    subprocess.run(["ffmpeg", "-v", "error", *source, "-preset", "ultrafast", path], check=True)
    return path


def test_a_recording_goes_to_several_outputs_until_it_ends(
    tmp_path: Path, wait_until: Callable[..., None]
) -> None:
    """Two views of one grey recording: each output has its own size and head."""
    stream, file, shot = tmp_path / "stream.png", tmp_path / "view.mp4", tmp_path / "shot.png"
    two = tmp_path / "two.png"
    address = f"udp://127.0.0.1:{free_port()}"
    receiving = (
        "-v",
        "fatal",
        "-y",
        "-analyzeduration",
        "500000",
        "-i",
        address,
        "-frames:v",
        "2",
        "-update",
        "1",
    )
    receiver = subprocess.Popen(["ffmpeg", *receiving, str(stream)])
    shows = (
        f"stream:{address},size=160x96,head=observer",
        f"file:{file},size=96x64,yaw=20",
        f"snapshot:{shot},size=64x48,every=0.5",
        f"snapshot:{two},size=128x96,every=0.5,layout=pip",
    )
    command = [
        sys.executable,
        "-m",
        "freelook",
        "fly",
        str(recorded(tmp_path)),
        "--lens",
        "demo",
        "--loop",
    ]
    command += ["--tracker", "observer=wander", "--renderer", "cpu"]
    command += [part for show in shows for part in ("--show", show)]
    flight = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert receiver.wait(90) == 0  # what renders may have to be compiled first
        wait_until(lambda: shot.is_file() and two.is_file(), timeout_s=30)
        flight.send_signal(signal.SIGINT)
        out, err = flight.communicate(timeout=30)
    finally:
        for process in (receiver, flight):
            process.kill()
            process.wait()
    assert (flight.returncode, err) == (0, "")
    last = out.splitlines()[-1]
    assert f"stream:{address} live" in last
    assert f"file:{file} live" in last
    assert read_size(stream) == (160, 96)
    assert read_size(shot) == (64, 48)
    assert read_size(two) == (128, 96)
    assert darkest(shot) > 100 > 30 > darkest(two)  # around the fisheye in its corner
    probe = ("-v", "error", "-count_frames", "-show_entries", "stream=width,nb_read_frames")
    seen = subprocess.run(
        ["ffprobe", *probe, "-of", "csv=p=0", str(file)], capture_output=True, text=True, check=True
    )
    width, frames = seen.stdout.strip().split(",")
    assert (int(width), int(frames) >= 2) == (96, True)


def read_size(path: Path) -> tuple[int, int]:
    """Of a picture that is grey all over, as what was filmed is."""
    picture = cv2.imread(str(path))
    assert picture is not None
    middle = picture[picture.shape[0] // 2, picture.shape[1] // 2]
    assert middle == pytest.approx([128, 128, 128], abs=4)
    return picture.shape[1], picture.shape[0]


def darkest(path: Path) -> int:
    picture = cv2.imread(str(path))
    assert picture is not None
    return int(picture.min())


@pytest.mark.parametrize(
    ("shows", "why"),
    [
        (("page", "window"), "only one page or window"),
        (("movie:x",), "unknown kind 'movie'"),
        (("file:/no/such/folder/x.mp4",), "make it first"),
        (("stream:udp://127.0.0.1:9,head=nobody",), "there is no head 'nobody'; heads: wander"),
        (("file:odd.mp4,size=0x0",), "too small"),
        (("file:odd.mp4,size=95x64",), "even width and height"),
        (("file:odd.mp4,size=96x60,layout=quad",), "make both sides at least 64"),
        (("file:odd.mp4,layout=six",), "known: quad, pip, panorama"),
    ],
)
def test_mistakes_are_said_before_the_flight(
    shows: tuple[str, ...], why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    options = [part for show in shows for part in ("--show", show)]
    assert main([*FLY, "--tracker", "wander", *options]) == 2
    assert why in capsys.readouterr().err


def test_a_flight_ends_when_nothing_can_be_shown_any_more(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The disk is full, and the file was all there was to show."""
    full = tmp_path / "view.mp4"
    full.symlink_to("/dev/full")
    show = ["--renderer", "cpu", "--show", f"file:{full},size=96x64,overwrite"]
    assert main(["fly", str(recorded(tmp_path)), "--lens", "demo", "--loop", *show]) == 2
    assert "No space left on device" in capsys.readouterr().err
