"""The pilot's view in a window of this machine: goggles or a screen on its own video output.

`flight` is the loop; it draws with the shader that the page uses, as late as the screen allows.
"""
