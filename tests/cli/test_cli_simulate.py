"""freelook simulate: files, pictures and live streams, with the truth beside them."""

from __future__ import annotations

import csv
import signal
import socket
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest

from freelook.cli import main
from freelook.formats import load_camera
from freelook.latency import read_stamp
from freelook.media.planes import picture_from_av
from freelook.rotations import angle_between_deg, from_wxyz
from freelook.simulation.flight import FigureEight
from freelook.types import ColorSpace, Picture

SMALL = ["--size", "320x320"]


def simulate(*arguments: str | Path) -> int:
    return main(["simulate", *map(str, arguments)])


def pictures(path: Path) -> list[tuple[float, Picture]]:
    with av.open(str(path)) as container:
        return [(frame.time or 0.0, picture_from_av(frame)) for frame in container.decode(video=0)]


def test_a_video_with_its_truth(tmp_path: Path) -> None:
    out, truth = tmp_path / "out.mp4", tmp_path / "truth.csv"
    arguments = ["--seconds", "0.4", "--fps", "10", "--start", "20", "--stamp"]
    arguments += ["--truth", str(truth)]
    assert simulate(out, *SMALL, *arguments, "--matrix", "bt601", "--full-range") == 0
    frames = pictures(out)
    assert [t for t, _ in frames] == pytest.approx([0, 0.1, 0.2, 0.3], abs=1e-4)
    assert frames[0][1].size == (320, 320)
    assert frames[0][1].color == ColorSpace("bt601", full_range=True)
    stamps = [read_stamp(picture.planes[0]) for _, picture in frames]
    assert stamps == [0, 100_000_000, 200_000_000, 300_000_000]
    with truth.open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["t_s"]) for row in rows] == pytest.approx([0, 0.1, 0.2, 0.3])
    state = FigureEight().at(20_300_000_000)
    last = {name: float(value) for name, value in rows[-1].items()}
    place = [last["north_m"], last["east_m"], last["down_m"]]
    assert place == pytest.approx(state.position, abs=1e-6)
    attitude = from_wxyz([last[name] for name in ("qw", "qx", "qy", "qz")])
    assert angle_between_deg(attitude, state.world_from_body) < 1e-5


def test_a_picture(tmp_path: Path) -> None:
    assert simulate(tmp_path / "still.png", *SMALL) == 0
    with av.open(str(tmp_path / "still.png")) as container:
        (frame,) = container.decode(video=0)
    picture = frame.to_ndarray(format="rgb24")
    assert picture.shape == (320, 320, 3)
    assert picture[2, 2].max() == 0  # outside the image circle
    assert picture[60, 160, 2] > picture[60, 160, 0]  # blue sky
    assert picture[233, 50, 1] > picture[233, 50, 2]  # green grass


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{dir}/out.xyz"], "do not know how to write"),
        (["{dir}/there.mp4"], "--overwrite"),
        (["{dir}/out.mp4", "--lens", "nosuch"], "nosuch"),
        (["{dir}/out.mp4", "--size", "321x321"], "even"),
        (["{dir}/out.mp4", "--softness", "50"], "softness"),
        (["{dir}/out.mp4", "--truth", "{dir}/there.mp4"], "there.mp4 exists already"),
        (["{dir}/out.mp4", "--size", "32x32", "--stamp"], "too small for a time stamp"),
        (["rtp://127.0.0.1"], "host and port"),
    ],
)
def test_mistakes_are_named_in_one_line(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "there.mp4").write_bytes(b"precious")
    assert simulate(*(a.format(dir=tmp_path) for a in arguments)) == 2
    assert words in capsys.readouterr().err
    assert (tmp_path / "there.mp4").read_bytes() == b"precious"
    assert not (tmp_path / "out.mp4").exists()


@pytest.mark.parametrize("value", ["0", "-3", "nan", "inf", "ten"])
def test_numbers_must_be_sensible(value: str, tmp_path: Path) -> None:
    with pytest.raises(SystemExit):
        simulate(tmp_path / "out.mp4", "--seconds", value)


def test_a_live_stream_ends_politely_on_ctrl_c(tmp_path: Path) -> None:
    sdp = tmp_path / "camera.sdp"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(60)
        address = f"rtp://127.0.0.1:{receiver.getsockname()[1]}"
        child = subprocess.Popen(
            [sys.executable, "-m", "freelook", "simulate", address, *SMALL, "--sdp", str(sdp)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        markers = 0
        while markers < 45:
            markers += receiver.recv(2000)[1] >> 7
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=20)
    assert child.returncode == 0, err
    assert "frames/s" in out
    assert "m=video" in sdp.read_text()


def test_the_demo_lens_is_the_default(tmp_path: Path) -> None:
    assert simulate(tmp_path / "out.mp4", "--seconds", "0.01") == 0
    ((_, picture),) = pictures(tmp_path / "out.mp4")
    assert picture.size == load_camera("demo").size
    assert np.ptp(picture.planes[0]) > 150
