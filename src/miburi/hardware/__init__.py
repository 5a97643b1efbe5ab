"""A body that can be built: printed parts, the bill, the gauge, the checks and the pictures.

A robot's description goes in; closed solids in mm, and what was found out about them, come out.
Needs the extra ``hardware``. Nobody has printed or built a part yet.
"""
