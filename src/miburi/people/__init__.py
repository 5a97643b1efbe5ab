"""What the partner remembers about people: names, facts, and how they have treated it.

    records      the file of people and of the facts that they told
    memory       that file on the user's own disk, and who is present
    remarks      what was said in the present conversation
    recall       which fact answers a question
    attachment   how somebody has treated the partner, over weeks

The experiment uses none of these modules, and neither does the library's default partner.
"""

from miburi.people.memory import Memory
from miburi.people.records import Acquaintance, Fact, People

__all__ = ["Acquaintance", "Fact", "Memory", "People"]
