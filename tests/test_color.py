"""Colour conversion against the numbers of the standards, and back again."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from freelook.color import (
    chroma_planes,
    i420_from_rgb,
    rgb24_from_rgb,
    rgb_from_picture,
    rgb_from_yuv,
    yuv_from_rgb,
)
from freelook.types import ColorSpace, Matrix, Picture

SPACES = [ColorSpace(matrix, full) for matrix in get_args(Matrix) for full in (False, True)]
LIMITED_709, FULL_601 = ColorSpace("bt709", False), ColorSpace("bt601", True)


def test_white_and_black_reach_the_ends_of_the_range() -> None:
    ends = yuv_from_rgb(np.array([[0.0, 0, 0], [1, 1, 1]]), LIMITED_709)
    assert ends == pytest.approx(np.array([[16, 128, 128], [235, 128, 128]]))
    ends = yuv_from_rgb(np.array([[0.0, 0, 0], [1, 1, 1]]), FULL_601)
    assert ends == pytest.approx(np.array([[0, 128, 128], [255, 128, 128]]))


def test_pure_colours_as_in_the_standards() -> None:
    """Colour bars at 100 %: BT.709 limited (SMPTE RP 219), BT.601 full (JFIF)."""
    red_and_blue = np.array([[1.0, 0, 0], [0, 0, 1]])
    bars = np.rint(yuv_from_rgb(red_and_blue, LIMITED_709)).tolist()
    assert bars == [[63, 102, 240], [32, 240, 118]]
    jfif = yuv_from_rgb(red_and_blue, FULL_601)
    assert jfif == pytest.approx(np.array([[76.2, 85.0, 255.5], [29.1, 255.5, 107.3]]), abs=0.06)


@pytest.mark.parametrize("color", SPACES)
def test_there_and_back(color: ColorSpace, rng: np.random.Generator) -> None:
    rgb = rng.random((50, 3))
    assert rgb_from_yuv(yuv_from_rgb(rgb, color), color) == pytest.approx(rgb, abs=1e-12)


@pytest.mark.parametrize("color", SPACES)
def test_pictures_of_odd_size_there_and_back(color: ColorSpace) -> None:
    rgb = np.full((7, 5, 3), (0.8, 0.3, 0.1))
    picture = i420_from_rgb(rgb, color)
    assert [plane.shape for plane in picture.planes] == [(7, 5), (4, 3), (4, 3)]
    assert rgb_from_picture(picture) == pytest.approx(rgb, abs=0.012)


def test_chroma_is_the_mean_of_its_four_pixels() -> None:
    rgb = np.zeros((2, 2, 3))
    rgb[0, 0] = (1, 0, 0)
    u, v = chroma_planes(i420_from_rgb(rgb, FULL_601))
    assert u[0, 0] == round((85 + 3 * 128) / 4)
    assert v[0, 0] == round((255.5 + 3 * 128) / 4)


def test_other_layouts() -> None:
    rgb = np.full((4, 4, 3), (0.2, 0.6, 0.4))
    i420 = i420_from_rgb(rgb, LIMITED_709)
    nv12 = Picture("nv12", (i420.planes[0], np.stack(i420.planes[1:], axis=-1)), LIMITED_709)
    gray = Picture("gray", i420.planes[:1], LIMITED_709)
    assert np.array_equal(rgb_from_picture(nv12), rgb_from_picture(i420))
    assert rgb_from_picture(rgb24_from_rgb(rgb)) == pytest.approx(rgb, abs=0.002)
    assert np.ptp(rgb_from_picture(gray)) == pytest.approx(0, abs=1e-12)
