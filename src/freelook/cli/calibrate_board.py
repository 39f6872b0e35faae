"""Print a calibration target: a PDF or SVG page of its true size, with a ruler to check it.

  freelook calibrate board -o board.pdf                         a chessboard, as large as A4 allows
  freelook calibrate board --target charuco --paper a3 -o board.pdf    with markers: parts will do
  freelook calibrate board --target chessboard:9x6:0.025 --paper 340x280 -o board.svg
  freelook calibrate board --target april_6x6.yaml --paper a1 -o april.pdf    a file of Kalibr

Print at 100 %, without "fit to page", on stiff paper or glue it to something flat, and measure the
ruler: if its 100 mm are 98, take 0.98 of every size. The page says what to give as --target later.

A kind alone is made as large as the paper allows, in whole millimetres.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import CalibrationError, FreelookError
from ._targets import add_target_arguments, check_target_arguments

SUFFIXES = (".pdf", ".svg")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_target_arguments(parser, default="chessboard")
    parser.add_argument(
        "--paper",
        default="a4",
        metavar="SIZE",
        help="a5 to a0, letter, legal, tabloid or WIDTHxHEIGHT in mm (default: a4)",
    )
    parser.add_argument("-o", "--output", required=True, metavar="FILE", help=".pdf or .svg")
    parser.add_argument("--overwrite", action="store_true", help="replace a file that exists")


def run(args: argparse.Namespace) -> int:
    from ..calibration.sheet import paper_size, sheet_of, target_for

    output = Path(args.output)
    if output.suffix.lower() not in SUFFIXES:
        raise CalibrationError(f"{output}: give -o a name that ends in {' or '.join(SUFFIXES)}")
    if output.exists() and not args.overwrite:
        raise FreelookError(f"{output} exists; --overwrite replaces it")
    check_target_arguments(args)
    paper = paper_size(args.paper)
    target = target_for(args.target, paper, args.board, args.square)
    sheet = sheet_of(target, paper)
    if output.suffix.lower() == ".svg":
        from ..report.sheet_svg import svg

        content = svg(sheet).encode("utf-8")
    else:
        from ..report.sheet_pdf import pdf

        content = pdf(sheet)
    try:
        output.write_bytes(content)
    except OSError as error:
        raise FreelookError(f"{output}: {error.strerror}") from None
    width, height = sheet.size
    print(f"written: {output}, {width:g} x {height:g} mm; print at 100 %, measure the ruler, then")
    print(f"  freelook calibrate shots/*.jpg --target {target.text} -o lens.json")
    return 0
