"""A body that can be built: printed parts, bill of materials, gauge, checks and pictures.

It takes a robot's description, and makes closed solids in mm and the results of their checks. Needs
the extra ``hardware``. Nobody has printed or built a part yet.
"""
