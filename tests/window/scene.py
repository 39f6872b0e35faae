"""What `shown.py` shows, for those who know what it must look like."""

from __future__ import annotations

import numpy as np

from freelook.camera import make_camera
from freelook.lens import Equidistant
from freelook.types import ColorSpace, Frame, Picture
from freelook.window.eyes import Optics

SCREEN = (400, 300)
CAMERA = make_camera((500, 500), Equidistant(150.0), field_deg=188)
AHEAD_DEG = (12.0, -7.0)
HFOV_DEG = 75.0
OPTICS = Optics("side-by-side", 5.0, (0.1, 0.05))


def frame() -> Frame:
    """I420 of limited range with stripes in luma and colour."""
    y, x = np.mgrid[0:500, 0:500]
    luma = 128 + 80 * np.sin(x / 9) * np.cos(y / 13)
    y, x = np.mgrid[0:250, 0:250]
    u, v = 128 + 50 * np.sin(x / 20), 128 + 50 * np.cos(y / 25)
    planes = tuple(np.rint(plane).astype(np.uint8) for plane in (luma, u, v))
    return Frame(Picture("i420", planes, ColorSpace("bt709")), 0)
