"""The calibration's page and its figures: they say what the calibration found, and nothing else."""

from __future__ import annotations

import re
from functools import cache
from html.parser import HTMLParser

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("matplotlib", reason="matplotlib is not installed (freelook[plot])")

from freelook.calibration.calibrate import Calibration, calibrate
from freelook.calibration.views import View
from freelook.calibration.words import figures, sentences, weaknesses
from freelook.camera import make_camera
from freelook.lens import Equidistant
from freelook.plots import calibration as plots
from freelook.report.calibration import calibration_page

SIZE = (640, 480)
CAMERA = make_camera(SIZE, Equidistant(150.0), center=(325.0, 232.0), field_deg=180)
BOARD = np.array([[x, y, 0.0] for y in range(6) for x in range(8)]) * 0.03


@cache
def calibrated(leftmost_deg: float = -60.0) -> Calibration:
    """Boards all over the picture, none farther left than said."""
    rng = np.random.default_rng(7)
    views: list[View] = []
    for yaw in (-60, -30, 0, 30, 60):
        for pitch in (-55, 0, 55):
            if yaw < leftmost_deg:
                continue
            towards = Rotation.from_euler("YX", [yaw, pitch], degrees=True)
            tilt = Rotation.from_euler("xyz", [*rng.uniform(-30, 30, 2), rng.uniform(0, 90)], True)
            board = (towards * tilt).apply(BOARD - BOARD.mean(axis=0))
            pixels = CAMERA.project(board + towards.apply([0, 0, 0.3]))
            inside = ((pixels > 0) & (pixels < np.array(SIZE) - 1)).all(axis=1)
            if inside.sum() > 20:
                noisy = pixels[inside] + rng.normal(0, 0.2, (inside.sum(), 2))
                views.append(View(f"shot <{len(views)}>.png", BOARD[inside], noisy))
    views[0].pixels[3] += 25.0  # one corner that was found wrongly
    return calibrate(views, SIZE, "kannala_brandt")


class Tags(HTMLParser):
    """Checks that every element is closed, and collects texts and addresses."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []
        self.sources: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value for name, value in attrs if name in ("src", "href") and value]
        if tag not in ("meta", "img", "link", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def read(page: str) -> Tags:
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    return tags


def test_the_page_says_what_was_found() -> None:
    calibration = calibrated()
    page = read(calibration_page(calibration, {}))
    for line in sentences(calibration):
        assert line in page.texts
    assert f"{calibration.rms_px:.3f} px" in page.texts[page.texts.index("Lens calibration", 3) + 1]


def test_the_page_needs_nothing_from_elsewhere() -> None:
    gray = np.full(SIZE[::-1], 128, np.uint8)
    calibration = calibrated()
    text = calibration_page(calibration, {calibration.views[2].name: gray})
    page = read(text)
    assert len(page.sources) == 6  # four figures; before and after
    assert all(source.startswith("data:image/") for source in page.sources)
    assert "<script" not in text
    assert "shot <2>.png" in " ".join(page.texts)  # a name is text, not markup


def test_pictures_are_those_of_the_view_that_reaches_farthest() -> None:
    calibration = calibrated()
    center = np.array(calibration.camera.center)
    reach = {v.name: np.hypot(*(v.pixels - center).T).max() for v in calibration.views}
    farthest, nearest = max(reach, key=reach.__getitem__), min(reach, key=reach.__getitem__)
    gray = np.zeros(SIZE[::-1], np.uint8)
    texts = " ".join(read(calibration_page(calibration, {farthest: gray, nearest: gray})).texts)
    assert f"{farthest}: corners used" in texts


def test_the_wrong_corner_is_dropped_and_said() -> None:
    calibration = calibrated()
    said = figures(calibration, ["blurred.png"])
    assert 1 <= said["points_dropped"] <= 3  # chance may drop one of 10,000 good ones
    assert np.round(calibration.views[0].pixels[3], 2).tolist() in said["views"][0]["dropped"]
    assert said["rms_all_px"] > said["rms_px"]
    assert said["without_target"] == ["blurred.png"]
    assert any(re.match(r"\d points \(0\.\d%\) dropped", line) for line in sentences(calibration))


def test_a_side_without_corners_is_named() -> None:
    assert weaknesses(calibrated()) == []
    missing = weaknesses(calibrated(leftmost_deg=0.0))
    assert [line for line in missing if "towards the left:" in line]
    assert not [line for line in missing if "towards the right:" in line]


def test_figures_show_every_point() -> None:
    calibration = calibrated()
    pixels, vectors = plots.counted(calibration)
    assert len(pixels) == len(vectors) == len(plots.point_angles(calibration))
    assert np.sqrt(np.mean(np.sum(vectors**2, axis=1))) == pytest.approx(calibration.rms_px)
    histogram = plots.coverage(calibration).axes[1]
    assert sum(bar.get_height() for bar in histogram.patches) == len(pixels)  # type: ignore[attr-defined]
    bars = plots.per_view(calibration).axes[0].patches
    assert len(bars) == len(calibration.views)


def test_residual_arrows_point_from_projected_to_seen() -> None:
    calibration = calibrated()
    pixels, vectors = plots.counted(calibration)
    solution, first = calibration.solution, calibration.views[0]
    ok = solution.inliers[0]
    projected = solution.camera.project(solution.poses[0].apply(first.points[ok]))
    np.testing.assert_allclose(vectors[: ok.sum()], first.pixels[ok] - projected, atol=1e-9)
    np.testing.assert_array_equal(pixels[: ok.sum()], first.pixels[ok])
