"""freelook against a servo gimbal, modelled: the same head, camera, link and display for both.

`head` is the motion, `figures` what the parts are set to and where that is from, `stages` what a
chain is made of, `servo` the motor, `chains` the two ways from head to eye, `measure` what comes
out, `contest` all of it for one head, `views` the two pictures side by side.
"""
