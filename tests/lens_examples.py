"""A real calibration for every lens model, and where its numbers come from.

Numbers are as published, pixels of the published picture. Where nobody publishes a calibration in
a model, the model was fitted to one that is published in another, which `source` says.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from freelook.camera import Camera, make_camera
from freelook.lens import (
    DoubleSphere,
    Equidistant,
    Equisolid,
    ExtendedUnified,
    FieldOfView,
    KannalaBrandt,
    KannalaBrandt9,
    Lens,
    Mei,
    OCamCalib,
    OpenCVRational,
    Orthographic,
    Perspective,
    Poly3,
    Poly5,
    Polynomial,
    PTLens,
    RadialSpline,
    RadTanThinPrismFisheye,
    Sony,
    SplinedStereographic,
    Stereographic,
    ThinPrismFisheye,
)


@dataclass(frozen=True)
class Example:
    """lens, the full field in degrees that is used in tests, and where the numbers come from."""

    lens: Lens
    field_deg: float
    source: str

    def __str__(self) -> str:
        return f"{type(self.lens).__name__}-{self.source.split(':')[0]}"

    @property
    def camera(self) -> Camera:
        """The lens with its field in the middle of a picture that holds all of it."""
        rim = float(self.lens.radius(np.radians([self.field_deg / 2]))[0])
        return make_camera(
            (2 * ceil(1.1 * rim), 2 * ceil(1.05 * rim)), self.lens, field_deg=self.field_deg
        )


# x and y of 10 x 8 control points in turn, two lines for each row of the grid
CONTROL = """
0.9028 0.7058 0.5533 0.5553 0.3004 0.4234 0.1318 0.3172 0.0321 0.2599
  -0.0392 0.2576 -0.1374 0.3108 -0.3035 0.4144 -0.5536 0.5453 -0.9006 0.6962
0.7628 0.4243 0.4226 0.304 0.1906 0.1938 0.0668 0.1156 0.0154 0.0831
  -0.0191 0.0812 -0.0688 0.11 -0.1901 0.1858 -0.4195 0.2951 -0.7578 0.4157
0.6578 0.2214 0.3222 0.1374 0.1106 0.0659 0.0339 0.0329 0.0079 0.0224
  -0.009 0.0211 -0.0329 0.0292 -0.1066 0.0602 -0.3159 0.1311 -0.65 0.2155
0.597 0.0654 0.2671 0.0368 0.0775 0.0159 0.0254 0.0104 -0.006 -0.004
  0.0059 -0.0045 -0.0231 0.0091 -0.0717 0.0139 -0.2587 0.0346 -0.5876 0.0632
0.5949 -0.0687 0.2648 -0.0396 0.0756 -0.0177 0.0242 -0.0111 -0.0065 0.004
  0.0064 0.0045 -0.0219 -0.0098 -0.0697 -0.0157 -0.2565 -0.0374 -0.5854 -0.0666
0.652 -0.2232 0.316 -0.138 0.105 -0.0652 0.0302 -0.031 0.0067 -0.0198
  -0.0077 -0.0185 -0.0293 -0.0273 -0.101 -0.0595 -0.3097 -0.1317 -0.6442 -0.2172
0.7544 -0.4233 0.4138 -0.3013 0.1827 -0.189 0.0612 -0.109 0.0135 -0.0756
  -0.0172 -0.0736 -0.0633 -0.1034 -0.1821 -0.181 -0.4107 -0.2923 -0.7494 -0.4147
0.8934 -0.702 0.5434 -0.5491 0.2916 -0.4145 0.1255 -0.306 0.0298 -0.2474
  -0.037 -0.2451 -0.1311 -0.2996 -0.2946 -0.4055 -0.5437 -0.5391 -0.8912 -0.6924
"""

EXAMPLES: dict[str, list[Example]] = {
    "perspective": [
        Example(
            Perspective(1360.0),
            78,
            "Logitech C920: 78 degrees over the diagonal of 1920 x 1080 in its data sheet",
        )
    ],
    "stereographic": [
        Example(
            Stereographic(1803.0),
            180,
            "Samyang 8 mm f/2.8: stereographic, 180 degrees over the diagonal (data sheet), "
            "6000 x 4000 pixels",
        )
    ],
    "equidistant": [
        Example(
            Equidistant(210.68),
            188,
            "the 2011 paper's lens: its equation 6, 3.6771 pixels per degree",
        )
    ],
    "equisolid": [
        Example(
            Equisolid(2549.7),
            180,
            "AF DX Fisheye-Nikkor 10.5 mm: equisolid, 180 degrees over the diagonal (data sheet), "
            "6000 x 4000 pixels",
        )
    ],
    "orthographic": [
        Example(
            Orthographic(1666.7),
            178,
            "OP Fisheye-Nikkor 10 mm f/5.6: orthographic by design, on 36 x 24 mm with 6000 x 4000 "
            "pixels",
        )
    ],
    "polynomial": [
        Example(
            Polynomial(339.749, -31.988, 48.275, -7.201),
            190,
            "WoodScape front camera: its calibration files (`radial_poly`), 1280 x 966",
        ),
        Example(
            Polynomial(300.0, 50.0, -20.0),
            188,
            "made up: strong even powers, which are not smooth across the axis",
        ),
    ],
    "kannala_brandt": [
        Example(
            KannalaBrandt(
                190.97847715128717,
                0.0034823894022493434,
                0.0007150348452162257,
                -0.0020532361418706202,
                0.00020293673591811182,
            ),
            190,
            "TUM-VI cam0: Kalibr, in open_vins config/tum_vi, 512 x 512",
        ),
        Example(
            KannalaBrandt(
                278.66723066149086,
                -0.013721808247486035,
                0.020727425669427896,
                -0.012786476702685545,
                0.0025242267320687625,
            ),
            186,
            "UZH-FPV indoor cam0: Kalibr, in open_vins config/uzhfpv_indoor, 640 x 480",
        ),
    ],
    "kannala_brandt_9": [
        Example(
            KannalaBrandt9(
                1220.01943882295,
                0.411035882200732,
                -0.456468282322496,
                0.038303075146701,
                1.298336637403988,
                -1.770471163632234,
                0.654993502244781,
            ),
            110,
            "Project Aria rgb: the round terms of its calibration below, six of nine",
        )
    ],
    "sony": [
        Example(
            Sony(957.7, 0.997998, 0.027488, -0.173768, 0.254315, -0.209115, 0.060694),
            142,
            "Foxeer Legend 1: fitted to 0.12 px to the Kannala-Brandt lens in Gyroflow's profile "
            "(Sony, wide, 1920 x 1080)",
        )
    ],
    "double_sphere": [
        Example(
            DoubleSphere(158.28600034966977, -0.17213086034353243, 0.5931177593944744),
            195,
            "TUM-VI cam0: Usenko et al. 2018, as in Basalt's data/tumvi_512_ds_calib.json",
        )
    ],
    "eucm": [
        Example(
            ExtendedUnified(191.14799816648748, 0.6291060871161842, 1.0418067403139693),
            195,
            "TUM-VI cam0: Usenko et al. 2018, as in Basalt's tests",
        )
    ],
    "mei": [
        Example(
            Mei(
                1336.3220825849971,
                2.2134047507854890,
                1.6798235660113681e-02,
                1.6548773243373522,
                0.0,
                4.2223943394772046e-04,
                4.2462134260997584e-04,
            ),
            185,
            "KITTI-360 image_02: its calibration files, 1400 x 1400",
        )
    ],
    "ocamcalib": [
        Example(
            OCamCalib.from_coefficients((-551.7655, 0.0, 8.372454e-4, -6.474789e-7, 1.235631e-9)),
            190,
            "OCamCalib toolbox: its fisheye sample, calib_results_fisheye.txt, 1024 x 768",
        )
    ],
    "fov": [
        Example(
            FieldOfView(685.7207, 0.897966326944875),
            124,
            "TUM monoVO narrow lens: camera.txt of sequence 50, 1280 x 1024",
        )
    ],
    "poly3": [
        Example(
            Poly3(2061.53, -0.131488),
            47,
            "Zeiss Touit 32 mm f/1.8: lensfun's mil-zeiss.xml (k1 = -0.00792), in units of f of "
            "1500 x 1000 pixels",
        )
    ],
    "poly5": [
        Example(
            Poly5(1284.5, -0.25713, 0.07561),
            80,
            "DJI FC6310: fitted to 0.75 px to lensfun's ptlens lens below",
        )
    ],
    "ptlens": [
        Example(
            PTLens(1289.463, 0.106013, -0.283716, -0.011854),
            84,
            "DJI FC6310: lensfun's actioncams.xml (a = 0.00961599, b = -0.0582928, "
            "c = -0.00551691), in units of f of 1920 x 1080 pixels",
        )
    ],
    "opencv_rational": [
        Example(
            OpenCVRational(
                503.927643,
                k1=3.130577,
                k2=2.324939,
                p1=0.000081,
                p2=-0.000051,
                k3=0.130416,
                k4=3.458652,
                k5=3.350115,
                k6=0.662942,
            ),
            110,
            "Azure Kinect depth camera: panispani/3DReconstruct pointCloudGen/calib.md, 640 x 576",
        ),
        Example(
            OpenCVRational(600.0, 0.1, -0.02, 0.001, -0.002, s1=0.002, s4=-0.0003, tau_x=0.03),
            90,
            "made up: a sensor tilted by 1.7 degrees",
        ),
    ],
    "thin_prism_fisheye": [
        Example(
            ThinPrismFisheye(
                3411.42,
                k1=0.21047,
                k2=0.21102,
                p1=-5.36231e-06,
                p2=0.00051541,
                k3=-0.158023,
                k4=0.406856,
                sx1=-8.46499e-05,
                sy1=0.000861313,
            ),
            84,
            "ETH3D: its documentation of cameras.txt, 6048 x 4032",
        ),
        Example(
            ThinPrismFisheye(190.98, 0.0035, 0.0007, 0.0015, -0.001, -0.002, 0.0002, 0.001, -0.002),
            190,
            "made up: TUM-VI cam0 above, decentred",
        ),
    ],
    "rad_tan_thin_prism_fisheye": [
        Example(
            RadTanThinPrismFisheye(
                1220.01943882295,
                0.411035882200732,
                -0.456468282322496,
                0.038303075146701,
                1.298336637403988,
                -1.770471163632234,
                0.654993502244781,
                -0.000079203062637,
                0.000044207001233,
                -0.000587384169463,
                0.00056439365081,
                0.000515794638327,
                0.000235027249453,
            ),
            110,
            "Project Aria rgb: projectaria_tools data/mps_sample/trajectory, 2880 x 2880",
        ),
        Example(
            RadTanThinPrismFisheye(
                241.746429443359375,
                -0.02694184333086,
                0.103186674416065,
                -0.072545729577541,
                0.01231786981225,
                0.001513113966211,
                -0.000479895825264,
                0.001933769090101,
                0.001900697243399,
                -0.003100696252658,
                -0.000324406602885,
                -0.002613446209579,
                0.000016337084161,
            ),
            190,
            "Project Aria slam-left: projectaria_tools data/mps_sample/trajectory, 640 x 480",
        ),
    ],
    "radial_spline": [
        Example(
            RadialSpline(
                (10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 87.0, 93.0),
                (
                    48.617,
                    97.138,
                    145.552,
                    193.943,
                    242.398,
                    290.847,
                    338.994,
                    386.66,
                    420.245,
                    450.289,
                ),
            ),
            186,
            "UZH-FPV indoor cam0: ten points of the Kannala-Brandt curve above",
        )
    ],
    "splined_stereographic": [
        Example(
            SplinedStereographic(
                241.75, 3, 10, 8, 160.0, tuple(float(text) for text in CONTROL.split())
            ),
            160,
            "Project Aria slam-left: fitted to 0.4 px to the prism lens above",
        )
    ],
}

ALL = [example for examples in EXAMPLES.values() for example in examples]
