"""Finding the sink for an argument, and what all sinks share."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from freelook.color import i420_from_rgb
from freelook.datagrams import free_port
from freelook.errors import SinkError
from freelook.sinks import find, modules, open_sink
from freelook.types import ColorSpace, Frame

SIZE = (64, 48)
EXAMPLES = {
    "video": "out.mp4",
    "picture": "out.png",
    "rtp": "rtp://127.0.0.1:9",
    "udp": "udp://127.0.0.1:9",
    "rtsp": "rtsp://127.0.0.1:8554/view",
    "rtsp-server": "rtsp-server://127.0.0.1:8554",
    "terminal": "terminal",
    "whip": "whip+http://127.0.0.1:8889/view/whip",
    "snapshot": "shots/",
    "virtual-camera": "virtual-camera",
}


def frame(t_ns: int = 0, size: tuple[int, int] = SIZE, level: float = 0.5) -> Frame:
    rgb = np.full((size[1], size[0], 3), level)
    return Frame(i420_from_rgb(rgb, ColorSpace()), t_ns, t_ns)


def test_every_sink_has_an_example_here() -> None:
    assert set(modules()) == set(EXAMPLES)


@pytest.mark.parametrize("kind", EXAMPLES)
def test_arguments_find_their_sink(kind: str) -> None:
    module, argument = find(EXAMPLES[kind])
    assert (module.KIND, argument) == (kind, EXAMPLES[kind])
    assert find(f"{kind}:{EXAMPLES[kind]}") == (module, EXAMPLES[kind])
    assert [m.KIND for m in modules().values() if m.recognises(EXAMPLES[kind])] == [kind]
    assert (module.__doc__ or "").splitlines()[0].endswith(".")


@pytest.mark.parametrize("argument", ["out.xyz", "", "http://host/out.mp4", "nothing:out.mp4x"])
def test_unknown_arguments_list_what_is_known(argument: str) -> None:
    with pytest.raises(SinkError, match=r"(?s)picture:.*rtp:.*video:"):
        open_sink(argument, size=SIZE)


# these need something of the system, and have their own tests
NEEDY = {"virtual-camera", "rtsp", "rtsp-server", "whip"}


@pytest.mark.parametrize("kind", sorted(set(EXAMPLES) - NEEDY))
def test_every_sink_takes_frames_and_closes(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shots").mkdir()
    sink = open_sink(EXAMPLES[kind], size=SIZE)
    sink.write(frame())
    sink.close()


@pytest.mark.parametrize("name", ["out.mp4", "out.png"])
def test_files_are_not_overwritten_unasked(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(b"precious")
    with pytest.raises(SinkError, match="--overwrite"):
        open_sink(str(path), size=SIZE)
    assert path.read_bytes() == b"precious"
    sink = open_sink(str(path), size=SIZE, overwrite=True)
    sink.write(frame())
    sink.close()
    assert path.read_bytes() != b"precious"


@pytest.mark.parametrize("name", ["out.mp4", "out.png"])
def test_places_that_cannot_be_written(name: str, tmp_path: Path) -> None:
    with pytest.raises(SinkError, match="does not exist"):
        open_sink(str(tmp_path / "nowhere" / name), size=SIZE)
    (tmp_path / name).mkdir()
    with pytest.raises(SinkError, match="is a folder"):
        open_sink(str(tmp_path / name), size=SIZE, overwrite=True)


def test_settings_that_make_no_sense_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SinkError, match="audio from"):
        open_sink("rtp://127.0.0.1:9", size=SIZE, audio_from="x.mp4")
    with pytest.raises(SinkError, match="sdp"):
        open_sink(str(tmp_path / "o.mp4"), size=SIZE, sdp="x.sdp")
    with pytest.raises(SinkError, match="no video file, cannot have preset = fast"):
        open_sink(str(tmp_path / "o.png"), size=SIZE, preset="fast")
    for argument in ("rtp://127.0.0.1", "rtp://:5004", "rtp://127.0.0.1:99999", "rtp://["):
        with pytest.raises(SinkError, match="host and port"):
            open_sink(argument, size=SIZE)


@pytest.mark.parametrize(
    "argument",
    [
        "rtsp://pilot:secret@127.0.0.1:{}/view",
        "whip+http://pilot:secret@127.0.0.1:{}/view",
        "rtsp://pilot:secret@127.0.0.1",
        "whip+http://pilot:secret@",
        "rtsp-server://pilot:secret@127.0.0.1",
        "gopher://pilot:secret@127.0.0.1",
    ],
)
def test_passwords_are_not_told(argument: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither in what went wrong nor in commands, which other users of the machine can see."""
    commands: list[str] = []

    class Noted(subprocess.Popen[bytes]):
        def __init__(self, command: list[str], **options: Any) -> None:
            commands.extend(command)
            super().__init__(command, **options)

    monkeypatch.setattr(subprocess, "Popen", Noted)
    with pytest.raises(SinkError) as raised:
        open_sink(argument.format(free_port()), size=(64, 48))
    assert "secret" not in " ".join([str(raised.value), *commands])
    if "{}" in argument:
        assert sys.executable in commands
        assert "127.0.0.1" in str(raised.value)
