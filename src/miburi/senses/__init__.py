"""Senses: turn what a person does into impressions, and those into stimuli for the partner.

A sense returns an :class:`Impression` of what somebody did; :func:`stimuli` turns it into stimuli
for a temperament. ``words``, the sense for what is said, is loaded when it is first used.
"""

from miburi.senses.impression import Brought, Impression, stimuli

__all__ = ["Brought", "Impression", "stimuli"]
