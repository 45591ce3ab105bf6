"""A text editor for tasks, rules and zones with marked mistakes and completion at the caret."""

from __future__ import annotations

import json
from collections.abc import Sequence

from nicegui import ui

from visup.console.pages.page_elements import safe_text
from visup.console.workbench.drafts import DraftFault, completion_prefix
from visup.tasks.tools.editing import Completion

CARET_TIMEOUT_S = 2.0
"""Timeout for the browser to report the caret, seconds."""

_SET_ACCESSIBLE_NAME = (
    "(async () => {{ for (let k = 0; k < 50; k++) {{ const c = getElement({id});"
    " if (c?.editor) {{ c.editor.contentDOM.setAttribute('aria-label', 'Text'); return; }}"
    " await new Promise(r => setTimeout(r, 100)); }} }})()"
)
_INSERT = (
    "const e = getElement({id}).editor, h = e.state.selection.main.head, w = {word};"
    " e.dispatch({{changes: {{from: h - {prefix}, to: h, insert: w}},"
    " selection: {{anchor: h - {prefix} + w.length}}}}); e.focus();"
)


class DraftEditor:
    """The text field."""

    def __init__(self, text: str = "") -> None:
        self.changed = True
        self._field = ui.codemirror(text, language=None, line_wrapping=True)
        self._field.classes("w-full editor").on_value_change(self._mark_changed)

    @property
    def text(self) -> str:
        """The content."""
        return str(self._field.value or "")

    @text.setter
    def text(self, text: str) -> None:
        self._field.set_value(text)

    def _mark_changed(self) -> None:
        self.changed = True

    def set_accessible_name(self) -> None:
        """Set its accessible name each time it is shown."""
        ui.run_javascript(_SET_ACCESSIBLE_NAME.format(id=self._field.id))

    def mark_mistakes(self, faults: Sequence[DraftFault]) -> None:
        """Mark the lines of mistakes, with tooltips."""
        last = self.text.count("\n") + 1
        lines: dict[int, str] = {}
        for fault in faults:
            if 0 < fault.line <= last:
                earlier = lines.get(fault.line)
                lines[fault.line] = f"{earlier}\n{fault.text}" if earlier else fault.text
        self._field.decorations = [
            {"kind": "line", "line": n, "class": "fault-line"} for n in sorted(lines)
        ]
        self._field.line_tooltips = {n: safe_text(text) for n, text in lines.items()}

    def show_line(self, line: int) -> None:
        """Bring a line into view."""
        if line:
            self._field.reveal_line(line)

    async def caret_offset(self) -> int:
        """Offset of the caret in characters; the end if the browser does not report it."""
        code = f"getElement({self._field.id})?.editor?.state.selection.main.head"
        try:
            caret = await ui.run_javascript(code, timeout=CARET_TIMEOUT_S)
        except TimeoutError:
            caret = None
        units = self.text.encode("utf-16-le")  # browsers count UTF-16 units
        return len(
            units[: 2 * caret].decode("utf-16-le", "ignore")
            if isinstance(caret, int)
            else self.text
        )

    async def insert(self, word: Completion) -> None:
        """Insert a word at the caret in place of its typed beginning."""
        before = self.text[: await self.caret_offset()]
        prefix = completion_prefix(before)
        text = word.text
        if text.startswith("<") and before[: len(before) - len(prefix)].endswith("<"):
            text = text[1:]
        code = _INSERT.format(id=self._field.id, word=json.dumps(text), prefix=len(prefix))
        ui.run_javascript(code)
