"""The benchmarks measure what they say; how fast things are is not tested here."""

from __future__ import annotations

import json

import pytest

from freelook.bench import render, render_gl, video_latency
from freelook.bench.figures import Figure
from freelook.bench.page_latency import PageLog, frame_figures, pose_latencies
from freelook.cli import main
from freelook.egl import best_device
from freelook.errors import MissingExtra
from freelook.latency import TIME_BITS, check_bits

SMALL = render.Case("a small view", (320, 240), (64, 48))


def test_every_way_is_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda _name: None)
    monkeypatch.setattr(render, "gl_ways", lambda _scene: [])
    steps: list[int] = []
    ours, floor, opencv, ffmpeg = render.run(SMALL, 30, 1, lambda: steps.append(1))
    assert [len(t.times_ms) for t in (ours, floor, opencv)] == [30, 30, 30]
    assert len(steps) == render.turns(30) + 1 == 3
    assert all(time > 0 for t in (ours, floor, opencv) for time in t.times_ms)
    assert ffmpeg.skipped == "ffmpeg is not installed"


def test_ffmpeg_turns_its_view(monkeypatch: pytest.MonkeyPatch) -> None:
    timing = render.ffmpeg_v360(SMALL, threads=1, frames=3, repeats=1)
    if timing.skipped == "ffmpeg is not installed":
        pytest.skip(timing.skipped)
    assert timing.skipped is None
    assert len(timing.times_ms) == 1


def test_bench_render_prints_json(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(render, "CASES", (SMALL,))
    monkeypatch.setattr("shutil.which", lambda _name: None)
    monkeypatch.setattr(render, "gl_ways", lambda _scene: [("OpenGL", "not here")])
    assert main(["bench", "render", "--rounds", "15", "--threads", "1", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["cases"][SMALL.name]
    ways = [render.OURS, render.FLOOR, render.OPENCV, render.FFMPEG, "OpenGL"]
    assert [row["way"] for row in rows] == ways
    assert rows[0]["times_ours"] == 1.0
    assert rows[3]["skipped"] == "ffmpeg is not installed"
    assert rows[4]["skipped"] == "not here"


def test_opengl_is_timed_and_named_by_what_draws() -> None:
    pytest.importorskip("moderngl")
    if (device := best_device()) is None:
        pytest.skip("no OpenGL here")
    scene = render.make_scene(SMALL)
    rows = render_gl.gl_ways(scene)
    assert [name.partition("\n")[0] for name, _ in rows] == [render_gl.READ_BACK, render_gl.DRAWN]
    for name, way in rows:
        assert not isinstance(way, str)
        assert device.renderer in name
        assert ("software: " in name) == device.software
        way(next(render.poses(0, 1)))


def test_without_opengl_its_rows_say_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(render_gl, "has_moderngl", lambda: False)
    monkeypatch.setattr(render_gl, "best_device", lambda: None)
    rows = render_gl.gl_ways(render.make_scene(SMALL))
    assert [why for _, why in rows] == [str(MissingExtra("moderngl", "gl"))] * 2


def log(frames: list[tuple[float, float, str]], draws: list[tuple[float, float]]) -> PageLog:
    """A page whose clock is 1000 ms behind the station's."""
    return PageLog(frames, draws, [], 1000.0, "none")


def test_a_jump_counts_until_a_view_shows_it() -> None:
    """Views before the jump was sent, or that still look the other way, do not count."""
    steps = [(int(1e9), 8.0), (int(2e9), -8.0), (int(3e9), 8.0)]
    draws = [(990.0, -0.1), (1004.0, 0.1), (1012.0, -0.1), (1030.0, -0.1), (2007.0, 0.1)]
    assert pose_latencies(steps, log([], draws)) == pytest.approx([12.0, 7.0])


def test_a_damaged_stamp_is_no_measurement() -> None:
    time_us = 1_500_000
    word = time_us | check_bits(time_us) << TIME_BITS
    bits = format(word, "056b")[::-1]
    damaged = ("1" if bits[3] == "0" else "0").join([bits[:3], bits[4:]])
    frames = [(510.0, 515.0, bits)] * video_latency.WARM_UP
    frames += [(510.0, 515.0, bits), (511.0, 515.0, damaged)]
    arrived, drawn = frame_figures(log(frames, []))
    assert arrived.values_ms == pytest.approx([10.0])
    assert drawn.values_ms == pytest.approx([15.0])


def test_a_figure_without_values_is_not_a_number() -> None:
    assert str(Figure("nothing").percentile_ms(50)) == "nan"


def test_stamped_pictures_are_decoded_soon() -> None:
    """Only that the path works: the stamps are read, and lie in the past."""
    figure = video_latency.ours(seconds=0.5)
    assert len(figure.values_ms) >= 15
    assert all(0 < value < 5000 for value in figure.values_ms)
