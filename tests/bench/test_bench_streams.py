"""`freelook bench streams` and `soak`: they measure what they say."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import numpy as np
import pytest

from freelook.bench import receivers, soak, streams
from freelook.bench.receivers import SIZE, Stream, raw_pictures
from freelook.bench.resident import Resident, resident_bytes
from freelook.bench.soak import Receiver, Soak
from freelook.bench.video_latency import WARM_UP
from freelook.cli import main
from freelook.errors import FreelookError
from freelook.latency import draw_stamp

STAMP_NS = 5 * 10**9
WRITES = "import sys; sys.stdout.buffer.write(open(sys.argv[1], 'rb').read())"


def i420() -> bytes:
    luma = np.full(SIZE[::-1], 128, np.uint8)
    draw_stamp(luma, STAMP_NS)
    return luma.tobytes() + bytes(SIZE[0] * SIZE[1] // 2)


def test_pictures_that_a_program_writes(tmp_path: Path) -> None:
    """The second is cut off in the middle, which is no picture."""
    file = tmp_path / "pictures"
    file.write_bytes(i420() + i420()[:1000])
    with raw_pictures([sys.executable, "-c", WRITES, str(file)], 60) as (begin_ns, seen):
        ((arrived_ns, stamp_ns),) = list(seen)
    assert stamp_ns == STAMP_NS
    assert arrived_ns > begin_ns


class Late:
    """A receiver that saw pictures 100 s after it began, each 40 ms late; every fourth damaged."""

    name = "late"
    streams = ("udp",)

    def missing(self) -> str | None:
        return None

    def ready(self) -> nullcontext[None]:
        return nullcontext()

    @contextmanager
    def receive(self, stream: Stream, seconds: float) -> Iterator[tuple[int, receivers.Seen]]:
        step_ns, begin_ns = 50_000_000, 10**12
        times = [begin_ns + 100 * 10**9 + i * step_ns for i in range(1000)]
        yield 10**12, ((t, None if i % 4 == 1 else t - 40_000_000) for i, t in enumerate(times))


class Broken(Late):
    name = "broken"

    def ready(self) -> nullcontext[None]:
        raise FreelookError("fell off the table")


class Absent(Late):
    name = "absent"

    def missing(self) -> str | None:
        return "is not installed"


def test_streams_are_told_by_receiver(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stream = nullcontext(Stream("udp", "udp://127.0.0.1:9", 9, Path()))
    monkeypatch.setenv("COLUMNS", "120")  # nothing is broken into lines
    monkeypatch.setattr(streams, "stamped", lambda *_: stream)
    monkeypatch.setattr(streams, "RECEIVERS", (Broken(), Late(), Absent()))
    assert main(["bench", "streams", "--seconds", "10", "--json"]) == 0
    broken, late, absent = json.loads(capsys.readouterr().out)
    assert broken == {"stream": "udp", "receiver": "broken", "skipped": "fell off the table"}
    assert (late["first_s"], late["p50_ms"], late["p95_ms"]) == (100, 40, 40)
    # 201 pictures in 10 s, and two until a whole one ends it; 51 of them were damaged
    assert late["pictures"] == 201 + 2 - 51 - WARM_UP
    assert absent == {"stream": "udp", "receiver": "absent", "skipped": "is not installed"}
    assert main(["bench", "streams", "--seconds", "10"]) == 0
    assert "absent: is not installed" in capsys.readouterr().out


def test_memory_that_grows_has_a_slope() -> None:
    """What happens in the first fifth does not count."""
    grown = Resident("x")
    for second in range(100):
        grown.add(second, 10**6 + (10**9 if second < 20 else 300 * second))
    assert grown.slope() == pytest.approx(300)
    assert grown.settled()[0][0] == 20
    assert resident_bytes(os.getpid()) > 10**6
    assert resident_bytes(2**22 + 1) == 0


def test_soak_says_what_was_seen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    memory = Resident("freelook fly", [0, 10, 20], [5 * 10**6] * 3)
    receiver = Receiver("rtp", ("-i", "x"), begun=2, pictures=77)
    seen = Soak(20, [memory], [receiver], {"stream:x": [19, 21]}, "", "the RTSP server: not here")
    monkeypatch.setattr(soak, "run", lambda _minutes, _advance: seen)
    assert main(["bench", "soak", "--minutes", "1", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["memory"][0]["slope_bytes_per_minute"] == pytest.approx(0, abs=1)
    assert said["mean_rates_hz"] == {"stream:x": 20}
    assert main(["bench", "soak", "--minutes", "1"]) == 0
    said = capsys.readouterr().out
    assert "stream:x: 20.0 views/s" in said
    assert "rtp: begun 2 times, 77 pictures" in said
    assert "left out: the RTSP server: not here" in said


def test_soak_needs_a_receiver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda _name: None)
    with pytest.raises(FreelookError, match="needs the ffmpeg program"):
        soak.run(1)
    assert main(["bench", "soak", "--minutes", "0"]) == 2
