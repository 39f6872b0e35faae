"""freelook doctor: each finding, and what it says to do."""

from __future__ import annotations

import argparse
import json
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from freelook import doctor
from freelook.cli import doctor as command
from freelook.cli import fly
from freelook.doctor import Check
from freelook.sources import rtp
from freelook.trackers import opentrack

REQUIREMENTS = [
    "numpy>=1.26",
    "av<20,>=14; extra == 'video'",
    'aiohttp>=3.9; extra == "web"',
    "aiortc<2,>=1.14; extra == 'web'",
    "opencv-python-headless>=4.8; extra == 'render'",
]


def run_command(*options: str) -> int:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return command.run(parser.parse_args(options))


def test_names_of_an_extra_come_from_the_metadata() -> None:
    assert doctor.names_in_extra(REQUIREMENTS, "web") == ["aiohttp", "aiortc"]
    assert doctor.names_in_extra(REQUIREMENTS, "render") == ["opencv-python-headless"]
    assert doctor.names_in_extra(REQUIREMENTS, "nothing") == []


def test_every_extra_that_is_examined_exists() -> None:
    lines = list(doctor.check_libraries())
    assert len(lines) == len(doctor.EXTRAS)
    assert all(line.what for line in lines)


def test_missing_library_is_an_essential_no_that_names_the_extra() -> None:
    line = doctor.libraries_line("web", ["aiohttp", "aiortc"], {"aiohttp": "3.9"}.get)
    assert (line.state, line.essential) == ("no", True)
    assert line.what == "not installed: aiortc"
    assert line.todo == "pip install 'freelook[web]'"
    assert not doctor.fit_to_fly([line])


def test_missing_rtsp_does_not_ground_anybody() -> None:
    line = doctor.libraries_line("rtsp", ["aiortsp"], lambda name: None)
    assert line.state == "no"
    assert doctor.fit_to_fly([line])


def test_no_camera_is_a_warning(tmp_path: Path) -> None:
    (line,) = doctor.camera_lines(tmp_path, tmp_path)
    assert line.state == "warn"
    assert line.todo


def test_cameras_are_listed_by_name(tmp_path: Path) -> None:
    (tmp_path / "video0").touch()
    (tmp_path / "names" / "video0").mkdir(parents=True)
    (tmp_path / "names" / "video0" / "name").write_text("USB fisheye\n")
    (line,) = doctor.camera_lines(tmp_path, tmp_path / "names")
    assert line.state == "ok"
    assert line.what.endswith("video0 USB fisheye")


def test_camera_without_permission_says_which_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "video2").touch()
    monkeypatch.setattr("os.access", lambda path, mode: False)
    (line,) = doctor.camera_lines(tmp_path, tmp_path)
    assert line.state == "no"
    assert "usermod -aG video" in line.todo


def test_ports_examined_are_the_defaults() -> None:
    ports = {use: port for _, port, use, _ in doctor.PORTS}
    assert ports == {
        "the page": fly.DEFAULT_PORT,
        "OpenTrack": opentrack.DEFAULT_PORT,
        "RTP video": rtp._DEFAULT_PORT,
    }


@pytest.mark.parametrize(("kind", "type_"), [("tcp", "SOCK_STREAM"), ("udp", "SOCK_DGRAM")])
def test_port_that_is_taken_is_not_free(kind: str, type_: str) -> None:
    with socket.socket(type=getattr(socket, type_)) as other:
        other.bind(("", 0))
        if kind == "tcp":
            other.listen()
        port = other.getsockname()[1]
        assert not doctor.port_free(kind, port)
    assert doctor.port_free(kind, port)


def test_small_udp_buffer_says_how_to_raise_it() -> None:
    line = doctor.buffer_line(212_992)
    assert line.state == "warn"
    assert "sysctl -w net.core.rmem_max=8388608" in line.todo
    assert doctor.buffer_line(4_000_000).state == "ok"


def test_decoders_and_software_encoders_are_there() -> None:
    lines = {line.name: line for line in doctor.check_codecs()}
    for name in ("decode H.264", "decode H.265", "encode H.264"):
        assert lines[name].state == "ok", lines[name]


def test_codec_that_does_not_exist_is_not_there() -> None:
    assert not doctor._has_codec("no_such_codec", "r")


def test_streams_are_encoded_by_the_first_hardware_that_works_or_by_the_cpu() -> None:
    line = doctor.encoder_line("H.264", {"h264_nvenc": "no GPU", "h264_qsv": "", "h264_amf": ""})
    assert (line.name, line.what) == ("H.264 streams", "encoded by h264_qsv, in hardware")
    line = doctor.encoder_line("H.264", {"h264_nvenc": "no GPU"})
    assert (line.state, "on the CPU" in line.what) == ("ok", True)
    assert line.what.endswith("in vain: h264_nvenc")


def test_rtsp_server_that_is_missing_says_what_to_install() -> None:
    assert doctor.rtsp_server_line("/usr/bin/python3", "x").what.endswith("/usr/bin/python3")
    line = doctor.rtsp_server_line(None, "some-package")
    assert (line.state, line.todo.endswith("sudo apt install some-package")) == ("ok", True)


def broken() -> Iterator[Check]:
    raise RuntimeError("on fire")


def missing() -> Iterator[Check]:
    yield Check("wings", "no", "none", "grow some", essential=True)


def test_check_that_fails_is_a_line_and_the_rest_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "CHECKS", (broken, missing))
    first, second = doctor.examine()
    assert first.state == "warn"
    assert "on fire" in first.what
    assert second.name == "wings"


def test_command_prints_one_line_each_and_fails_for_the_essential(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(doctor, "CHECKS", (missing,))
    assert run_command() == 1
    assert capsys.readouterr().out == "no    wings              none -> grow some\n"


def test_whole_examination_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("--json") == 0
    lines = json.loads(capsys.readouterr().out)
    assert {line["state"] for line in lines} <= {"ok", "warn", "no"}
    names = {line["name"] for line in lines}
    assert {"python", "graphics", "processor", "browser", "decode H.265"} <= names
    silent = [x for x in lines if x["state"] == "no" and not x["todo"]]
    assert not silent, "every no says what to do"
