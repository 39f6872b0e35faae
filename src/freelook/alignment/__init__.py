"""Finding how a video's time runs beside an attitude's, from the motion that both have seen.

`image_turns` measures how the camera turned between frames, `time_offset` correlates that with a
record of attitudes, `live_offset` does so again and again while flying.
"""
