"""The house keeps its shape: which room may import which, and how long a module may be."""

import ast
import gc
import re
from collections.abc import Collection
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

HOUSE = Path(__file__).parents[1] / "src" / "miburi"

#: From the ground up. A room imports what stands in the rows before its own, and nothing else.
ROOMS = (
    ("errors", "version"),
    ("ground",),
    ("servos", "languages", "serving"),
    ("robot",),
    ("bma", "feelings"),
    ("ik", "safety", "people"),
    ("calibration", "gestures", "senses"),
    ("bodies",),
    ("card", "hardware"),
    ("emulation", "partner"),
    ("live",),
    ("talk", "wire"),
    ("interface", "client"),
    ("doors",),
    ("studio",),
    ("host", "studies"),
    ("cli",),
    ("__init__", "__main__"),
)
ROW = {room: row for row, rooms in enumerate(ROOMS) for room in rooms}


@cache
def parsed(folder: Path = HOUSE) -> dict[Path, ast.Module]:
    """Return every module below a folder, with its syntax tree: once, as it takes a second."""
    gc.disable()  # else three quarters of the time go into looking for garbage
    try:
        paths = sorted(folder.rglob("*.py"))
        return {path: ast.parse(path.read_text(encoding="utf-8")) for path in paths}
    finally:
        gc.enable()


@cache
def nodes(tree: ast.Module) -> list[ast.AST]:
    """Return all that is in a syntax tree."""
    return list(ast.walk(tree))


#: Names that two public classes may share, with why.
SHARED = {"Servo": "servos has one as it was identified; emulation has one as it answers its bus"}


def room_of(path: Path) -> str:
    return path.relative_to(HOUSE).with_suffix("").parts[0]


@cache
def imports(tree: ast.Module) -> list[tuple[str, str]]:
    """Return every import of ours in a module: the room, and the name that is taken from it."""
    found = []
    for node in nodes(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            first, *rest = node.module.split(".")
            if first == "miburi":
                found += [(rest[0] if rest else name.name, name.name) for name in node.names]
        elif isinstance(node, ast.Import):
            found += [
                (name.name.split(".")[1], "")
                for name in node.names
                if name.name.startswith("miburi.")
            ]
    return found


def libraries(tree: ast.Module) -> set[str]:
    """Return the first names of all that a module imports."""
    whole = {
        name.name for node in nodes(tree) if isinstance(node, ast.Import) for name in node.names
    }
    parts = {
        node.module for node in nodes(tree) if isinstance(node, ast.ImportFrom) and node.module
    }
    return {name.split(".")[0] for name in whole | parts}


def test_imports_point_down() -> None:
    wrong = [
        f"{path.relative_to(HOUSE)}: {target}"
        for path, tree in parsed().items()
        for target, _ in imports(tree)
        if target != room_of(path) and ROW[target] >= ROW[room_of(path)]
    ]
    assert wrong == []


def test_no_modules_import_one_another_in_a_circle() -> None:
    """Also inside a room, and also where an import waits in a function."""
    names = {}
    for path in parsed():
        parts = path.relative_to(HOUSE.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    uses = {name: imported(parsed()[path], names) - {name} for name, path in names.items()}
    TopologicalSorter(uses).prepare()  # a circle raises, and names the modules


def imported(tree: ast.AST, names: Collection[str]) -> set[str]:
    """Return which of ``names`` a module imports, but for types alone."""
    found: set[str] = set()
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.ImportFrom) and node.module:
            whole = {f"{node.module}.{name.name}" for name in node.names}
            found |= whole & set(names) or {node.module} & set(names)
        found |= imported(node, names)
    return found


def test_no_room_reaches_into_the_private_names_of_another() -> None:
    private = [
        f"{path.relative_to(HOUSE)}: {target}.{name}"
        for path, tree in parsed().items()
        for target, name in imports(tree)
        if target != room_of(path) and name.startswith("_") and not name.startswith("__")
    ]
    assert private == []


def test_what_an_extra_brings_is_needed_in_its_rooms_alone() -> None:
    """So no other command can fail without it; what ``bma`` gives to SciPy comes from SciPy."""
    extras = {"scipy": {"studies", "bma"}, "pyarrow": {"studies"}, "ray": {"studies"}}
    wrong = [
        f"{path.relative_to(HOUSE)}: {name}"
        for path, tree in parsed().items()
        for name in libraries(tree) & extras.keys()
        if room_of(path) not in extras[name]
    ]
    assert wrong == []


def test_modules_and_classes_fit_in_one_reading() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in parsed()}
    assert {path: length for path, length in lengths.items() if length > 400} == {}
    written = sorted(length for length in lengths.values() if length > 5)
    assert written[len(written) // 2] < 170
    classes = {
        (path, node.name): (node.end_lineno or 0) - node.lineno + 1
        for path, tree in parsed().items()
        for node in nodes(tree)
        if isinstance(node, ast.ClassDef)
    }
    assert {name: length for name, length in classes.items() if length > 300} == {}


def test_no_two_public_classes_share_a_name() -> None:
    places: dict[str, list[str]] = {}
    for path, tree in parsed().items():
        for node in nodes(tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places.setdefault(node.name, []).append(str(path.relative_to(HOUSE)))
    assert {n: p for n, p in places.items() if len(p) > 1 and n not in SHARED} == {}


def test_tests_use_public_names_alone() -> None:
    """Through the same doors as a user; what a NamedTuple calls _replace is public."""
    private = re.compile(r"_(?!_|replace|asdict|fields)")
    reached = []
    for path, tree in parsed(Path(__file__).parent).items():
        names = [
            ast.unparse(node)
            for node in nodes(tree)
            if isinstance(node, ast.Attribute)
            and private.match(node.attr)
            and ast.unparse(node.value) not in ("self", "cls", "super()")
        ]
        names += [name for _, name in imports(tree) if private.match(name)]
        reached += [f"{path.name}: {name}" for name in names]
    assert reached == []


def test_each_proof_names_a_quicker_test() -> None:
    """One that `make test` runs: a proof whose quicker test has gone leaves its part untested."""
    proofs, whole, tests = list[tuple[str, str]](), set[str](), set[str]()
    for path, tree in parsed(Path(__file__).parent).items():
        for node in nodes(tree):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and node.func.attr == "proof"
            ):
                proofs.append((f"{path.name}:{node.lineno}", ast.literal_eval(node.args[0])))
            elif isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                tests.add(node.name)
                if any("pytest.mark.proof(" in ast.unparse(one) for one in node.decorator_list):
                    whole.add(node.name)
    assert len(proofs) > 100
    assert [one for one in proofs if one[1] not in tests - whole] == []
