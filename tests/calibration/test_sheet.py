"""Printed targets: of true size, and found again by their own detectors."""

from __future__ import annotations

from xml.etree import ElementTree

import cv2
import numpy as np
import pypdfium2
import pytest
from numpy.typing import NDArray

from freelook.calibration.sheet import PAPERS, Sheet, paper_size, sheet_of, target_for
from freelook.calibration.targets import KINDS, Target, parse_target
from freelook.errors import CalibrationError
from freelook.report.sheet_pdf import pdf
from freelook.report.sheet_svg import svg

Gray = NDArray[np.uint8]
Floats = NDArray[np.float64]

POINT_MM = 25.4 / 72
DPI = 90
PX_PER_MM = DPI / 25.4
SPACE = "{http://www.w3.org/2000/svg}"


def rasterised_pdf(data: bytes) -> Gray:
    page = pypdfium2.PdfDocument(data)[0]
    picture = page.render(scale=DPI / 72, grayscale=True).to_numpy()
    return np.ascontiguousarray(picture.reshape(picture.shape[:2]))


def rasterised_svg(text: str) -> Gray:
    """Its rectangles and circles; no words."""
    root = ElementTree.fromstring(text)
    width, height = (float(root.attrib[key].removesuffix("mm")) for key in ("width", "height"))
    assert root.attrib["viewBox"] == f"0 0 {width:g} {height:g}"
    fine = 6  # drawn so many times as large, without smooth edges
    scale = fine * PX_PER_MM
    picture = np.full((round(height * scale), round(width * scale)), 255, np.uint8)
    for shape in root.iter(SPACE + "rect"):
        if "fill" not in shape.attrib:
            x, y, w, h = (float(shape.attrib[key]) * scale for key in ("x", "y", "width", "height"))
            picture[round(y) : round(y + h), round(x) : round(x + w)] = 0
    for shape in root.iter(SPACE + "circle"):
        x, y, r = (float(shape.attrib[key]) * scale for key in ("cx", "cy", "r"))
        at = (round((x - 0.5) * 16), round((y - 0.5) * 16))
        cv2.circle(picture, at, round(r * 16), 0, -1, cv2.LINE_8, 4)
    small = cv2.resize(picture, None, fx=1 / fine, fy=1 / fine, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8)


def picture_of(sheet: Sheet, form: str) -> tuple[Gray, Floats]:
    """The sheet as it is printed, and its pixels per millimetre, across and down."""
    if form == "svg":
        return rasterised_svg(svg(sheet)), np.full(2, PX_PER_MM)
    picture = rasterised_pdf(pdf(sheet))  # stretched to whole pixels
    return picture, picture.shape[::-1] / np.array(sheet.size)


def size_error_mm(target: Target, picture: Gray, px_per_mm: Floats) -> float:
    """How far found points are, at worst, from a print of true size, turned and shifted."""
    with np.errstate(under="ignore"):  # of bends that are not there at all
        view = target.find(picture, "print")
    assert view is not None
    assert len(view.pixels) == len(target.points)  # all of them
    printed_mm, true_mm = view.pixels / px_per_mm, 1000 * view.points[:, :2]
    printed_mm, true_mm = printed_mm - printed_mm.mean(0), true_mm - true_mm.mean(0)
    u, _, vt = np.linalg.svd(true_mm.T @ printed_mm)  # a turn or a mirrored turn, no scale
    return float(np.abs(true_mm @ u @ vt - printed_mm).max())


# a tenth of a pixel of the picture it was found in, and the length of a page's error in all
SMALL_MM = 0.15 / PX_PER_MM


@pytest.mark.parametrize(
    ("form", "kind"),
    [*(("pdf", kind) for kind in KINDS), ("svg", "chessboard"), ("svg", "acircles")],
)
def test_prints_are_of_true_size_and_found_again(form: str, kind: str) -> None:
    target = target_for(kind, PAPERS["a4"])
    picture, px_per_mm = picture_of(sheet_of(target, PAPERS["a4"]), form)
    assert size_error_mm(target, picture, px_per_mm) < SMALL_MM
    assert parse_target(target.text).text == target.text


def test_the_page_and_its_words() -> None:
    """Millimetres of the page and of a square; the words are there to be copied."""
    target = parse_target("chessboard:9x6:0.021")
    page = pypdfium2.PdfDocument(pdf(sheet_of(target, PAPERS["letter"])))[0]
    assert np.array(page.get_size()) * POINT_MM == pytest.approx((279.4, 215.9), abs=0.01)
    words = page.get_textpage().get_text_range()
    assert "--target chessboard:9x6:0.021" in words
    assert "Print at 100 %, measure this: 100 mm" in words
    root = ElementTree.fromstring(svg(sheet_of(target, PAPERS["letter"])))
    assert (root.attrib["width"], root.attrib["height"]) == ("279.4mm", "215.9mm")
    (squares,) = (group for group in root.iter(SPACE + "g") if group.attrib["id"] == "squares")
    assert {square.attrib["width"] for square in squares} == {"21.0000"}
    assert "--target chessboard:9x6:0.021" in "".join(root.itertext())


def test_viewers_are_asked_not_to_scale() -> None:
    data = pdf(sheet_of(parse_target("chessboard:9x6:0.02"), PAPERS["a4"]))
    assert b"/PrintScaling /None" in data
    assert data == pdf(sheet_of(parse_target("chessboard:9x6:0.02"), PAPERS["a4"]))


@pytest.mark.parametrize("form", ["pdf", "svg"])
def test_the_ruler_is_100_mm_long(form: str) -> None:
    """Measured in the picture, from outer edge to outer edge of the end ticks."""
    sheet = sheet_of(parse_target("chessboard:9x6:0.02"), PAPERS["a4"])
    picture, px_per_mm = picture_of(sheet, form)
    strip = 255.0 - picture[-round(8 * PX_PER_MM) :, : round(107 * PX_PER_MM)]  # beside its words
    line = strip[np.argmax(strip.sum(axis=1))]
    covered = np.minimum(line / np.median(line[line > 0]), 1)  # of each pixel; ticks are darker
    assert covered.sum() / px_per_mm[0] == pytest.approx(100, abs=0.5 / PX_PER_MM)


def inside(sheet: Sheet) -> bool:
    """Whether the target is on the paper, and clear of the ruler's strip."""
    boxes = np.concatenate(
        [
            np.column_stack(
                [sheet.rectangles[:, :2], sheet.rectangles[:, :2] + sheet.rectangles[:, 2:]]
            ),
            np.column_stack(
                [
                    sheet.circles[:, :2] - sheet.circles[:, 2:],
                    sheet.circles[:, :2] + sheet.circles[:, 2:],
                ]
            ),
        ]
    )
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    return bool((low > 0).all() and high[0] < sheet.size[0] and high[1] < sheet.size[1] - 20)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("paper", ["a5", "letter", "a1", "100x100", "700x120"])
def test_a_kind_alone_fills_the_paper(kind: str, paper: str) -> None:
    size = paper_size(paper)
    target = target_for(kind, size)
    sheet = sheet_of(target, size)
    assert sorted(sheet.size) == sorted(size)
    assert inside(sheet)
    side = float(target.text.split(":")[2])
    assert side * 1000 == pytest.approx(round(side * 1000))  # whole millimetres
    bigger = target_for(kind, size, side=side + 0.001)
    with pytest.raises(CalibrationError, match="too large for"):
        sheet_of(bigger, size)


def test_what_does_not_fit_is_told_what_would() -> None:
    target = parse_target("chessboard:9x6:0.05")
    with pytest.raises(
        CalibrationError, match=r"too large for a4 .* --paper a1 or --paper 600x472"
    ) as told:
        sheet_of(target, PAPERS["a4"])
    assert "sizes up to 0.46 of these" in str(told.value)
    for paper in ("a1", "600x472"):
        assert inside(sheet_of(target, paper_size(paper)))


def test_papers() -> None:
    assert paper_size("A3") == (297, 420)
    assert paper_size("600x400.5") == (600, 400.5)
    with pytest.raises(CalibrationError, match=r"unknown paper 'foolscap'; give one of a5, a4"):
        paper_size("foolscap")
    with pytest.raises(CalibrationError, match="sides can be 100 to 5000 mm"):
        paper_size("50x200")
    with pytest.raises(CalibrationError, match="smaller than a millimetre"):
        target_for("chessboard", PAPERS["a5"], counts=(250, 180))
    with pytest.raises(CalibrationError, match="how many inner corners"):
        sheet_of(parse_target("chessboard:0.02"), PAPERS["a4"])
