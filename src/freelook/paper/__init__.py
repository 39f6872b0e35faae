"""The 2011 paper reproduced: its figures, tables and equations from this project's own code.

O. Rawashdeh, B. Sababha, "An Image-Processing-Based Gimbal System Using Fisheye Video", Computer
Technology and Application 2 (2011) 85-93.

One module per experiment, each with `section(settings)`; `report` puts them in order and writes
them down, `page` makes the HTML. `printed` holds every number that is taken from the paper.
"""
