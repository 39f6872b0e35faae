"""Single pictures with the right colours."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from freelook.color import i420_from_rgb, rgb24_from_rgb
from freelook.errors import SinkError
from freelook.sinks import open_sink
from freelook.sinks.picture import SUFFIXES, rgb24
from freelook.types import ColorSpace, Frame, Picture

SPACES = [ColorSpace(matrix, full) for matrix in ("bt601", "bt709") for full in (False, True)]
RGB = (0.85, 0.25, 0.1)


def flat(color: ColorSpace) -> Picture:
    return i420_from_rgb(np.full((33, 47, 3), RGB), color)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("color", SPACES)
def test_colours_in_files(suffix: str, color: ColorSpace, tmp_path: Path) -> None:
    path = tmp_path / f"out{suffix}"
    sink = open_sink(str(path), size=(47, 33), color=color)
    sink.write(Frame(flat(color), 0))
    sink.close()
    read = cv2.imread(str(path))
    assert read is not None
    read = read[..., ::-1]
    assert read.shape == (33, 47, 3)
    assert read.reshape(-1, 3).mean(axis=0) == pytest.approx(np.array(RGB) * 255, abs=3)


def test_layouts_agree() -> None:
    i420 = flat(SPACES[2])
    nv12 = Picture("nv12", (i420.planes[0], np.stack(i420.planes[1:], axis=-1)), i420.color)
    assert np.array_equal(rgb24(i420), rgb24(nv12))
    assert rgb24(rgb24_from_rgb(np.full((4, 4, 3), RGB)))[0, 0].tolist() == [217, 64, 26]
    gray = rgb24(Picture("gray", i420.planes[:1], i420.color))
    assert np.ptp(gray, axis=-1).max() == 0


def test_chroma_sits_in_the_middle_of_its_pixels() -> None:
    """A colour edge stays where the luma edge is: no shift to either side."""
    rgb = np.zeros((8, 40, 3))
    rgb[:, 20:] = (0.9, 0.2, 0.2)
    row = rgb24(i420_from_rgb(rgb, SPACES[3]))[4].astype(int)
    redness = row[:, 0] - row[:, 2]
    assert redness[:17].max() < 12
    assert redness[23:].min() > 160
    assert redness[19] + redness[20] == pytest.approx(redness[0] + redness[-1], abs=25)


def test_there_is_only_one_picture(tmp_path: Path) -> None:
    sink = open_sink(str(tmp_path / "out.png"), size=(47, 33))
    sink.write(Frame(flat(SPACES[2]), 0))
    with pytest.raises(SinkError, match="video file instead"):
        sink.write(Frame(flat(SPACES[2]), 1))
