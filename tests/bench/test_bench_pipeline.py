"""Whole reframes: every way shows the same thing, turned the same way; how fast is not tested."""

from __future__ import annotations

import dataclasses
import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.bench import pipeline, pipeline_ways
from freelook.bench.pipeline import FIXED, Course, Plan, Row
from freelook.bench.pipeline_clip import Clip, Simulated, cut, equidistant_camera, luma_psnr_db
from freelook.bench.pipeline_ways import WAYS, CannotDo, FfmpegV360, Floor, Job, OpenCv, Ours
from freelook.camera import Camera, make_camera
from freelook.cli import main
from freelook.errors import FreelookError, SourceError
from freelook.formats import Profile
from freelook.formats.freelook import write
from freelook.lens import Equidistant, Equisolid, KannalaBrandt
from freelook.pose_script import parse_script
from freelook.rotations import body_from_view
from freelook.types import ColorSpace
from freelook.viewport import Viewport

FRAMES = 10
VIEW = Viewport((160, 120), 90.0)
CAMERA = equidistant_camera((320, 320))
# all three angles, and far apart: a wrong sign or order shows another part of the world
COURSE = Course("all angles", lambda t_s: (40 - 100 * t_s, -25 + 60 * t_s, 20 - 30 * t_s))


@pytest.fixture(scope="module")
def simulated() -> Simulated:
    return Simulated(CAMERA)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pipeline")


@pytest.fixture(scope="module")
def clip(simulated: Simulated, folder: Path) -> Clip:
    return simulated.record(folder / "made.mp4", FRAMES, lambda: None)


@pytest.fixture(scope="module")
def lens(folder: Path) -> str:
    path = folder / "lens.json"
    path.write_text(write(Profile(CAMERA)), "utf-8")
    return str(path)


@pytest.fixture(scope="module")
def rows(simulated: Simulated, clip: Clip, lens: str, folder: Path) -> list[Row]:
    plan = Plan(clip, lens, CAMERA, VIEW, [COURSE], ["ultrafast"], repeats=1, simulated=simulated)
    return list(pipeline.run(plan, folder))


@pytest.mark.parametrize("place", [0, 1, 2], ids=["freelook", "ffmpeg", "OpenCV"])
def test_every_way_sees_what_is_there(place: int, rows: list[Row]) -> None:
    """34 to 36 dB were measured; looking ten degrees beside it comes to less than 20."""
    row = rows[place]
    if row.skipped == "ffmpeg is not installed":
        pytest.skip(row.skipped)
    assert not row.skipped
    assert row.psnr_db > 30
    assert len(row.wall_s) == len(row.start_s) == 1
    assert row.frames == FRAMES


def test_what_looks_elsewhere_is_far_from_it(
    rows: list[Row], simulated: Simulated, clip: Clip, folder: Path
) -> None:
    """Guards the test above: its bound can be missed."""
    aside = body_from_view(10, 0)
    exact = {
        i: simulated.luma(
            t_ns := clip.time_ns(i), body_from_view(*COURSE.at(t_ns / 1e9)) * aside, VIEW
        )
        for i in (0, FRAMES - 1)
    }
    assert not rows[0].skipped
    assert luma_psnr_db(folder / "0.mp4", exact) < 20


def job(camera: Camera, clip: Clip, poses: list[Rotation]) -> Job:
    return Job(clip, "lens.json", camera, VIEW, poses, None, "veryfast")


def option(command: list[str], name: str) -> str:
    return command[command.index(name) + 1]


def test_all_encode_alike(clip: Clip, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda _name: "/there/ffmpeg")
    still = job(CAMERA, clip, [body_from_view(0, 0)])
    for way in (FfmpegV360(), Floor()):
        command = way.command(still, tmp_path / "out.mp4")
        assert [option(command, f"-{name}") for name in ("crf", "preset", "bf", "g")] == [
            "18",
            "veryfast",
            "0",
            "30",
        ]
    path = OpenCv().command(still, tmp_path / "out.mp4")[-1]
    settings = json.loads(Path(path).read_text("utf-8"))
    assert settings["options"] == {"crf": "18", "preset": "veryfast", "bf": "0"}
    assert settings["key_interval"] == 30
    assert option(Ours().command(still, tmp_path / "out.mp4"), "--preset") == "veryfast"


def test_only_angles_that_change_are_commanded(clip: Clip) -> None:
    """Every command makes the filter compute its map again: none is wasted."""
    poses = [body_from_view(yaw, -15) for yaw in (0, 0, 4, 4, 9)]
    lines = pipeline_ways.v360_commands(job(CAMERA, clip, poses)).splitlines()
    assert lines == ["0.050000 v360 yaw 4.0000;", "0.116667 v360 yaw 9.0000;"]


def test_the_filter_is_told_the_whole_pictures_field(clip: Clip) -> None:
    wide = dataclasses.replace(clip, size=(640, 480))
    camera = make_camera((640, 480), Equidistant(150.0), field_deg=180.0)
    text = pipeline_ways.v360(job(camera, wide, [body_from_view(5, -7, 3)]))
    assert f"ih_fov={np.degrees(640 / 150):.4f}:iv_fov={np.degrees(480 / 150):.4f}:" in text
    assert "yaw=5.0000:pitch=-7.0000:roll=3.0000" in text


def test_a_lens_beside_the_middle_is_cut_out_round_it(clip: Clip, tmp_path: Path) -> None:
    lens = KannalaBrandt(150.0, -0.02, 0.003)
    camera = make_camera((640, 480), lens, center=(300.0, 200.0), field_deg=150.0)
    wide = dataclasses.replace(clip, size=(640, 480))
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed")
    filters = option(
        FfmpegV360().command(job(camera, wide, [body_from_view(0, 0)]), tmp_path / "o.mp4"), "-vf"
    )
    assert filters.startswith("crop=600:400:0:0,v360=")
    assert pipeline_ways.approximation_px(camera) > 0.5
    assert pipeline_ways.approximation_px(CAMERA) < 1e-9


def test_opencv_says_what_lens_it_has_not() -> None:
    camera = make_camera((320, 240), Equisolid(75.0), field_deg=180.0)
    with pytest.raises(CannotDo, match="no Equisolid lens"):
        pipeline_ways.opencv_lens(camera)


def test_without_ffmpeg_its_rows_say_so(
    clip: Clip, lens: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    steps: list[int] = []
    plan = Plan(clip, lens, CAMERA, VIEW, [COURSE], repeats=2, ways=(FfmpegV360(), Floor()))
    found = list(pipeline.run(plan, tmp_path, lambda: steps.append(1)))
    assert [row.skipped for row in found] == ["ffmpeg is not installed"] * 2
    assert len(steps) == plan.steps


class Broken:
    name = "broken"

    def command(self, _job: Job, _out: Path) -> list[str]:
        return [sys.executable, "-S", "-c", "raise SystemExit('first\\nno such lens')"]


def test_a_way_that_fails_says_why(clip: Clip, lens: str, tmp_path: Path) -> None:
    plan = Plan(clip, lens, CAMERA, VIEW, [COURSE], repeats=2, ways=(Broken(),))
    (row,) = pipeline.run(plan, tmp_path)
    assert row.skipped == "it failed: no such lens"


class Copies:
    """Writes a finished file, whatever is asked."""

    name = "copies"

    def __init__(self, source: Path) -> None:
        self._source = source

    def command(self, _job: Job, out: Path) -> list[str]:
        copy = f"import shutil; shutil.copy({str(self._source)!r}, {str(out)!r})"
        return [sys.executable, "-S", "-c", copy]


def test_what_was_written_is_counted(clip: Clip, lens: str, tmp_path: Path) -> None:
    cut(clip.path, tmp_path / "short.mp4", 4 / 30)
    (tmp_path / "text.mp4").write_text("no video")
    ways = (Copies(tmp_path / "short.mp4"), Copies(tmp_path / "text.mp4"))
    plan = Plan(clip, lens, CAMERA, VIEW, [COURSE], repeats=1, ways=ways)
    short, none = pipeline.run(plan, tmp_path)
    assert (short.frames, short.skipped) == (4, "")
    assert short.frames_per_s == 4 / short.wall_s[0]
    assert none.skipped == "it wrote no picture"


def test_a_profile_of_another_camera_is_refused(clip: Clip, lens: str, tmp_path: Path) -> None:
    other = equidistant_camera((640, 480))
    with pytest.raises(FreelookError, match="give the profile of this camera"):
        next(pipeline.run(Plan(clip, lens, other, VIEW), tmp_path))


def test_a_script_is_followed() -> None:
    script = parse_script("t_s,yaw_deg,pitch_deg,roll_deg\n0,10,5,0\n1,20,5,0\n")
    moving, fixed = pipeline.scripted(script)
    assert moving.at(0.5) == pytest.approx((15, 5, 0), abs=0.1)
    assert fixed.at(0.5) == pytest.approx((10, 5, 0))
    assert (fixed.name, fixed.moves) == (FIXED, False)


def damaged_times(source: Path, target: Path) -> None:
    """The same pictures, every time twice."""
    with av.open(str(source)) as old, av.open(str(target), "w") as new:
        stream = old.streams.video[0]
        out = new.add_stream_from_template(stream)
        for index, packet in enumerate(old.demux(stream)):
            if packet.size:
                assert packet.duration
                packet.pts = packet.dts = index // 2 * 2 * packet.duration
                packet.stream = out
                new.mux(packet)


def times(path: Path) -> Iterator[float]:
    with av.open(str(path)) as container:
        for frame in container.decode(video=0):
            assert frame.time is not None
            yield frame.time


def test_a_cut_clip_has_even_times(clip: Clip, tmp_path: Path) -> None:
    damaged_times(clip.path, tmp_path / "odd.mkv")
    found = cut(tmp_path / "odd.mkv", tmp_path / "cut.mp4", seconds=7 / 30)
    assert found.frames == 7
    assert (found.size, found.color) == ((320, 320), ColorSpace())
    assert list(times(found.path)) == pytest.approx([i / found.fps for i in range(7)], abs=1e-4)


def test_no_clip_is_made_of_what_is_none(tmp_path: Path) -> None:
    (tmp_path / "text.mp4").write_text("no video")
    with pytest.raises(SourceError, match=r"text\.mp4"):
        cut(tmp_path / "text.mp4", tmp_path / "cut.mp4")


def test_rows_tell_medians_and_the_start_apart() -> None:
    row = Row(FIXED, "veryfast", "a way", 101, [3.0, 9.0, 2.0], [4.0], [1.0, 1.0, 8.0], [1.0])
    assert row.frames_per_s == pytest.approx(101 / 3)
    assert row.running_frames_per_s == pytest.approx(50)
    assert row.cpu_ms == pytest.approx(30)


@pytest.mark.parametrize(
    ("frames", "spent_s"), [(1, 2.0), (5, 1.0)], ids=["one frame", "no longer than one"]
)
def test_what_is_too_short_tells_nothing_without_the_start(frames: int, spent_s: float) -> None:
    row = Row(FIXED, "veryfast", "a way", frames, [spent_s], [spent_s], [1.0], [1.0])
    assert np.isnan([row.running_frames_per_s, row.cpu_ms]).all()
    assert row.frames_per_s == frames / spent_s


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """One made-up row for each course, one way skipped."""

    def run(plan: Plan, _folder: Path, on_step: object) -> Iterator[Row]:
        for course in plan.courses:
            for preset in plan.presets:
                yield Row(course.name, preset, WAYS[0].name, 60, [1.0], [1.0], [0.2], [0.1], 41.25)
                yield Row(course.name, preset, WAYS[1].name, 60, [4.0], [7.0], [0.1], [0.1])
                yield Row(course.name, preset, WAYS[2].name, 60, skipped="not here")

    monkeypatch.setattr(pipeline, "run", run)


def test_the_command_prints_a_table(
    quick: None, clip: Clip, lens: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", "pipeline", str(clip.path), "--lens", lens, "--seconds", "0.2"]) == 0
    said = capsys.readouterr().out
    assert "6 frames of 320x320 to 1280x720" in said
    parts = ("moving, yaw alone", "60.0", "wrote 60 frames", "41.2", "4.00 x", "skipped: not here")
    for part in parts:
        assert part in said


def test_the_command_prints_json(
    quick: None, clip: Clip, lens: str, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--json", "--preset", "ultrafast,veryfast", "--repeat", "1"]
    assert main(["bench", "pipeline", str(clip.path), "--lens", lens, *options]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["clip"] == {"frames": FRAMES, "frames_per_s": 30.0, "size": [320, 320]}
    assert len(found["rows"]) == 3 * 2 * 3
    ours, ffmpeg, opencv = found["rows"][:3]
    assert (ours["ours_times"], ffmpeg["ours_times"]) == (1.0, 4.0)
    assert (ours["psnr_db"], ffmpeg["psnr_db"]) == (41.25, None)
    assert ours["frames"] == 60
    assert opencv["skipped"] == "not here"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--preset", "quick"], "unknown preset 'quick'; known: ultrafast"),
        (["--size", "640x361"], "640x361: both must be even"),
        (["--repeat", "0"], "at least 1"),
        (["--seconds", "-1"], "above 0"),
        (["--lens", "demo"], "for a CLIP of yours"),
        (["clip.mp4"], "which lens is clip.mp4 taken with"),
        (["clip.mp4", "--lens", "demo", "--source-size", "64x64"], "--source-size is for"),
    ],
)
def test_mistakes_are_named(
    options: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", "pipeline", *options]) == 2
    assert said in capsys.readouterr().err
