"""The pictures of docs/architecture.md agree with the code."""

from __future__ import annotations

from tests.docs.architecture import layers, pictures, uses
from tests.paths import ROOT


def test_the_pictures_are_those_of_the_code() -> None:
    stale = [p.name for p, text in pictures().items() if p.read_text() != text]
    assert stale == [], "draw them anew: python -m tests.docs.architecture"


def test_every_arrow_leads_down() -> None:
    floor = {room: i for i, layer in enumerate(layers()) for room in layer}
    assert all(floor[a] < floor[b] for a, b in uses())


def test_the_page_shows_both_pictures_and_twelve_usual_changes() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text()
    assert all(f"images/{path.name})" in page for path in pictures())
    rows = page.partition("## Where to change what")[2].splitlines()
    assert len([row for row in rows if row.startswith("| ")]) - 1 >= 12
