"""The tree of each task on the report's page, in the colours of its stages at any moment.

The page shows the final statuses of the stages; with scripts a slider goes through the run. The history of
each stage is embedded next to its name, so that nothing is loaded and the tree is readable without scripts.
"""

from __future__ import annotations

import json
from html import escape

from visup.agent import Status
from visup.report.records import RunData, StateSpan
from visup.tasks.tools.outline import Branch

PENDING = Status.PENDING.value


def task_trees(run: RunData) -> str:
    """The trees of all tasks of a run; empty without a task."""
    return "".join(_task_tree(run, tree) for tree in run.task_trees)


def stage_changes(run: RunData, task: str, stage: str) -> list[tuple[float, str]]:
    """(seconds, status) changes of a stage in order; empty for one that is never evaluated."""
    spans = (s for s in run.spans_about("stage") if s.subject == ("stage", task, stage))
    return [(round(s.start, 3), s.value) for s in sorted(spans, key=_start)]


def _start(span: StateSpan) -> float:
    return span.start


def _task_tree(run: RunData, tree: Branch) -> str:
    name = escape(tree.text)
    slider = (
        f'<p class=moment hidden><button type=button class=play aria-label="Play">▶</button>'
        f"<input type=range min=0 max={run.duration:.2f} value={run.duration:.2f} step=any "
        f'aria-label="Moment of the run, seconds"><output>{run.duration:.1f} s</output></p>'
    )
    return (
        f"<div class=course data-duration={run.duration:.2f}><h3>Course of “{name}”</h3>{slider}"
        f"{_inside(run, tree.text, tree)}</div>"
    )


def _inside(run: RunData, task: str, branch: Branch) -> str:
    if not branch.inside:
        return ""
    items = "".join(f"<li>{_branch(run, task, b)}</li>" for b in branch.inside)
    return f"<ul>{items}</ul>"


def _branch(run: RunData, task: str, branch: Branch) -> str:
    status_changes = stage_changes(run, task, branch.stage) if branch.kind == "stage" else []
    again = " <span class=quiet>(see above)</span>" if branch.again else ""
    text = escape(branch.text)
    if status_changes:
        status = escape(status_changes[-1][1])
        data = escape(json.dumps(status_changes, separators=(",", ":")), quote=True)
        head = (
            f'<span class="step {status}" data-changes="{data}"><b>{text}</b> '
            f"<i>{status}</i></span>"
        )
    else:
        head = f'<span class="step plain {branch.kind}">{text}</span>'
    return f"{head}{again}{_inside(run, task, branch)}"
