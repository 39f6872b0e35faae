"""The vehicle's motion taken out of recordings, with a record of its attitude.

`modes` makes the aim, `smoothing` the low-passed path, `containment` keeps a view in the lens.
While flying it is `freelook.gimbal` that does so, which cannot look ahead.
"""
