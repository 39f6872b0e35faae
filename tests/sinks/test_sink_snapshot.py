"""Snapshots: the picture, and what its text chunks say, read by a program of somebody else."""

from __future__ import annotations

import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from freelook import load_camera
from freelook.cli import main
from freelook.errors import SinkError
from freelook.formats import parse_camera
from freelook.sinks import SinkSettings, snapshot
from freelook.types import Frame, Picture

SIZE = (48, 32)


def frame() -> Frame:
    rows = np.arange(SIZE[0] * SIZE[1] * 3, dtype=np.uint32).reshape(SIZE[1], SIZE[0], 3)
    return Frame(Picture("rgb24", ((rows * 7 % 256).astype(np.uint8),)), 5)


def test_the_file_is_the_picture_and_says_where_it_looks(tmp_path: Path) -> None:
    path = tmp_path / "view.png"
    sink = snapshot.open(str(path), SinkSettings(SIZE))
    sink.note({"yaw_deg": "-12.5", "lens": '{"a": "Öffnung"}', "state": "live"})
    sink.write(frame())
    read = cv2.imread(str(path))
    assert read is not None
    assert (read[..., ::-1] == frame().picture.planes[0]).all()
    assert b"iTXtfreelook:yaw_deg\0\0\0\0\0-12.5" in path.read_bytes()
    assert '"Öffnung"'.encode() in path.read_bytes()
    assert b"state" not in path.read_bytes()
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_is_replaced_and_a_folder_filled(tmp_path: Path) -> None:
    path, folder = tmp_path / "view.png", tmp_path / "shots"
    folder.mkdir()
    one, many = (snapshot.open(str(p), SinkSettings(SIZE)) for p in (path, folder))
    for sink in (one, many):
        for _ in range(2):
            sink.write(frame())
            assert sink.written is not None
            written = sink.written
            assert cv2.imread(str(written)) is not None
    assert path.is_file()
    assert 1 <= len(list(folder.glob("2*.png"))) <= 2  # two in one millisecond are one
    folder.joinpath("x").mkdir()
    path.unlink()
    path.mkdir()
    path.joinpath("in-the-way").touch()
    broken = snapshot.Snapshots(tmp_path / "gone" / "view.png")
    with pytest.raises(SinkError, match="No such file"):
        broken.write(frame())


def test_the_command_takes_one_from_a_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    camera = load_camera("demo")
    still, out = tmp_path / "fisheye.mp4", tmp_path / "view.png"
    writer = ["ffmpeg", "-v", "error", "-f", "lavfi", "-i"]
    grey = f"color=0x808080:s={camera.size[0]}x{camera.size[1]}:r=10:d=1"
    subprocess.run([*writer, grey, "-pix_fmt", "yuv420p", str(still)], check=True)
    arguments = ["snapshot", str(still), str(out), "--lens", "demo"]
    view = ["--yaw", "10", "--size", "64x48", "--renderer", "cpu"]
    assert main([*arguments, *view]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    read = cv2.imread(str(out))
    assert read is not None
    assert read.shape == (48, 64, 3)
    assert read[24, 32] == pytest.approx([128, 128, 128], abs=3)
    data = out.read_bytes()
    assert b"freelook:yaw_deg\0\0\0\0\x0010.0000" in data
    profile = data.split(b"freelook:lens\0\0\0\0\0")[1]
    text = profile[: profile.rindex(b"}", 0, profile.index(b"iTXt")) + 1].decode()
    assert parse_camera(text).size == camera.size


def test_the_command_says_why_there_is_no_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "view.png")
    source = ["snapshot", "rtp://127.0.0.1:0", out, "--lens", "demo", "--wait", "0.1"]
    assert main(source) == 2
    assert "no picture in 0.1 s: nothing received yet" in capsys.readouterr().err
