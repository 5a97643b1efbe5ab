"""Fill in the templates of pages and reports: values go in, text comes out."""

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template, select_autoescape


def render(path: Path, **values: object) -> str:
    """Fill in a Jinja2 template; in an ``.html`` file every value is escaped.

    Raises
    ------
    jinja2.UndefinedError
        The template uses a value that was not passed.
    """
    return _template(path).render(values)


@cache
def _template(path: Path) -> Template:
    return Environment(
        loader=FileSystemLoader(path.parent),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    ).get_template(path.name)
