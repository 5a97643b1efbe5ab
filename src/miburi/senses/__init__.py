"""Senses: what somebody does becomes an impression, and that becomes stimuli for the partner.

A sense takes what somebody did and returns an :class:`Impression`; :func:`stimuli` turns it into
stimuli for a partner of a given temperament. ``words`` is the sense for what is said; it is loaded
when it is first used.
"""

from miburi.senses.impression import Brought, Impression, stimuli

__all__ = ["Brought", "Impression", "stimuli"]
