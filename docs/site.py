"""What the site adds to the pages of this folder: see mkdocs.yml.

The pages are written to be read in the repository as well. Links that lead out of ``docs/`` lose
their targets here and keep their words; what the project says of itself at its root becomes pages.
The reference is made from the docstrings of each room's public names.
"""

import importlib
import inspect
import pkgutil
import re
import runpy
from pathlib import Path
from types import ModuleType

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent.parent
# This folder is no package.
http_page = runpy.run_path(str(ROOT / "docs" / "http_reference.py"))["http_page"]
#: Pages that stand at the root of the repository.
_PROJECT = {"contributing.md": "CONTRIBUTING.md", "changelog.md": "CHANGELOG.md"}
ROOMS = (
    "feelings", "senses", "gestures", "ik", "bma", "partner", "bodies", "safety", "calibration",
    "hardware", "robot", "servos", "card", "client.remote", "client.connection", "errors",
)  # fmt: skip
_OUTSIDE = re.compile(r"\[([^\]]*)\]\((?:\.\./)+(?!images)[^)]*\)")


@event_priority(-200)
def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Take the script that the offline plugin wants from elsewhere from this folder."""
    config.extra["polyfills"] = ["iframe-worker.js"]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the project's own pages, and those of the reference."""
    for page, source in _PROJECT.items():
        text = re.sub(r"\]\(docs/", "](", (ROOT / source).read_text(encoding="utf-8"))
        files.append(File.generated(config, page, content=_within(text)))
    icon = ROOT / "src/miburi/studio/static/icon.svg"
    files.append(File.generated(config, "images/icon.svg", abs_src_path=str(icon)))
    lines = ["# Reference", "", "Made from the docstrings. Import a name from its module.", ""]
    for room in ROOMS:
        package = importlib.import_module(f"miburi.{room}")
        first = (package.__doc__ or "").strip().splitlines()[0]
        modules = modules_of(package)
        sections = [_section(module, heading=len(modules) > 1) for module in modules]
        content = "\n".join([f"# {room}", "", *sections, ""])
        files.append(File.generated(config, f"reference/{room}.md", content=content))
        lines.append(f"- [`miburi.{room}`]({room}.md): {first}")
    lines += ["- [HTTP](http.md): every request and every type, for programs in any language"]
    files.append(File.generated(config, "reference/http.md", content=http_page()))
    files.append(File.generated(config, "reference/index.md", content="\n".join(lines)))
    (reference,) = (part["Reference"] for part in config.nav or () if "Reference" in part)
    reference += [*(f"reference/{room}.md" for room in ROOMS), "reference/http.md"]
    return files


def modules_of(package: ModuleType) -> list[ModuleType]:
    """Return the modules that users import from: the package, or what is in it."""
    if hasattr(package, "__all__") or not hasattr(package, "__path__"):
        return [package]
    inside = [part.name for part in pkgutil.iter_modules(package.__path__)]
    return [importlib.import_module(f"{package.__name__}.{name}") for name in inside]


def public_names(module: ModuleType) -> list[str]:
    """Return what a module lists as public, or else all names that it defines without a _."""
    if hasattr(module, "__all__"):
        return module.__all__
    whole = griffe.visit(module.__name__, Path(module.__file__ or ""), inspect.getsource(module))
    return [one.name for one in whole.members.values() if one.is_public and not one.is_alias]


def _section(module: ModuleType, *, heading: bool) -> str:
    members = "\n".join(f"        - {name}" for name in public_names(module))
    options = f"    options:\n      show_root_heading: {str(heading).lower()}\n      members:\n"
    return f"::: {module.__name__}\n{options}{members}\n"


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Take the targets from links that lead out of the site."""
    return _within(markdown) if not page.file.src_uri.startswith("learn/") else markdown


def _within(markdown: str) -> str:
    return _OUTSIDE.sub(r"\1", markdown)
