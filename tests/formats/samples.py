"""Sample texts of every lens profile format, made by ourselves, for the suite that runs over all.

Each text is complete, holds one camera, and is what the other program would write. A format that
does not say the picture's size is read with `SIZE`. The suite (test_formats_conformance.py) fails
for a format in `FORMATS` that has no sample here.
"""

from __future__ import annotations

SIZE = (640, 480)

FREELOOK = """{
  "freelook_lens": 1,
  "size": [640, 480],
  "model": "kannala_brandt",
  "parameters": {"f": 280.0, "k1": -0.0137, "k2": 0.0207, "k3": -0.0128, "k4": 0.0025},
  "center": [318.25, 243.5],
  "field_deg": 180,
  "stretch": [[1.0, 0.005], [0.0, 0.98]],
  "mount_deg": {"yaw": 5, "pitch": -10, "roll": 0}
}
"""

OPENCV_SMALL = """{
  "K": [[280.0, 1.4, 318.0], [0.0, 276.0, 243.0], [0.0, 0.0, 1.0]],
  "D": [-0.0137, 0.0207, -0.0128, 0.0025],
  "image_size_wh": [640, 480],
  "model": "OpenCV fisheye"
}
"""

OPENCV_YAML = """%YAML:1.0
---
calibration_time: "Tue Mar  3 10:20:30 2026"
image_width: 640
image_height: 480
flags: 10
fisheye_model: 1
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 280., 1.3999999999999999e+00, 318., 0., 276., 243., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ -1.3700000000000000e-02, 2.0700000000000000e-02,
       -1.2800000000000001e-02, 2.5000000000000001e-03 ]
avg_reprojection_error: 3.1000000000000000e-01
"""

OPENCV_JSON = """{
    "image_size": [ 640, 480 ],
    "camera_matrix": {
        "type_id": "opencv-matrix",
        "rows": 3,
        "cols": 3,
        "dt": "d",
        "data": [ 280.0, 0.0, 318.0, 0.0, 276.0, 243.0, 0.0, 0.0, 1.0 ]
    },
    // five coefficients
    "dist_coeffs": {
        "type_id": "opencv-nd-matrix",
        "sizes": [ 5 ],
        "dt": "d",
        "data": [ -0.21, 0.04, 1e-4, -2e-4, -0.003 ]
    }
}
"""

OPENCV_XML = """<?xml version="1.0"?>
<opencv_storage>
<nFrames>12</nFrames>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    800. 1.5 318. 0. 790. 243. 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix">
  <rows>1</rows>
  <cols>4</cols>
  <dt>d</dt>
  <data>
    -1.2e-01 3.0e-02 1.0e-03 -5.0e-04</data></distortion_coefficients>
<xi>1.2500000000000000e+00</xi>
</opencv_storage>
"""

ROS_FISHEYE = """image_width: 640
image_height: 480
camera_name: front
camera_matrix:
  rows: 3
  cols: 3
  data: [280.0, 0.0, 318.0, 0.0, 276.0, 243.0, 0.0, 0.0, 1.0]
distortion_model: equidistant
distortion_coefficients:
  rows: 1
  cols: 4
  data: [-0.0137, 0.0207, -0.0128, 0.0025]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
projection_matrix:
  rows: 3
  cols: 4
  data: [150.0, 0.0, 318.0, 0.0, 0.0, 150.0, 243.0, 0.0, 0.0, 0.0, 1.0, 0.0]
"""

ROS_MESSAGE = """header:
  stamp:
    sec: 1700000000
    nanosec: 5
  frame_id: camera
height: 480
width: 640
distortion_model: rational_polynomial
d:
- 0.46
- -2.1
- 0.0004
- -0.0002
- 1.3
- 0.34
- -1.9
- 1.2
k: [500.0, 0.0, 321.0, 0.0, 499.0, 238.0, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [500.0, 0.0, 321.0, 0.0, 0.0, 499.0, 238.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false}
---
"""

KALIBR = """cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.0137, 0.0207, -0.0128, 0.0025]
  distortion_model: equidistant
  intrinsics: [280.0, 276.0, 318.0, 243.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
"""

KALIBR_OMNI = """%YAML:1.0
cam0:
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.02]
  - [0.0, 0.0, -1.0, 0.0]
  - [1.0, 0.0, 0.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: omni
  distortion_coeffs: [-0.12, 0.03, 0.001, -0.0005]
  distortion_model: radtan
  intrinsics: [1.25, 800.0, 790.0, 318.0, 243.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: -0.0125
"""

KALIBR_SPHERES = """cam0:
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.27, 0.58, 155.0, 154.0, 318.0, 243.0]
  resolution: [640, 480]
"""

BASALT = """{
    "value0": {
        "T_imu_cam": [
            {"px": 0.04, "py": -0.07, "pz": 0.01, "qx": 0.0, "qy": 0.0, "qz": 0.7071, "qw": 0.7071}
        ],
        "intrinsics": [
            {
                "camera_type": "kb4",
                "intrinsics": {
                    "fx": 280.0, "fy": 276.0, "cx": 318.0, "cy": 243.0,
                    "k1": -0.0137, "k2": 0.0207, "k3": -0.0128, "k4": 0.0025
                }
            }
        ],
        "resolution": [[640, 480]],
        "imu_update_rate": 200.0,
        "cam_time_offset_ns": 0,
        "vignette": []
    }
}
"""

BASALT_UNIFIED = """{"value0": {"T_imu_cam": [], "resolution": [[640, 480]], "intrinsics": [
    {"camera_type": "ucm",
     "intrinsics": {"fx": 230.0, "fy": 229.0, "cx": 318.0, "cy": 243.0, "alpha": 0.6}}]}}
"""

GYROFLOW = """{
  "name": "Maker_Cam_Wide",
  "camera_brand": "Maker",
  "camera_model": "Cam",
  "calibrated_by": "someone",
  "calibrator_version": "1.5.4",
  "calib_dimension": {"w": 640, "h": 480},
  "orig_dimension": {"w": 640, "h": 480},
  "num_images": 12,
  "asymmetrical": true,
  "fisheye_params": {
    "RMS_error": 0.31,
    "camera_matrix": [[280.0, 0.0, 318.0], [0.0, 276.0, 243.0], [0.0, 0.0, 1.0]],
    "distortion_coeffs": [-0.0137, 0.0207, -0.0128, 0.0025],
    "radial_distortion_limit": null
  }
}
"""

GYROFLOW_SONY = """{
  "calibrator_version": "1.6.0",
  "calib_dimension": {"w": 640, "h": 480},
  "fisheye_params": {
    "RMS_error": 0.5,
    "camera_matrix": [[280.0, 0.0, 320.0], [0.0, 280.0, 240.0], [0.0, 0.0, 1.0]],
    "distortion_coeffs": [1.01, 0.004, -0.03, 0.002, -0.001, 0.0003]
  },
  "distortion_model": "sony"
}
"""

WOODSCAPE = """{
  "extrinsic": {"quaternion": [0.6, -0.6, 0.3741657, -0.3741657], "translation": [3.7, 0.0, 0.7]},
  "intrinsic": {
    "aspect_ratio": 0.99,
    "cx_offset": 1.5,
    "cy_offset": -2.25,
    "height": 480.0,
    "k1": 170.0,
    "k2": -16.0,
    "k3": 24.0,
    "k4": -3.6,
    "model": "radial_poly",
    "poly_order": 4,
    "width": 640.0
  },
  "name": "FV"
}
"""

ONVIF = """<?xml version="1.0" encoding="UTF-8"?>
<tt:LensDescription xmlns:tt="http://www.onvif.org/ver10/schema" FocalLength="1.2">
  <tt:Offset x="0.01" y="-0.02"/>
  <tt:Projection><tt:Angle>30</tt:Angle><tt:Radius>0.31</tt:Radius></tt:Projection>
  <tt:Projection><tt:Angle>60</tt:Angle><tt:Radius>0.6</tt:Radius></tt:Projection>
  <tt:Projection><tt:Angle>90</tt:Angle><tt:Radius>0.85</tt:Radius></tt:Projection>
  <tt:XFactor>0.75</tt:XFactor>
</tt:LensDescription>
"""

OCAMCALIB = """#polynomial coefficients for the DIRECT mapping function

5 -2.054375e+02 0.000000e+00 1.520000e-03 2.100000e-07 2.400000e-09

#polynomial coefficients for the inverse mapping function

6 332.732354 231.936416 37.272333 33.463365 16.465002 3.233581

#center: "row" and "column", starting from 0 (C convention)

243.500000 317.250000

#affine parameters "c", "d", "e"

0.998600 0.000700 -0.000400

#image size: "height" and "width"

480 640

"""

PY_OCAMCALIB = """{
    "date": "01012026_120000",
    "camera_name": "front",
    "valid": [true],
    "taylor_coefficient": [205.4375, 0.0, -0.00152, -2.1e-07, -2.4e-09],
    "distortion_center": [317.25, 243.5],
    "stretch_matrix": [[1.0014, -0.0004], [0.0007, 1.0]],
    "inverse_poly": [3.23065, -8.91919, 9.77833, -1.98176, 205.71460, -0.00650],
    "extrinsics_t": [[[1.0, 0.0, 0.0, -3.2], [0.0, 1.0, 0.0, 3.6], [0.0, 0.0, 1.0, 3.2]]],
    "img_path": ["one.jpg"],
    "rms_overall": 0.24,
    "rms_mean_list": [0.24],
    "rms_std_list": [0.12]
}
"""

COLMAP = [
    "# Camera list with one line of data per camera:\n"
    "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    "# Number of cameras: 1\n" + line + "\n"
    for line in (
        "1 OPENCV_FISHEYE 640 480 230 227 319.25 241.5 -0.0137 0.0207 -0.0128 0.0025",
        "2 SIMPLE_RADIAL 640 480 480 320 240 -0.12",
        "7 THIN_PRISM_FISHEYE 640 480 230 227 319.25 241.5 "
        "-0.03 0.01 0.001 -0.002 -0.003 0.0005 0.002 -0.001",
    )
]

MRCAL_OPENCV8 = """# generated on a day
{
    'lensmodel':  'LENSMODEL_OPENCV8',

    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ 261.25, 258.5, 318.75, 241.5, 0.4, 0.02, 0.0004, -0.0003, 0.001, 0.7, 0.09, 0.0015,],

    'valid_intrinsics_region': [
    [ 40, 30 ],
    [ 600, 25 ],
    [ 610, 450 ],
    [ 35, 455 ],
    [ 40, 30 ],
],

    # extrinsics are rt_fromref
    'extrinsics': [ 0, 0, 0, 0, 0, 0,],

    'imagersize': [ 640, 480,],

    'icam_intrinsics': 0,

    'optimization_inputs': b'P)h>@6aWAK2mk;8ApnWpd$#G',

}
"""  # noqa: E501

MRCAL_SPLINED = """{
    'lensmodel':  'LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=5_Ny=4_fov_x_deg=170',

    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ 261.25, 258.5, 318.75, 241.5, 0, 0.02, 0.02, 0.01, 0.01, 0, -0.02, -0.01, -0.02, -0.02, 0, -0.02, 0.01, 0.01, 0.02, 0.02, 0, 0.02, -0.02, 0, -0.01, 0, 0.01, -0.02, 0.02, 0, 0.02, 0.01, 0, 0.02, -0.02, 0.02, 0, 0.01, 0.02, 0, 0.02, -0.02, 0.01, -0.01,],

    # extrinsics are rt_fromref
    'extrinsics': [ 0, 0, 0, 0, 0, 0,],

    'imagersize': [ 640, 480,],

}
"""  # noqa: E501

SAMPLES: dict[str, list[str]] = {
    "freelook": [FREELOOK],
    "opencv": [OPENCV_SMALL, OPENCV_YAML, OPENCV_JSON, OPENCV_XML],
    "ros": [ROS_FISHEYE, ROS_MESSAGE],
    "kalibr": [KALIBR, KALIBR_OMNI, KALIBR_SPHERES],
    "basalt": [BASALT, BASALT_UNIFIED],
    "ocamcalib": [OCAMCALIB],
    "py-ocamcalib": [PY_OCAMCALIB],
    "colmap": COLMAP,
    "mrcal": [MRCAL_OPENCV8, MRCAL_SPLINED],
    "gyroflow": [GYROFLOW, GYROFLOW_SONY],
    "woodscape": [WOODSCAPE],
    "onvif": [ONVIF],
}
