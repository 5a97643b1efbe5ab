"""Senses: turn what a person does into impressions, and those into stimuli for the partner.

A sense takes what somebody did and returns an :class:`Impression`; :func:`stimuli` turns it into
stimuli for a partner of a given temperament. ``words`` is the sense for what is said; it is loaded
when it is first used.
"""

from miburi.senses.impression import Brought, Impression, stimuli

__all__ = ["Brought", "Impression", "stimuli"]
