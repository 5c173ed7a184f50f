"""Take out of the finished pages' scripts what no page uses.

The theme ships 2 045 icons, 1.4 MB. Those stay whose name a page or a script names. The live
pages' scripts are shipped without comments, and with no space that says nothing.
"""

import re
from pathlib import Path

ICON = re.compile(
    r'"?([a-z0-9-]+)"?:\[\d+,\d+,\[[^\]]*\],"[0-9a-f]+",(?:"[^"]*"|\[[^\]]*\])\](,?)'
)
ICON_NAME = re.compile(r"\bfa-([a-z0-9-]+)")
COMMENT = re.compile(r"(?m)^[ ]*(?:/\*(?:.|\n)*?\*/|//.*)\n")
# In a script, what stays as it is: texts, regular expressions, and where a template begins.
LITERAL = re.compile(
    r"""(?x) "(?:[^"\\\n]|\\.)*" | '(?:[^'\\\n]|\\.)*' | `
    | (?<=[(,=:!&|?{};\n])\s* /(?![*/]) (?:[^/\\\n[] | \\. | \[(?:[^]\\\n]|\\.)*\])+ /[a-z]*"""
)


def template_end(text, start):
    """Return where a template ends that begins at a backquote."""
    at, depth = start + 1, 0
    while text[at] != "`" or depth:
        if text[at] == "`":
            at = template_end(text, at) - 1
        elif text[at] == "\\":
            at += 1
        elif text.startswith("${", at) or (depth and text[at] == "{"):
            depth += 1
            at += text[at] == "$"
        elif depth and text[at] == "}":
            depth -= 1
        at += 1
    return at + 1


def without_space(text):
    """Return code that quotes nothing without the spaces and lines that say nothing."""
    text = re.sub(r"\s*\n\s*", "\n", text)
    text = re.sub(r" *([][{}(),;:?=<>&|*/!%^]) *", r"\1", text)
    text = re.sub(r"(?<![+-]) ([+-]) (?![+-])", r"\1", text)
    # A line may end a statement, but not here.
    return re.sub(r"\n?([,;:?=<>&|*([{])\n?", r"\1", text)


def shortened(text):
    """Return a script without comments and needless space. Statements end in a semicolon."""
    text, parts, at = COMMENT.sub("", text), [], 0
    while literal := LITERAL.search(text, at):
        parts.append(without_space(text[at : literal.start()]))
        end = literal.end() if literal[0] != "`" else template_end(text, literal.start())
        parts.append(text[literal.start() : end].strip())
        at = end
    return "".join([*parts, without_space(text[at:])])


def lean(app, exception):
    """Thin out the scripts of the built pages."""
    if exception is not None or app.builder.format != "html":
        return
    static = Path(app.outdir) / "_static"
    icons = static / "scripts" / "fontawesome.js"
    named = [
        *Path(app.outdir).rglob("*.html"),
        *static.glob("*.js"),
        *static.glob("scripts/*.js"),
    ]
    used = {
        name
        for file in named
        if file != icons
        for name in ICON_NAME.findall(file.read_text(encoding="utf-8"))
    }
    if icons.is_file():
        text = icons.read_text(encoding="utf-8")
        text = ICON.sub(lambda icon: icon[0] if icon[1] in used else "", text)
        icons.write_text(text.replace(",}", "}"), encoding="utf-8")
    for file in (static / "live").glob("*.js"):
        file.write_text(shortened(file.read_text(encoding="utf-8")), encoding="utf-8")


def setup(app):
    """Register with Sphinx."""
    # After what else mends the pages.
    app.connect("build-finished", lean, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
