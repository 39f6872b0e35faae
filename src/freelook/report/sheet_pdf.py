"""A printed target as PDF, of vectors, that asks viewers not to fit it to the page."""

from __future__ import annotations

from io import BytesIO

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import FILL_NON_ZERO, Canvas

from ..calibration.sheet import Sheet


def pdf(sheet: Sheet) -> bytes:
    """One page of the sheet's true size."""
    written = BytesIO()
    # invariant: the same sheet is the same file, without the date of its making
    canvas = Canvas(written, (sheet.size[0] * mm, sheet.size[1] * mm), invariant=True)
    canvas.setTitle(sheet.texts[0].words.removeprefix("--target "))
    canvas.setViewerPreference("PrintScaling", "None")
    bottom = sheet.size[1]  # PDF counts from there, upwards
    path = canvas.beginPath()  # all in one: no seams between neighbours
    for x, y, width, height in [*sheet.rectangles.tolist(), *sheet.marks.tolist()]:
        path.rect(x * mm, (bottom - y - height) * mm, width * mm, height * mm)
    for x, y, radius in sheet.circles.tolist():
        path.circle(x * mm, (bottom - y) * mm, radius * mm)
    canvas.drawPath(path, stroke=0, fill=1, fillMode=FILL_NON_ZERO)
    for text in sheet.texts:
        canvas.setFont("Courier-Bold" if text.typed else "Helvetica", text.height * mm)
        canvas.drawString(text.x * mm, (bottom - text.y) * mm, text.words)
    canvas.showPage()
    canvas.save()
    return written.getvalue()
