"""Take out of the finished pages' scripts and styles what no page uses.

Icons: the theme ships 2 045 of them, 1.4 MB. Those stay whose name a page or a script names.
Styles: a rule goes if each of its selectors asks for a class that occurs in no page and in no
script; what a script puts together from parts would be missed, and `KEPT` names it. The live
pages' scripts are shipped without comments, and with no space that says nothing.
"""

import re
from itertools import pairwise
from pathlib import Path

import tinycss2

ICON = re.compile(
    r'"?([a-z0-9-]+)"?:\[\d+,\d+,\[[^\]]*\],"[0-9a-f]+",(?:"[^"]*"|\[[^\]]*\])\](,?)'
)
ICON_NAME = re.compile(r"\bfa-([a-z0-9-]+)")
WORD = re.compile(r"[\w-]+")
COMMENT = re.compile(r"(?m)^[ ]*(?:/\*(?:.|\n)*?\*/|//.*)\n")
# In a script, what stays as it is: texts, regular expressions, and where a template begins.
LITERAL = re.compile(
    r"""(?x) "(?:[^"\\\n]|\\.)*" | '(?:[^'\\\n]|\\.)*' | `
    | (?<=[(,=:!&|?{};\n])\s* /(?![*/]) (?:[^/\\\n[] | \\. | \[(?:[^]\\\n]|\\.)*\])+ /[a-z]*"""
)
# At-rules that hold other rules.
GROUPS = {"media", "supports", "layer", "container"}
# Bootstrap joins these from parts.
KEPT = (
    "bs-",
    "collapsing",
    "show",
    "fade",
    "tooltip",
    "popover",
    "modal",
    "dropdown",
    "dropup",
)


def thin(rules, words):
    """Return the text of a style sheet's rules without those that no page can match."""
    kept = []
    for rule in rules:
        if rule.type == "qualified-rule":
            used = [one for one in selectors(rule.prelude) if matches(one, words)]
            if used:
                text = ",".join(map(tinycss2.serialize, used)).strip()
                kept.append(f"{text}{{{tinycss2.serialize(rule.content)}}}")
        elif rule.type == "at-rule" and rule.content and rule.lower_at_keyword in GROUPS:
            inner = thin(tinycss2.parse_rule_list(rule.content, skip_whitespace=True), words)
            if inner:
                head = tinycss2.serialize(rule.prelude)
                kept.append(f"@{rule.at_keyword}{head}{{{inner}}}")
        else:
            kept.append(rule.serialize())
    return "".join(kept)


def selectors(prelude):
    """Split the tokens before a rule's block at their commas."""
    commas = [at for at, token in enumerate(prelude) if token == ","]
    return [prelude[i + 1 : j] for i, j in pairwise([-1, *commas, len(prelude)])]


def matches(selector, words):
    """Whether all classes that a selector asks for, outside of brackets, occur somewhere."""
    names = [token.value for dot, token in pairwise(selector) if dot == "."]
    return all(name in words or name.startswith(KEPT) for name in names)


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
    """Thin out the scripts and styles of the built pages."""
    if exception is not None or app.builder.format != "html":
        return
    out = Path(app.outdir)
    static = out / "_static"
    icons = static / "scripts" / "fontawesome.js"
    pages = [file.read_text(encoding="utf-8") for file in out.rglob("*.html")]
    scripts = [
        file.read_text(encoding="utf-8")
        for file in static.rglob("*.js")
        if file != icons and "mathjax" not in file.parts
    ]
    styles = {file: file.read_text(encoding="utf-8") for file in static.rglob("*.css")}
    if icons.is_file():
        used = {name for text in [*pages, *scripts] for name in ICON_NAME.findall(text)}
        text = icons.read_text(encoding="utf-8")
        icons.write_text(
            ICON.sub(lambda icon: icon[0] if icon[1] in used else "", text).replace(",}", "}"),
            encoding="utf-8",
        )
    words = {word for text in [*pages, *scripts] for word in WORD.findall(text)}
    for file, text in styles.items():
        bare = re.sub(r"/\*(?!!)(?:.|\n)*?\*/", "", text)
        rules = tinycss2.parse_stylesheet(bare, skip_whitespace=True)
        file.write_text(thin(rules, words), encoding="utf-8")
    for file in (static / "live").glob("*.js"):
        file.write_text(shortened(file.read_text(encoding="utf-8")), encoding="utf-8")


def setup(app):
    """Register with Sphinx."""
    # After what else mends the pages.
    app.connect("build-finished", lean, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
