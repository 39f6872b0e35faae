"""`freelook calibrate --live`: the command, its HTTP, and the pictures it sends; without a page."""

from __future__ import annotations

import json
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from calibration_bench import BOARD, CAMERA, MIDDLE, PLACES, SIZE, CalibrationBench, apart_px
from commands import running, stop

from freelook.calibration.live import solve_views
from freelook.cli import main, parse
from freelook.cli._calibrate_live import save
from freelook.color import i420_from_rgb, rgb24_from_rgb
from freelook.formats import load_camera
from freelook.sinks import open_sink
from freelook.types import ColorSpace, Frame, Picture
from freelook.web.calibration_picture import jpeg, luma
from freelook.web.calibration_plan import Result, Saved
from freelook.web.security import Guard

WaitUntil = Callable[..., None]


@pytest.fixture
def bench() -> Iterator[CalibrationBench]:
    with CalibrationBench() as running_bench:
        yield running_bench


# --- HTTP


def ask(url: str, body: bytes | None = None, **headers: str) -> tuple[int, bytes]:
    request = urllib.request.Request(
        url, body, headers={k.replace("_", "-"): v for k, v in headers.items()}
    )
    try:
        with urllib.request.urlopen(request, timeout=10) as reply:
            return reply.status, reply.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


def newest(url: str, after: int) -> tuple[dict[str, Any], bytes]:
    _, body = ask(f"{url}api/calibration/newest?after={after}")
    length = int.from_bytes(body[:4], "big")
    return json.loads(body[4 : 4 + length]), body[4 + length :]


def test_each_picture_is_sent_once(bench: CalibrationBench, wait_until: WaitUntil) -> None:
    seen: list[tuple[dict[str, Any], bytes]] = []

    def pull() -> bool:
        seen.append(newest(bench.url, seen[-1][0]["number"] if seen else 0))
        return bool(seen[-1][1])

    wait_until(pull, 10)
    data, picture = seen[-1]
    assert picture.startswith(b"\xff\xd8")
    assert data["look"]["size"] == list(SIZE)
    bench.silent.set()
    wait_until(lambda: not pull(), 10)
    later, nothing = newest(bench.url, seen[-1][0]["number"])
    assert later["number"] > data["number"]
    assert nothing == b""
    _, again = newest(bench.url, 0)  # a page that has just been opened
    assert again.startswith(b"\xff\xd8")


@pytest.mark.parametrize(
    ("path", "body", "status", "words"),
    [
        ("api/calibration/newest?after=-1", None, 400, "must be the number of a look"),
        ("api/calibration/newest?after=" + "9" * 400, None, 400, "must be the number of a look"),
        ("api/calibration/result", None, 404, "not finished"),
        ("api/calibration/action", b'{"action": "dance"}', 400, "known: take, drop, finish"),
        ("api/calibration/action", b'{"action": 7}', 400, 'the text "action"'),
        ("api/calibration/action", b"[", 400, "not JSON"),
        ("api/calibration/action", b'{"action": "take"}', 204, ""),
        ("whep", b"", 404, ""),
    ],
)
def test_what_is_asked_wrongly_is_said(
    bench: CalibrationBench, path: str, body: bytes | None, status: int, words: str
) -> None:
    found, text = ask(bench.url + path, body, Content_Type="application/json")
    assert found == status
    assert words in text.decode()


def test_other_pages_and_strangers_are_kept_out() -> None:
    with CalibrationBench(Guard("secret")) as bench:
        action = bench.url + "api/calibration/action"
        body, kind = b'{"action": "take"}', "application/json"
        assert ask(action, body, Content_Type=kind)[0] == 401
        assert ask(bench.url)[0] == 401
        assert ask(bench.url + "api/calibration/newest")[0] == 401
        foreign = {"Origin": "http://evil.example", "Authorization": "Bearer secret"}
        assert ask(action, body, Content_Type=kind, **foreign)[0] == 403


# --- the command


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["some.jpg"], "leave out some.jpg, or --live"),
        (["--json"], "--json goes with pictures"),
        (["-o", "no/such/folder/lens.json"], "no/such/folder/lens.json: there is no folder"),
        (["-o", __file__], "exists; --overwrite replaces it"),
        (["--report", __file__], "exists; --overwrite replaces it"),
        (["--port", "99999"], "0 to 65535"),
        (["--cert", "none.pem"], "none.pem"),
    ],
)
def test_what_is_wrong_is_said_before_anything_starts(
    arguments: list[str], why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    port = [] if "--port" in arguments else ["--port", "0"]
    assert main(["calibrate", "--live", "rtp://127.0.0.1:0", *port, *arguments]) == 2
    out, err = capsys.readouterr()
    assert err.startswith("freelook calibrate: ")
    assert why in err
    assert out == ""


def test_a_source_that_can_never_work_ends_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--live", "no-such.mp4", "--port", "0", "--no-browser"]) == 2
    assert "no-such.mp4" in capsys.readouterr().err


def test_pictures_or_a_source_are_needed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate"]) == 2
    assert "or --live SOURCE" in capsys.readouterr().err


def test_a_recording_plays_once_like_a_camera(tmp_path: Path, wait_until: WaitUntil) -> None:
    video = tmp_path / "board.mp4"
    gray = BOARD.picture(MIDDLE, noise=1.5)
    chroma = np.full((SIZE[1] // 2, SIZE[0] // 2), 128, np.uint8)
    sink = open_sink(str(video), size=SIZE, fps=10)
    for number in range(30):  # 3 s: enough of it is searched on a slow machine too
        sink.write(Frame(Picture("i420", (gray, chroma, chroma)), 0, number * 100_000_000))
    sink.close()
    with running("calibrate", "--live", str(video), "--board", "8x6") as (process, url):
        wait_until(lambda: newest(url, 0)[0]["source"]["state"] == "ended", 30)
        wait_until(lambda: newest(url, 0)[0]["views"] == 1, 10)
        status, out, errors = stop(process)
    assert (status, errors) == (0, "")
    assert "live 480x360; 1 view\n" in out


@pytest.fixture(scope="module")
def result() -> Result:
    views = [replace(BOARD.view(held), name=f"view {i}") for i, held in enumerate(PLACES[:5])]
    pictures = {view.name: BOARD.picture(PLACES[0]) for view in views}
    return Result(*solve_views(views, SIZE), pictures)


def save_to(result: Result, *arguments: str) -> Saved:
    return save(parse(["calibrate", "--live", "x", "--name", "Bench", *arguments]), result)


def test_profile_and_report_are_written(result: Result, tmp_path: Path) -> None:
    profile, report = tmp_path / "lens.json", tmp_path / "report.html"
    saved = save_to(result, "-o", str(profile), "--report", str(report))
    assert saved.where == f"saved as {profile}, report: {report}"
    assert saved.done
    assert profile.read_text("utf-8") == saved.profile
    camera = load_camera(profile)
    assert apart_px(camera, CAMERA) < 1e-3  # from exact corners
    assert "Calibration of Bench" in report.read_text("utf-8")


def test_without_a_file_the_profile_is_still_there(result: Result, tmp_path: Path) -> None:
    for arguments, why in (
        ((), "not saved here: no -o FILE was given"),
        (("-o", str(tmp_path)), f"not saved: {tmp_path}: Is a directory"),
    ):
        saved = save_to(result, *arguments)
        assert (saved.where, saved.done) == (why, False)
        assert '"kannala_brandt"' in saved.profile


# --- pictures for the page


@pytest.mark.parametrize("layout", ["i420", "nv12", "gray", "rgb24"])
def test_pictures_keep_their_colours(layout: str) -> None:
    """Of every layout; JPEG at quality 75 costs a few grey levels on smooth pictures."""
    y, x = np.mgrid[0:120, 0:160] / 160
    rgb = np.stack([x, y, 1 - x], axis=-1)
    picture = i420_from_rgb(rgb, ColorSpace("bt709"))
    luma_plane, u, v = picture.planes
    if layout == "nv12":
        picture = Picture("nv12", (luma_plane, np.stack([u, v], axis=-1)), picture.color)
    elif layout == "gray":
        picture = Picture("gray", (luma_plane,), picture.color)
        rgb = np.repeat(luma_plane[..., None] / 255, 3, axis=-1)
    elif layout == "rgb24":
        picture = rgb24_from_rgb(rgb)
    data = np.frombuffer(jpeg(picture, 80), np.uint8)
    small = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR))[..., ::-1] / 255
    expected = cv2.resize(rgb, (80, 60), interpolation=cv2.INTER_AREA)
    np.testing.assert_allclose(small, expected, atol=0.08)
    assert np.abs(small - expected).mean() < 0.015
    expected_luma = (
        cv2.cvtColor(picture.planes[0], cv2.COLOR_RGB2GRAY) if layout == "rgb24" else luma_plane
    )
    np.testing.assert_array_equal(luma(picture), expected_luma)
