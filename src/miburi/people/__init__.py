"""People whom the partner knows, if they allow it: their names, their facts, their kindness.

    memory       who they are and what they told it; one file on the user's own disk
    remarks      what they have said in this talk
    recall       which of the facts told answers a question
    attachment   how somebody has treated the partner, over weeks

None of it is in the experiment, nor in the library's default partner.
"""

from miburi.people.attachment import Attachment
from miburi.people.memory import Acquaintance, Fact, Memory, People

__all__ = ["Acquaintance", "Attachment", "Fact", "Memory", "People"]
