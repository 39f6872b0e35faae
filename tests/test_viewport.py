from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.errors import RenderError
from freelook.viewport import NARROWEST_DEG, WIDEST_DEG, Viewport

sizes = st.tuples(st.integers(2, 300), st.integers(2, 300))


@given(sizes, st.floats(NARROWEST_DEG, WIDEST_DEG))
def test_outer_edges_span_the_field_of_view(size: tuple[int, int], hfov_deg: float) -> None:
    viewport = Viewport(size, hfov_deg)
    left, right = viewport.rays()[0, 0], viewport.rays()[0, -1]
    half_pixel = 0.5 / viewport.focal_px
    edge = np.degrees(np.arctan2(right[0] + half_pixel, right[2]))
    assert edge == pytest.approx(hfov_deg / 2)
    assert left[0] == pytest.approx(-right[0])


@given(sizes, st.floats(NARROWEST_DEG, WIDEST_DEG))
def test_vertical_field_follows_from_square_pixels(size: tuple[int, int], hfov_deg: float) -> None:
    viewport = Viewport(size, hfov_deg)
    top = viewport.rays()[0, 0, 1] - 0.5 / viewport.focal_px
    assert np.degrees(np.arctan(-top)) == pytest.approx(viewport.vfov_deg / 2)


def test_rays_go_right_with_columns_and_down_with_rows() -> None:
    rays = Viewport((5, 3), 90).rays()
    assert rays.shape == (3, 5, 3)
    np.testing.assert_allclose(rays[1, 2], [0, 0, 1], atol=1e-15)
    assert (np.diff(rays[..., 0], axis=1) > 0).all()
    assert (np.diff(rays[..., 1], axis=0) > 0).all()


@pytest.mark.parametrize("hfov_deg", [9.9, 150.1, -90.0, float("nan"), float("inf")])
def test_impossible_fields_of_view_are_refused(hfov_deg: float) -> None:
    with pytest.raises(RenderError, match="10 to 150 degrees"):
        Viewport((640, 480), hfov_deg)


@pytest.mark.parametrize("size", [(1, 480), (640, 1), (0, 0), (-4, 9)])
def test_impossible_sizes_are_refused(size: tuple[int, int]) -> None:
    with pytest.raises(RenderError, match="too small"):
        Viewport(size)
