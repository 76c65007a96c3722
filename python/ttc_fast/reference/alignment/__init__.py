"""The motion of a body, from all of its profile.

A cell sees the body at distances ``x = h + p(t)``: the surface of the body there, and the position of the body, which
is the same for all cells.

- ``profile``: the side of a body that faces the sensor, cell by cell
- ``weights``: which cells of which frames to believe
- ``fit``: the positions that the cells agree upon, and the motion
"""
