"""A body that one can build: printed parts, the bill, the gauge, the checks and the pictures.

In goes a robot's description; out come closed solids in mm, and what was found of them. Needs the
extra ``hardware``. Nobody has printed or built a part yet.
"""
