"""Video files: times, sound and colours kept; what was written plays, whatever happens."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import av
import numpy as np
import pytest

from freelook.color import i420_from_rgb, rgb_from_picture
from freelook.errors import SinkError
from freelook.media.planes import picture_from_av
from freelook.sinks import SinkSettings
from freelook.sinks.videofile import SUFFIXES, VideoFile
from freelook.types import ColorSpace, Frame, Picture

SIZE = (160, 96)


def scene(shift: float, color: ColorSpace) -> Picture:
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    waves = (np.sin((x + shift) / 19), np.sin(y / 13), np.sin((x + y) / 31))
    return i420_from_rgb(0.5 + 0.4 * np.stack(waves, axis=-1), color)


def write(path: Path, times_ns: Sequence[int], **settings: object) -> VideoFile:
    sink = VideoFile(str(path), SinkSettings(SIZE, **settings))  # type: ignore[arg-type]
    for index, t_ns in enumerate(times_ns):
        sink.write(Frame(scene(3 * index, sink_color(settings)), 10**15 + t_ns, t_ns))
    sink.close()
    return sink


def sink_color(settings: dict[str, object]) -> ColorSpace:
    color = settings.get("color", ColorSpace())
    assert isinstance(color, ColorSpace)
    return color


def times_s(path: Path) -> list[float]:
    with av.open(str(path)) as container:
        return [frame.time for frame in container.decode(video=0) if frame.time is not None]


def sound(path: Path) -> list[tuple[float, bytes]]:
    """Times in seconds and data of the packets of the first sound stream."""
    with av.open(str(path)) as container:
        return [
            (float(packet.pts * packet.time_base), bytes(packet))
            for packet in container.demux(audio=0)
            if packet.pts is not None and packet.time_base is not None
        ]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_times_are_the_frames_own(suffix: str, tmp_path: Path) -> None:
    """A rate that varies, and a start that is not 0. Matroska counts in milliseconds."""
    times_ns = [308_989_000, 342_000_000, 375_000_000, 600_000_000, 633_333_333, 2_000_000_000]
    path = tmp_path / f"out{suffix}"
    assert write(path, times_ns).counters.values == {"written": 6}
    tolerance = 0.0006 if suffix == ".mkv" else 1e-5
    assert times_s(path) == pytest.approx([t / 1e9 for t in times_ns], abs=tolerance)


def test_times_that_repeat_or_run_backward_are_nudged_and_counted(tmp_path: Path) -> None:
    times_ns = [0, 40_000_000, 40_000_000, 30_000_000, 80_000_000]
    sink = write(tmp_path / "out.mp4", times_ns)
    assert sink.counters["nudged"] == 2
    assert times_s(tmp_path / "out.mp4") == pytest.approx([0, 0.04, 0.04, 0.04, 0.08], abs=1e-4)


def test_without_media_times_the_first_frame_is_at_zero(tmp_path: Path) -> None:
    sink = VideoFile(str(tmp_path / "out.mp4"), SinkSettings(SIZE))
    for t_ns in (5_000_000_000, 5_020_000_000):
        sink.write(Frame(scene(0, ColorSpace()), t_ns))
    sink.close()
    assert times_s(tmp_path / "out.mp4") == pytest.approx([0, 0.02])


@pytest.mark.parametrize("codec", ["h264", "h265"])
@pytest.mark.parametrize("color", [ColorSpace(), ColorSpace("bt601", full_range=True)])
def test_colours_are_stated_and_kept(codec: str, color: ColorSpace, tmp_path: Path) -> None:
    write(tmp_path / "out.mp4", [0, 10**8], color=color, codec=codec)
    with av.open(str(tmp_path / "out.mp4")) as container:
        decoded = [picture_from_av(frame) for frame in container.decode(video=0)]
        assert container.streams.video[0].codec_context.name == codec.replace("h265", "hevc")
    assert [picture.color for picture in decoded] == [color, color]
    error = rgb_from_picture(decoded[1]) - rgb_from_picture(scene(3, color))
    assert 10 * np.log10(1 / np.mean(error**2)) > 36


@pytest.mark.data
@pytest.mark.parametrize("suffix", [".mp4", ".mkv"])
def test_sound_is_copied_as_far_as_the_pictures_go(
    suffix: str, shared_data: Path, tmp_path: Path
) -> None:
    """The recording's pictures start 0.309 s after its sound."""
    original = shared_data / "lilyth_video" / "cam2.mp4"
    expected = sound(original)
    path = tmp_path / f"out{suffix}"
    write(path, [308_989_000 + i * 66_666_667 for i in range(40)], audio_from=str(original))
    copied = sound(path)
    end_s = times_s(path)[-1]
    assert copied[-1][0] <= end_s < copied[-1][0] + 0.3
    assert [data for _, data in copied] == [data for _, data in expected[: len(copied)]]
    assert [t for t, _ in copied] == pytest.approx(
        [t for t, _ in expected[: len(copied)]], abs=0.001
    )


def test_silent_and_broken_recordings_as_sources_of_sound(tmp_path: Path) -> None:
    write(tmp_path / "silent.mp4", [0, 10**8])
    write(tmp_path / "out.mp4", [0, 10**8], audio_from=str(tmp_path / "silent.mp4"))
    assert len(times_s(tmp_path / "out.mp4")) == 2
    (tmp_path / "text.mp4").write_text("not a recording")
    for name in ("text.mp4", "nowhere.mp4"):
        with pytest.raises(SinkError, match="again"):
            write(tmp_path / "again.mp4", [0], audio_from=str(tmp_path / name), overwrite=True)


SLOW_WRITER = """
import sys
sys.path.insert(0, sys.argv[2])
from test_sink_videofile import *
sink = VideoFile(sys.argv[1], SinkSettings(SIZE))
for index in range(100_000):
    sink.write(Frame(scene(3 * index, ColorSpace()), 0, index * 40_000_000))
    if index == 400:
        print("written", flush=True)
        sys.stdin.readline()
"""


@pytest.mark.parametrize("suffix", [".mp4", ".mkv"])
def test_what_a_killed_program_wrote_plays(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"out{suffix}"
    child = subprocess.Popen(
        [sys.executable, "-c", SLOW_WRITER, str(path), str(Path(__file__).parent)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert child.stdout
    assert child.stdin
    assert child.stdout.readline() == b"written\n"
    child.send_signal(signal.SIGKILL)
    child.wait()
    child.stdin.close()
    child.stdout.close()
    times = times_s(path)
    # all but what the encoder held back and the last second or two
    assert len(times) > 401 - 100
    assert times[:3] == pytest.approx([0, 0.04, 0.08])


@pytest.mark.parametrize(
    ("preset", "seen"), [(None, b"subme=2"), ("ultrafast", b"subme=0"), ("medium", b"subme=7")]
)
def test_x264_works_as_asked_on_whole_frames(
    preset: str | None, seen: bytes, tmp_path: Path
) -> None:
    """It writes its settings into the stream. Threads on slices of a frame would be slower; it
    cuts only where there is more than one core, and pictures large enough."""
    size = (320, 256)
    sink = VideoFile(str(tmp_path / "out.mp4"), SinkSettings(size, preset=preset))
    sink.write(Frame(i420_from_rgb(np.zeros((*size[::-1], 3)), ColorSpace()), 0))
    sink.close()
    said = (tmp_path / "out.mp4").read_bytes()
    assert seen in said
    assert b"sliced_threads=0" in said


def test_a_file_without_frames_is_not_left_behind(tmp_path: Path) -> None:
    VideoFile(str(tmp_path / "out.mp4"), SinkSettings(SIZE)).close()
    assert not (tmp_path / "out.mp4").exists()


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    def sink(**settings: object) -> VideoFile:
        values = {"size": SIZE, "overwrite": True} | settings
        return VideoFile(str(tmp_path / "out.mp4"), SinkSettings(**values))  # type: ignore[arg-type]

    with pytest.raises(SinkError, match="even"):
        sink(size=(161, 96))
    with pytest.raises(SinkError, match="known: h264"):
        sink(codec="vp8")
    with pytest.raises(SinkError, match="frames per second"):
        sink(fps=0)
    with pytest.raises(SinkError, match="unknown preset 'quick'; known: ultrafast"):
        sink(preset="quick")
    open_sink = sink()
    with pytest.raises(SinkError, match="16 x 16"):
        open_sink.write(Frame(i420_from_rgb(np.zeros((16, 16, 3)), ColorSpace()), 0))
    with pytest.raises(SinkError, match="bt601"):
        open_sink.write(Frame(scene(0, ColorSpace("bt601")), 0))
    open_sink.close()
