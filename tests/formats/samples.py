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

SAMPLES: dict[str, list[str]] = {
    "freelook": [FREELOOK],
    "opencv": [OPENCV_SMALL],
    "gyroflow": [GYROFLOW, GYROFLOW_SONY],
    "woodscape": [WOODSCAPE],
    "onvif": [ONVIF],
}
