"""The models against the programs they come from, point by point over the whole field.

OpenCV and COLMAP are asked here, where they are installed. mrcal and OpenCV's omnidir module are
no Python packages that could be: their answers are written down, with what was asked.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.lens import (
    ExtendedUnified,
    FieldOfView,
    KannalaBrandt,
    Lens,
    Mei,
    OpenCVRational,
    RadTanThinPrismFisheye,
    SplinedStereographic,
    ThinPrismFisheye,
    vector,
)
from lens_examples import EXAMPLES


def rays_within(half_deg: float, rng: np.random.Generator, count: int = 3000) -> np.ndarray:
    theta, phi = np.radians(rng.uniform(0, half_deg, count)), rng.uniform(-np.pi, np.pi, count)
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack([x, y, np.cos(theta)], axis=-1)


def camera(lens: Lens, fx: float, fy: float, center: tuple[float, float]) -> Camera:
    return make_camera((2000, 2000), lens, center=center, stretch=np.diag([1.0, fy / fx]))


# (k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y)
OPENCV: dict[str, list[float]] = {
    "plumb bob": [-0.11, 0.02, 0.001, -0.002, 0.001],
    "rational, Azure Kinect": vector(EXAMPLES["opencv_rational"][0].lens)[1:].tolist(),
    "thin prism": [0.1, 0.05, 0.001, -0.002, 0.01, 0.2, 0.03, 0.004, 0.001, -0.002, 0.003, -0.0005],
    "tilted about x": [0.1, 0.05, 0.001, -0.002, 0.01, 0.2, 0.03, 0.004, 0, 0, 0, 0, 0.1, 0],
    "tilted about y": [0.1, 0.05, 0.001, -0.002, 0.01, 0.2, 0.03, 0.004, 0, 0, 0, 0, 0, 0.1],
    "all terms": [0.1, 0.05, 1e-3, -2e-3, 0.01, 0.2, 0.03, 4e-3, 1e-3, -2e-3, 3e-3, 0, 0.05, -0.03],
}  # fmt: skip


@pytest.mark.parametrize("terms", OPENCV.values(), ids=OPENCV)
def test_opencv_rational_agrees_with_opencv(terms: list[float], rng: np.random.Generator) -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed (freelook[render])")
    ours = camera(OpenCVRational(600.0, *terms), 600.0, 580.0, (990.0, 1010.0))
    rays = rays_within(min(60.0, float(np.degrees(ours.theta_max))), rng)
    k = np.array([[600.0, 0, 990], [0, 580, 1010], [0, 0, 1]])
    pixels, _ = cv2.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), k, np.array(terms))
    np.testing.assert_allclose(ours.project(rays), pixels[:, 0], atol=1e-9)


PRISM = [0.01, -0.02, 0.002, -0.001, 0.004, -0.003, 0.0005, -0.0002]
RAD_TAN = [0.01, -0.02, 0.004, -0.003, 5e-4, -2e-4, 0.002, -0.001, 15e-4, -7e-4, 9e-4, 4e-4]
COLMAP: list[tuple[str, Lens, list[float]]] = [
    (
        "OPENCV_FISHEYE",
        KannalaBrandt(300, 0.01, -0.02, 0.004, -0.003),
        [0.01, -0.02, 0.004, -0.003],
    ),
    ("THIN_PRISM_FISHEYE", ThinPrismFisheye(300, *PRISM), PRISM),
    ("RAD_TAN_THIN_PRISM_FISHEYE", RadTanThinPrismFisheye(300, *RAD_TAN), RAD_TAN),
    ("EUCM", ExtendedUnified(300, 0.6, 1.1), [0.6, 1.1]),
    ("FOV", FieldOfView(300, 0.9), [0.9]),
    (
        "FULL_OPENCV",
        OpenCVRational(300, 0.1, 0.05, 1e-3, -2e-3, 0.01, 0.2, 0.03, 4e-3),
        [0.1, 0.05, 1e-3, -2e-3, 0.01, 0.2, 0.03, 4e-3],
    ),
]


@pytest.mark.parametrize(("name", "lens", "terms"), COLMAP, ids=[name for name, _, _ in COLMAP])
def test_models_agree_with_colmap(
    name: str, lens: Lens, terms: list[float], rng: np.random.Generator
) -> None:
    pycolmap = pytest.importorskip("pycolmap", reason="pycolmap is not installed (freelook[dev])")
    params = [300.0, 310.0, 990.5, 1010.5, *terms]  # COLMAP's first pixel is at (0.5, 0.5)
    theirs = pycolmap.Camera(model=name, width=2000, height=2000, params=params)
    ours = camera(lens, 300.0, 310.0, (990.0, 1010.0))
    rays = rays_within(min(80.0, float(np.degrees(ours.theta_max))), rng)
    pixels = np.array(theirs.img_from_cam(rays)) - 0.5
    # COLMAP's FOV takes two terms of a series near the axis, which costs it 4e-9 px
    np.testing.assert_allclose(ours.project(rays), pixels, atol=1e-8)


RAYS = np.array(
    [
        [0.0, 0.0, 1.0],
        [0.15, 0.087, 0.985],
        [-0.073, -0.416, 0.906],
        [-0.633, 0.112, 0.766],
        [0.579, -0.579, 0.574],
        [-0.31, -0.852, 0.423],
        [0.908, 0.33, 0.259],
        [-0.763, 0.64, 0.087],
        [0.865, -0.5, -0.035],
        [0.866, 0.0, 0.5],
        [0.0, 0.866, 0.5],
    ]
)

# mrcal 2.2: mrcal.project(RAYS, 'LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=10_Ny=8_fov_x_deg=160',
# np.array([241.75, 242, 320.5, 242.25, *control])), control as in lens_examples
MRCAL_CUBIC = [
    [320.495131424, 242.259579167],
    [357.005404046, 263.396555083],
    [302.227835759, 138.705958442],
    [154.126132865, 271.555010761],
    [486.717691413, 75.264491326],
    [225.059783806, -19.122296716],
    [621.395084147, 351.807293782],
    [50.524680726, 467.780145603],
    [639.004950696, 56.991697386],
    [579.128693599, 242.05845113],
    [320.079017433, 501.048029923],
]
# the same with 'LENSMODEL_SPLINED_STEREOGRAPHIC_order=2_Nx=5_Ny=4_fov_x_deg=150' and
# control = [0.01 * ((7 * i) % 11 - 5) for i in range(40)]
MRCAL_QUADRATIC = [
    [322.46421875, 247.84625],
    [358.047488521, 269.29615355],
    [308.072157489, 139.182203039],
    [144.171898441, 276.118087417],
    [499.353061099, 68.548195232],
    [217.318272701, -46.793123308],
    [673.218475217, 366.860631311],
    [-23.876274326, 524.818247814],
    [750.616429613, -8.589226909],
    [599.076983644, 242.681911158],
    [321.936091399, 521.733866682],
]


@pytest.mark.parametrize(("order", "pixels"), [(3, MRCAL_CUBIC), (2, MRCAL_QUADRATIC)])
def test_splined_lens_agrees_with_mrcal(order: int, pixels: list[Any]) -> None:
    """In the covered part and beyond it, where mrcal continues its polynomials."""
    quadratic = tuple(0.01 * ((7 * i) % 11 - 5) for i in range(40))
    lens = {
        3: EXAMPLES["splined_stereographic"][0].lens,
        2: SplinedStereographic(241.75, 2, 5, 4, 150.0, quadratic),
    }[order]
    ours = camera(lens, 241.75, 242.0, (320.5, 242.25))
    np.testing.assert_allclose(ours.project(RAYS), pixels, atol=1e-8)


# opencv-contrib-python-headless 5.0: cv2.omnidir.projectPoints(RAYS[None], zeros, zeros,
# K (fx 1336.3220825849971, fy 1335.7883350012958, cx 716.94, cy 705.765), xi, D of KITTI-360)
OMNIDIR = [
    [716.94, 705.765],
    [779.614557424, 742.102414798],
    [685.646375428, 527.456493732],
    [431.854206049, 756.217501404],
    [998.3983356, 424.516705973],
    [556.054953149, 263.64965945],
    [1228.080788136, 891.512451421],
    [246.492495562, 1100.411036457],
    [1288.696898563, 375.589404784],
    [1151.670099583, 705.822453785],
    [716.997800976, 1140.320489385],
]


def test_mei_agrees_with_opencv_omnidir() -> None:
    lens = EXAMPLES["mei"][0].lens
    assert isinstance(lens, Mei)
    ours = camera(lens, lens.f, 1335.7883350012958, (716.94, 705.765))
    np.testing.assert_allclose(ours.project(RAYS), OMNIDIR, atol=1e-8)
