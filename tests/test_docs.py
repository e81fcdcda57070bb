# SPDX-License-Identifier: GPL-3.0-or-later
"""Links and anchors of README and docs resolve, commands in them exist, and README stays one page."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from tools import manual_pages
from tools.pages import blocks
from tools.pictures import PICTURES

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "sample_scenes").glob("*.md")])
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def prose(page: Path) -> str:
    """The page without code and comments: what stands there is no link, no heading."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    text = re.sub(r"^ {4}.*$", "", text, flags=re.M)
    return re.sub(r"`[^`\n]*`", lambda code: code.group().replace("[", "(").replace("]", ")"), text)


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub names them; those that come twice are numbered."""
    seen: Counter[str] = Counter()
    found = set()
    for heading in re.findall(r"^#{1,6} +(.+?)\s*$", prose(page), flags=re.M):
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        slug = re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")
        found.add(f"{slug}-{seen[slug]}" if seen[slug] else slug)
        seen[slug] += 1
    return found


def broken(page: Path) -> list[str]:
    """The relative links of a page that lead nowhere."""
    wrong = []
    for link in LINK.findall(prose(page)):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            wrong.append(link)
    return wrong


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_link_and_anchor_resolves(page: Path) -> None:
    assert not broken(page)


def test_every_picture_is_made_by_make_pictures_and_shown() -> None:
    assert {path.name for path in (ROOT / "docs").rglob("*.png")} == set(PICTURES)
    shown = {Path(link).name for page in PAGES for link in LINK.findall(prose(page))}
    assert set(PICTURES) <= shown


def test_a_broken_link_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# Here\n[a](page.md#here) [b](page.md#there) [c](gone.md) `[d](x)`\n", encoding="utf-8")
    assert broken(page) == ["page.md#there", "gone.md"]


def test_readme_is_one_page() -> None:
    assert len((ROOT / "README.md").read_bytes()) <= 12 * 1024


def test_every_page_of_docs_is_in_the_site() -> None:
    listed = set(re.findall(r"[\w./-]+\.md", (ROOT / "mkdocs.yml").read_text(encoding="utf-8")))
    assert listed == {page.relative_to(ROOT / "docs").as_posix() for page in (ROOT / "docs").rglob("*.md")}


def test_every_page_is_two_clicks_from_readme() -> None:
    near = {ROOT / "README.md"}
    for _ in range(2):
        links = [(page, link.partition("#")[0]) for page in near for link in LINK.findall(prose(page))]
        near |= {to for page, link in links if (to := (page.parent / link).resolve()).suffix == ".md" and to.exists()}
    assert set(PAGES) - near <= {ROOT / "docs" / "index.md"}  # the site's own front page


def test_every_make_command_exists() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.M))
    named = {name for page in PAGES for name in re.findall(r"(?:`|^ {4})make ([a-z-]+)", page.read_text(), flags=re.M)}
    workflows = (ROOT / ".github").rglob("*.yml")
    named |= {name for path in workflows for name in re.findall(r"run: make ([a-z-]+)", path.read_text())}
    assert named and named <= targets


def test_every_file_that_is_named_exists() -> None:
    """Paths in code font, from the top of the checkout or from the package."""
    folders = "hybrid_addon|tests|tools|farm|sample_scenes|tracer|blender|procedural"
    for page in PAGES:
        for path in re.findall(rf"`((?:{folders})/[\w/.-]+)`", page.read_text(encoding="utf-8")):
            assert (ROOT / path).exists() or (ROOT / "hybrid_addon" / path).exists(), f"{page.name}: {path}"


def test_blocks_are_filled_where_the_page_has_their_place() -> None:
    page = "a\n<!-- table: x -->\nold\n<!-- end: x -->\nb\n"
    filled = blocks.fill(page, {"x": "new \\1"})
    assert filled == "a\n<!-- table: x -->\n\nnew \\1\n\n<!-- end: x -->\nb\n" == blocks.fill(filled, {"x": "new \\1"})
    with pytest.raises(LookupError, match="no place for 'y'"):
        blocks.fill(page, {"y": ""})


def test_every_part_of_the_benchmarks_has_its_place() -> None:
    parts = re.findall(r'^    "(\w+)": \w+\.\w+,$', (ROOT / "tools/bench/__main__.py").read_text(), flags=re.M)
    assert len(parts) > 10
    blocks.fill((ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8"), dict.fromkeys(parts, ""))


def test_the_manual_in_the_zip_is_whole(tmp_path: Path) -> None:
    """Every page of docs/manual and docs/reference; links lead to a page and to a title of it, pictures are there."""
    manual_pages.write(tmp_path)
    pages = {page: page.read_text(encoding="utf-8") for page in tmp_path.rglob("*.html")}
    assert len(pages) == sum(page.parent.name in manual_pages.FOLDERS for page in PAGES)
    for page, text in pages.items():
        for address in re.findall(r'(?:href|src)="([^"]+)"', text):
            if address.startswith("http"):
                continue
            name, _, place = address.partition("#")
            target = (page.parent / name).resolve() if name else page
            assert target.is_file(), (page.name, address)
            assert not place or f'id="{place}"' in pages[target], (page.name, address)
        words = re.sub(r"<pre>.*?</pre>|<code>.*?</code>|<style>.*?</style>", "", text, flags=re.S)
        assert not re.search(r"\]\(|\*\*|^\||`", words, flags=re.M), page.name


def test_markdown_becomes_html() -> None:
    lines = [
        "# A *b*",
        "",
        "1. one",
        "   more",
        "2. two",
        "",
        "| x | y |",
        "| - | - |",
        "| `ab` | [c](d.md#e) |",
        "",
        "    <code>",
    ]
    assert "".join(manual_pages.blocks(lines)) == (
        '<h1 id="a-b">A <em>b</em></h1><ol><li><p>one more</p></li><li><p>two</p></li></ol>'
        '<table><tr><th>x</th><th>y</th></tr><tr><td><code>ab</code></td><td><a href="d.html#e">c</a></td></tr></table>'
        "<pre>&lt;code&gt;</pre>"
    )
