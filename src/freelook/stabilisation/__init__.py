"""A recording's quick motions taken out, with a record of the vehicle's attitude.

`smooth_aim` is where the view looks, `smoothing` the low-passed path, `containment` keeps views in
the lens. What needs no look ahead (level horizon, fixed heading) is `freelook.gimbal`'s.
"""
