"""Docstrings in the words of Markdown, for the reference of the site: see mkdocs.yml.

They are written for Sphinx's roles (``:func:``), literal blocks and doctests.
"""

import re

import griffe

_ROLE = re.compile(r":(?:attr|class|data|exc|func|meth|mod|obj):`~?([^`]*)`")
_DOCTEST = re.compile(r"^>>> .*\n(?:\S.*(?:\n|\Z))*", re.MULTILINE)


class Markdown(griffe.Extension):
    """Rewrites each docstring as it is read."""

    def on_object(self, *, obj: griffe.Object, **_: object) -> None:
        """Rewrite one."""
        if obj.docstring is None:
            return
        text = _ROLE.sub(r"`\1`", obj.docstring.value)
        text = re.sub(r"::$", ":", text, flags=re.MULTILINE)
        if "\nExamples\n---" not in text:  # whose doctests are known
            text = _DOCTEST.sub(lambda found: f"```python\n{found[0].rstrip()}\n```\n", text)
        obj.docstring.value = text
