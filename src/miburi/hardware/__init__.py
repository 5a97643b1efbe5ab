"""A body that can be built: printed parts, bill of materials, fit gauge, checks and pictures.

From a robot's description, this package makes closed solids in mm, and checks them. It needs
Miburi's extra ``hardware``. Nobody has printed or built a part yet.
"""
