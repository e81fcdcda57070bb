# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual as pages that a browser shows without a network: they lie in the extension's zip.

Of Markdown it knows what docs/manual and docs/reference use, and no more: titles, paragraphs, lists, tables, code,
pictures, links. Links out of these two folders become plain text.
"""

from __future__ import annotations

import html
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("manual", "reference")

STYLE = """body { max-width: 46em; margin: 2em auto; padding: 0 1em; font: 16px/1.5 sans-serif;
color: #222; background: #fff }
table { border-collapse: collapse } td, th { border: 1px solid #ccc; padding: .25em .5em; text-align: left }
code, pre { background: #f2f2f2 } pre { padding: .6em; overflow-x: auto } img { max-width: 100% } nav { color: #777 }
@media (prefers-color-scheme: dark) { body { color: #ddd; background: #222 } a { color: #8bf }
code, pre { background: #333 } td, th { border-color: #555 } }"""

ITEM = re.compile(r"( *)(?:[-*]|(\d+)\.) (.*)")


def write(target: Path) -> None:
    """All pages and their pictures, in folders as in docs/."""
    docs = ROOT / "docs"
    pages = {name: sorted((docs / name).glob("*.md")) for name in FOLDERS}
    for name, paths in pages.items():
        (target / name).mkdir(parents=True, exist_ok=True)
        links = " · ".join(f'<a href="{path.stem}.html">{title(path)}</a>' for path in paths)
        for path in paths:
            body = f"<nav>{links}</nav>\n" + "\n".join(blocks(path.read_text(encoding="utf-8").splitlines()))
            head = f'<meta charset="utf-8">\n<title>{title(path)}</title>\n<style>{STYLE}</style>'
            page = f"<!doctype html>\n{head}\n{body}\n"
            (target / name / f"{path.stem}.html").write_text(page, encoding="utf-8")
            for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", path.read_text(encoding="utf-8")):
                shutil.copy(path.parent / picture, target / name / picture)


def title(path: Path) -> str:
    """Of a page."""
    return html.escape(path.read_text(encoding="utf-8").split("\n", 1)[0].lstrip("# "))


def blocks(lines: list[str]) -> Iterator[str]:
    """HTML of some lines of Markdown."""
    while lines:
        line = lines[0]
        if not line.strip() or line.startswith("<!--"):
            lines = lines[1:]
            continue
        heading = re.match(r"(#+) (.*)", line)
        if heading:
            level, text = len(heading[1]), heading[2]
            yield f'<h{level} id="{anchor(text)}">{inline(text)}</h{level}>'
            lines = lines[1:]
            continue
        if line.startswith("```"):
            size = next(n for n, other in enumerate(lines) if n and other.startswith("```")) + 1
            yield f"<pre>{html.escape(chr(10).join(lines[1 : size - 1]))}</pre>"
        elif line.startswith("    "):
            size = _run(lines, lambda other: other.startswith("    ") or not other.strip())
            yield f"<pre>{html.escape(chr(10).join(other[4:] for other in lines[:size]).rstrip())}</pre>"
        elif line.startswith("|"):
            size = _run(lines, lambda other: other.startswith("|"))
            yield table(lines[:size])
        elif ITEM.match(line):
            size = _run(lines, lambda other: bool(ITEM.match(other)) or other.startswith("  ") or not other.strip())
            yield listed(lines[:size])
        else:
            size = _run(lines, lambda other: bool(other.strip()) and not re.match(r"#+ |\||```", other))
            yield f"<p>{inline(' '.join(lines[:size]))}</p>"
        lines = lines[size:]


def _run(lines: list[str], belongs: object) -> int:
    """How many lines from the first one on belong together."""
    assert callable(belongs)
    return next((n for n, line in enumerate(lines) if n and not belongs(line)), len(lines))


def listed(lines: list[str]) -> str:
    """A list: each item with what is set in below it."""
    items: list[list[str]] = []
    numbered = bool(ITEM.match(lines[0]) and ITEM.match(lines[0])[2])  # type: ignore[index]
    for line in lines:
        found = ITEM.match(line)
        if found and not found[1]:
            items.append([found[3]])
        else:
            items[-1].append(line.strip() if not line.startswith("        ") else line[4:])
    tag = "ol" if numbered else "ul"
    inner = "".join(f"<li>{''.join(blocks(item))}</li>" for item in items)
    return f"<{tag}>{inner}</{tag}>"


def table(lines: list[str]) -> str:
    """A table whose second line is a rule."""
    rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))] for line in lines]
    made = []
    for number, row in enumerate(rows):
        if number != 1:
            tag = "th" if number == 0 else "td"
            made.append("<tr>" + "".join(f"<{tag}>{inline(cell)}</{tag}>" for cell in row) + "</tr>")
    return f"<table>{''.join(made)}</table>"


def inline(text: str) -> str:
    """Code, pictures, links, emphasis."""
    parts = re.split(r"(`[^`]+`)", text)
    made = []
    for part in parts:
        if part.startswith("`") and len(part) > 1:
            made.append(f"<code>{html.escape(part[1:-1])}</code>")
            continue
        part = html.escape(part, quote=False).replace("\\|", "|")
        part = re.sub(r"!\[([^]]*)\]\(([^)]+)\)", _picture, part)
        made.append(part)
    whole = "".join(made)
    whole = re.sub(r"\[([^]]+)\]\(([^)]+)\)", _link, whole)
    whole = re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", whole)
    return re.sub(r"(?<![\w*])\*([^*\s][^*]*)\*(?!\w)", r"<em>\1</em>", whole)


def _picture(found: re.Match[str]) -> str:
    return f'<img src="{found[2]}" alt="{found[1]}">'


def _link(found: re.Match[str]) -> str:
    text, address = found[1], found[2]
    if address.startswith("http"):
        return f'<a href="{address}">{text}</a>'
    page, _, place = address.partition("#")
    inside = not page or "/" not in page or page.split("/")[-2] in FOLDERS
    if not inside or (page and not page.endswith(".md")):
        return text
    return f'<a href="{page.removesuffix(".md") + (".html" if page else "")}{"#" + place if place else ""}">{text}</a>'


def anchor(text: str) -> str:
    """Of a title, as in the docs' links."""
    return re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", text.lower())).strip("-")
