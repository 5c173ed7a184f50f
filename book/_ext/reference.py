"""The reference of package and companion, from docstrings, and the versions they ran with.

`public` describes what some modules offer: the names in `armlock.__all__` under the name they
are imported by, `armlock.Loop`, and with the option `all` also those that are reached through
the module, `armlock.sensors.COMMON`: those of its own `__all__`, if it has one. A constant is
described by a comment (`#:`) above it. `public-index` lists all names of `armlock.__all__`.
`versions` is a table of the packages that the book was computed with.

Docstrings are written to be read in a terminal too. What reStructuredText would take for
markup there, such as the bars of an absolute value, is escaped; `name` in backticks becomes a
link if it is something that the package offers, and code otherwise.
"""

import importlib
import inspect
import pkgutil
import platform
import re
import sys
from importlib.metadata import requires, version
from typing import ClassVar

from docutils.parsers.rst import directives
from packaging.requirements import Requirement
from sphinx.ext import autosummary
from sphinx.pycode import ModuleAnalyzer
from sphinx.util.docutils import SphinxDirective

import armlock

BUILD_TOOLS = ["jupyter-book", "sphinx", "myst-nb", "ipykernel"]
# Code, a role with its text, a name in single backticks; what lies between is plain text.
INLINE = re.compile(r"(``.+?``|:[\w:]+:`[^`]+`|`[^`]+`(?!_))")
TRAILING_UNDERSCORE = re.compile(r"(?<=\w)_(?!\w)")
SHARED = re.compile(r"(\w+(?:, \w+)+)( : .*)")


def comments(module):
    """Return the data of a module that a comment describes: name to its lines.

    One comment may describe several lines of constants; each of them then has it.
    """
    analyzer = ModuleAnalyzer.for_module(module.__name__)
    found = analyzer.find_attr_docs()
    documented, lines = {}, None
    for name in sorted(analyzer.tagorder, key=lambda name: analyzer.tagorder[name]):
        if ("", name) in found:
            lines = found["", name][:]
            prepare(None, "data", name, None, None, lines)
        elif not name.isupper():
            lines = None
        if lines is not None:
            documented[name] = lines
    return documented


def home(name):
    """Return the module that defines a name of `armlock.__all__`."""
    thing = getattr(armlock, name)
    if inspect.isclass(thing) or inspect.isroutine(thing):
        return thing.__module__
    for path, module in sorted(sys.modules.items()):
        ours = path.startswith("armlock.") and vars(module).get(name) is thing
        if ours and name in comments(module):
            return path
    raise LookupError(f"armlock.{name} has no comment (#:) where it is defined")


def described(path, thing, module, lines):
    """Return the lines that describe one name."""
    if inspect.isclass(thing):
        options = ["   :members:", "   :show-inheritance:"]
        return [f".. autoclass:: {path}", *options, ""]
    if inspect.isroutine(thing) or hasattr(thing, "__wrapped__"):
        return [f".. autofunction:: {path}", ""]
    full = f"{module.__name__}.{path.rsplit('.', 1)[1]}"
    head = [f".. py:data:: {path}"]
    if isinstance(thing, int | float | str):
        head.append(f"   :value: {thing!r}")
    if full != path:
        head.append(f"   :canonical: {full}")
    return [*head, "", *(f"   {line}" for line in lines), ""]


def modules(names):
    """Return the modules that are named; "package.*" stands for all in a package.

    They are in the order in which the package imports them, the others last.
    """
    if not names.endswith(".*"):
        return names.split()
    package = importlib.import_module(names.removesuffix(".*"))
    for info in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        if not info.name.endswith("__main__"):
            importlib.import_module(info.name)
    inner = [m.__name__ for m in vars(package).values() if inspect.ismodule(m)]
    return [name for name in inner if name.startswith(f"{package.__name__}.")]


class Public(SphinxDirective):
    """Describe the public names of modules, in the order of their source."""

    required_arguments = 1
    final_argument_whitespace = True
    option_spec: ClassVar = {"all": directives.flag}

    def run(self):
        """Return the descriptions."""
        text = []
        for module_name in modules(self.arguments[0]):
            module = importlib.import_module(module_name)
            if self.arguments[0].endswith(".*"):
                text += [f".. rubric:: {str(module.__doc__).splitlines()[0]}", ""]
            self.env.note_dependency(inspect.getfile(module))
            documented = comments(module)
            own = [name for name in armlock.__all__ if home(name) == module_name]
            for name in own:
                lines = documented.get(name, [])
                text += described(f"armlock.{name}", getattr(armlock, name), module, lines)
            if "all" in self.options:
                for name in getattr(module, "__all__", vars(module)):
                    thing = vars(module)[name]
                    ours = getattr(thing, "__module__", None) == module_name
                    ours &= inspect.isclass(thing) or callable(thing)
                    if name.startswith("_") or name in own or not (ours or name in documented):
                        continue
                    lines = documented.get(name, [])
                    text += described(f"{module_name}.{name}", thing, module, lines)
        return self.parse_text_to_nodes("\n".join(text))


class PublicIndex(SphinxDirective):
    """List the names of `armlock.__all__` with the first line of their docstrings."""

    def run(self):
        """Return a table."""
        text = [".. autosummary::", "   :nosignatures:", ""]
        for name in armlock.__all__:
            if inspect.isclass(thing := getattr(armlock, name)) or callable(thing):
                text.append(f"   armlock.{name}")
        return self.parse_text_to_nodes("\n".join(text))


class Versions(SphinxDirective):
    """Show the versions of Python and of the packages."""

    def run(self):
        """Return a table."""
        direct = {Requirement(line).name for line in requires("armlock") or []}
        names = ["armlock", *sorted(direct.union(BUILD_TOOLS))]
        rows = [("Python", platform.python_version())] + [(n, version(n)) for n in names]
        text = [".. list-table::", "   :header-rows: 1", "", "   * - Package", "     - Version"]
        for row in rows:
            text += [f"   * - {row[0]}", f"     - {row[1]}"]
        return self.parse_text_to_nodes("\n".join(text))


def link_or_code(piece):
    """Turn a name in backticks into a link, or into code."""
    name = piece.strip("`")
    bare = name.removesuffix("()").removeprefix("armlock.")
    if bare.split(".")[0] in armlock.__all__:
        return f":py:obj:`~armlock.{bare}`"
    return f"``{name}``"


def inline(piece):
    """Escape plain text, whose bars and trailing underscores would be markup; link names."""
    if not INLINE.fullmatch(piece):
        return TRAILING_UNDERSCORE.sub(r"\\_", piece.replace("|", r"\|"))
    return link_or_code(piece) if re.match(r"`[^`]", piece) else piece


def separated(lines):
    """Give attributes that share a line one each: Napoleon does so for parameters only."""
    done, inside, at = [], False, 0
    while at < len(lines):
        if at + 1 < len(lines) and lines[at + 1].startswith("---"):
            inside = lines[at] == "Attributes"
        end = at + 1
        if inside and (shared := SHARED.fullmatch(lines[at])):
            while end < len(lines) and lines[end].startswith(" "):
                end += 1
            for name in shared[1].split(", "):
                done += [name + shared[2], *lines[at + 1 : end]]
        else:
            done.append(lines[at])
        at = end
    return done


def prepare(app, what, name, thing, options, lines):
    """Prepare a docstring, outside its formulas and examples."""
    lines[:] = separated(lines)
    skip = None
    for number, line in enumerate(lines):
        indent = len(line) - len(line.lstrip())
        if skip is not None and (not line.strip() or indent > skip):
            continue
        skip = indent if line.lstrip().startswith(".. math::") else None
        if skip is not None or line.lstrip().startswith((">>>", "...")):
            continue
        lines[number] = "".join(map(inline, INLINE.split(line)))


def plain_type(app, env, node, contnode):
    """Leave what stands for a type in words, "float array", as it is."""
    if node.get("reftype") == "class" and node.get("refdoc", "").startswith("book/api/"):
        return contnode
    return None


def setup(app):
    """Register with Sphinx."""
    app.setup_extension("sphinx.ext.autodoc")
    app.setup_extension("sphinx.ext.autosummary")
    # A summary does not end behind one of these.
    more = ("Eq.", "Sec.", "Secs.", "Fig.")
    autosummary.WELL_KNOWN_ABBREVIATIONS += more  # type: ignore[assignment]
    app.setup_extension("sphinx.ext.napoleon")
    app.setup_extension("sphinx.ext.viewcode")
    app.add_directive("public", Public)
    app.add_directive("public-index", PublicIndex)
    app.add_directive("versions", Versions)
    # Before Napoleon, which has priority 500: it makes markup of its own.
    app.connect("autodoc-process-docstring", prepare, priority=400)
    app.connect("missing-reference", plain_type)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
