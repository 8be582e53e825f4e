"""The rooms of the package: lines, floors, circles and the longest functions.

    python docs/imports.py                            of this tree
    python docs/imports.py OTHER/TREE .               of two, one after the other
    python docs/imports.py --png imports.png          and a drawing, side by side

A module stands one floor above the highest one it imports. Imports inside functions and those for
annotations only come late and count for circles, not for floors. Lines are those of the files,
the bodies of functions those without docstring.
"""

import argparse
import ast
from collections import Counter, defaultdict
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

PACKAGE = "skfem_dual"


@dataclass(frozen=True)
class House:
    """The modules of a tree and what they import of each other.

    Attributes
    ----------
    lines : dict
        Lines of each module.
    early, late : dict
        The modules each module imports when it is imported itself, and later.
    functions : dict
        Lines of the body of each function, without docstring.
    """

    lines: dict[str, int]
    early: dict[str, set[str]]
    late: dict[str, set[str]]
    functions: dict[str, int]

    @classmethod
    def read(cls, tree: Path) -> "House":
        """The house in the folder that holds the package."""
        root = tree / PACKAGE
        files = {name_of(path, root): path for path in sorted(root.rglob("*.py"))}
        # a package that only gathers names is no module of its own
        files = {n: f for n, f in files.items() if n and (f.stem != "__init__" or long(f))}
        lines, early, late, functions = {}, {}, {}, {}
        for name, path in files.items():
            text = path.read_text(encoding="utf-8")
            tree_of = ast.parse(text)
            lines[name] = len(text.splitlines())
            package = name if path.stem == "__init__" else name.rpartition(".")[0]
            every = targets(ast.walk(tree_of), package, files)
            early[name] = targets(tree_of.body, package, files) - {name}
            late[name] = every - early[name] - {name}
            functions |= {f"{name}.{f}": n for f, n in bodies(tree_of)}
        return cls(lines, early, late, functions)

    @cached_property
    def floors(self) -> dict[str, int]:
        """Floor of each module, 0 for those that import none of ours."""
        return floors(self.early)

    @cached_property
    def rooms(self) -> dict[str, list[str]]:
        """Modules of each room, the lowest room first."""
        rooms = defaultdict(list)
        for name in self.lines:
            rooms[name.split(".")[0]].append(name)
        top = {room: max(self.floors[m] for m in of) for room, of in rooms.items()}
        return {room: rooms[room] for room in sorted(rooms, key=top.__getitem__)}

    def floors_within(self, room: str) -> int:
        """Number of floors of a room, as if it stood alone."""
        own = set(self.rooms[room])
        return 1 + max(floors({m: self.early[m] & own for m in own}).values())

    @cached_property
    def circles(self) -> list[list[str]]:
        """Modules that import each other, late imports included."""
        names = list(self.lines)
        place = {name: i for i, name in enumerate(names)}
        pairs = [(place[m], place[t]) for m in names for t in self.early[m] | self.late[m]]
        start, end = np.array(pairs).T
        graph = coo_array((np.ones(len(pairs)), (start, end)), shape=(len(names), len(names)))
        _, label = connected_components(graph, connection="strong")
        return [
            [names[i] for i in np.nonzero(label == k)[0]]
            for k, n in Counter(label.tolist()).items()
            if n > 1
        ]

    @cached_property
    def steps(self) -> dict[str, set[str]]:
        """Imports that no chain of others implies."""
        below: dict[str, set[str]] = {}
        for module in sorted(self.lines, key=self.floors.__getitem__):
            targets = self.early[module]
            below[module] = targets.union(*(below[t] for t in targets))
        return {m: t - set().union(*(below[u] for u in t)) for m, t in self.early.items()}


def name_of(path: Path, root: Path) -> str:
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def long(path: Path) -> bool:
    return len(path.read_text(encoding="utf-8").splitlines()) > 1


def targets(nodes, package: str, files: dict[str, Path]) -> set[str]:
    """Modules of ours that import statements name."""
    out = set()
    for node in nodes:
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        parts = package.split(".") if package else []
        base = parts[: len(parts) - node.level + 1] + (node.module or "").split(".")
        base = ".".join(part for part in base if part)
        inner = {f"{base}.{alias.name}".strip(".") for alias in node.names}
        out |= inner & set(files) or {base} & set(files)
    return out


def floors(imports: dict[str, set[str]]) -> dict[str, int]:
    """The longest chain of imports below each module.

    Raises
    ------
    ValueError
        If modules import each other in a circle.
    """
    out: dict[str, int] = {}
    while len(out) < len(imports):
        ready = [m for m, t in imports.items() if m not in out and t <= out.keys()]
        if not ready:
            raise ValueError(f"expected no circles of imports, got {set(imports) - set(out)}")
        out |= {m: 1 + max((out[t] for t in imports[m]), default=-1) for m in ready}
    return out


def bodies(tree: ast.AST, prefix: str = ""):
    """Names of functions and lines of their bodies, those inside classes and functions too."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            first = node.body[1:] if ast.get_docstring(node, clean=False) else node.body
            start = first[0].lineno if first else node.end_lineno
            yield prefix + node.name, node.end_lineno - start + 1
        inside = isinstance(node, ast.FunctionDef | ast.ClassDef)
        yield from bodies(node, prefix + node.name + "." if inside else prefix)


def describe(house: House, title: str) -> None:
    """Print the rooms of a house, its circles and its longest functions."""
    total = sum(house.lines.values())
    print(f"\n{title}: {len(house.lines)} modules, {total} lines")
    print(f"{1 + max(house.floors.values())} floors, circles: {len(house.circles)}")
    for circle in house.circles:
        print("  " + ", ".join(circle))
    print(f"\n{'room':12s}{'modules':>8s}{'lines':>8s}{'share':>8s}{'floors':>8s}")
    for room, modules in house.rooms.items():
        n = sum(house.lines[m] for m in modules)
        print(f"{room:12s}{len(modules):8d}{n:8d}{n / total:8.1%}{house.floors_within(room):8d}")
    print("\nlongest functions")
    for name, n in sorted(house.functions.items(), key=lambda item: -item[1])[:10]:
        print(f"{n:5d}  {name}")
    print("\nlongest files")
    for name, n in sorted(house.lines.items(), key=lambda item: -item[1])[:5]:
        print(f"{n:5d}  {name}")


def floor_plan(axis: Axes, house: House) -> None:
    """Each module a disc on its floor, as large as its file, in the column of its room.

    Imports that a chain of others implies are left out; those that come late are red.
    """
    place, left = {}, 0.0
    for k, (room, modules) in enumerate(house.rooms.items()):
        on_floor = defaultdict(list)
        for module in modules:
            on_floor[house.floors[module]].append(module)
        width = max(2, *(len(of) for of in on_floor.values()))  # for its name to have room
        for floor, of in on_floor.items():
            shift = left + (width - len(of) + 1) / 2
            place |= {module: (shift + i, floor) for i, module in enumerate(of)}
        axis.axvspan(left, left + width, color="0.95" if k % 2 else "0.985", zorder=0)
        axis.text(left + width / 2, -1.3, room, rotation=90, ha="center", va="top", size=9)
        left += width
    for imports, colour in ((house.steps, "0.55"), (house.late, "tab:red")):
        for module, others in imports.items():
            for other in others:
                axis.plot(*zip(place[module], place[other], strict=True), colour, lw=0.6)
    x, y = np.array([place[m] for m in house.lines]).T
    axis.scatter(x, y, [house.lines[m] / 3 for m in house.lines], color="tab:blue", zorder=3)
    axis.set(xlim=(0, left), ylim=(-1, None), ylabel="floor")
    axis.set_xticks([])
    axis.spines[["top", "right", "bottom"]].set_visible(False)


def draw(houses: dict[str, House], path: Path) -> None:
    """Write the floor plans of some houses side by side."""
    figure, axes = plt.subplots(
        1, len(houses), figsize=(8 * len(houses), 8), sharey=True, squeeze=False
    )
    for axis, (title, house) in zip(axes[0], houses.items(), strict=True):
        floor_plan(axis, house)
        axis.set_title(title)
    figure.savefig(path, dpi=130, bbox_inches="tight")
    plt.close(figure)


def main(trees: list[Path], png: Path | None = None) -> dict[str, House]:
    """Describe the houses of some trees, and draw them."""
    houses = {tree.resolve().name: House.read(tree) for tree in trees}
    for title, house in houses.items():
        describe(house, title)
    if png is not None:
        draw(houses, png)
    return houses


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("trees", nargs="*", type=Path, default=[Path(__file__).parents[1]])
    parser.add_argument("--png", type=Path)
    arguments = parser.parse_args()
    main(arguments.trees, arguments.png)
