"""Lenses from measurements, and lenses from lenses of another model.

curve.py    one curve r(theta) through measured angles and radii, with its uncertainty
points.py   a whole camera from 3-D points and the pixels where they are seen
refit.py    a camera of another model that projects as nearly the same as it can
"""

from __future__ import annotations

from .curve import CurveFit, curve_models, fit_curve, rank
from .points import PointFit, fit_points, point_models
from .refit import Refit, refit

__all__ = [
    "CurveFit",
    "PointFit",
    "Refit",
    "curve_models",
    "fit_curve",
    "fit_points",
    "point_models",
    "rank",
    "refit",
]
