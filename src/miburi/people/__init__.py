"""People whom the partner knows, if they allow it: their names, their facts, their kindness.

    records      the file of people: who they are and what they told it
    memory       that file on the user's own disk, and who is there
    remarks      what they have said in this talk
    recall       which of the facts told answers a question
    attachment   how somebody has treated the partner, over weeks

None of it is in the experiment, nor in the library's default partner.
"""

from miburi.people.attachment import Attachment
from miburi.people.memory import Memory
from miburi.people.records import Acquaintance, Fact, People

__all__ = ["Acquaintance", "Attachment", "Fact", "Memory", "People"]
