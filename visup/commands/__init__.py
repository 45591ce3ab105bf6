"""The commands: one module per command of `visup`, or a folder if it has sub-commands.

A command is imported when it is called. It reads its options, calls the code that does the work, and prints
the result; heavy imports stay inside its functions, so that its `--help` is fast.
"""

from __future__ import annotations

from types import MappingProxyType

from visup.terminal.overview import CommandEntry, Purposes

PURPOSES: Purposes = MappingProxyType(
    {
        "Watch": {
            "watch": CommandEntry(
                "watch a video and report whether the work goes well",
                "visup.commands.watch:watch",
            ),
            "demo": CommandEntry(
                "watch the shipped clip, a failed capture",
                "visup.commands.watch:demo",
            ),
            "check": CommandEntry(
                "check that a run could start and reach a verdict",
                "visup.commands.check:check",
            ),
            "serve": CommandEntry(
                "watch many cameras as a service, from a site file",
                "visup.commands.serve.site_commands:app",
            ),
            "presets": CommandEntry(
                "what --preset traffic, cell, orbit and bench set",
                "visup.commands.presets:presets",
            ),
        },
        "Prepare": {
            "teach": CommandEntry(
                "outline objects once, so that they are recognised",
                "visup.commands.teach:teach",
                "visup.commands.teach:OutlineCommand",
            ),
            "models": CommandEntry(
                "build, extend, list and query model databases",
                "visup.commands.models:app",
            ),
            "task": CommandEntry(
                "check, show, simulate and learn task files",
                "visup.commands.task.task:app",
            ),
            "rules": CommandEntry(
                "check, list and explain safety rules",
                "visup.commands.rules:app",
            ),
        },
        "Inspect a run": {
            "console": CommandEntry(
                "browse runs: video, timeline, beliefs, reasons",
                "visup.commands.serve.console_command:console",
            ),
            "step": CommandEntry(
                "step back and forth through a run, and ask why",
                "visup.commands.step:step",
            ),
            "replay": CommandEntry(
                "reason again about a run, with other tasks or rules",
                "visup.commands.replay:replay",
            ),
            "export": CommandEntry(
                "export objects as MOT, COCO, FiftyOne or CSV",
                "visup.commands.export:export",
            ),
        },
        "Query many runs": {
            "archive": CommandEntry(
                "watch many clips and store their runs in a lake",
                "visup.commands.archives.archive:app",
            ),
            "query": CommandEntry(
                "query a lake in SQL",
                "visup.commands.archives.query:query",
            ),
            "find": CommandEntry(
                "find where a condition held, in all runs of a lake",
                "visup.commands.archives.find:find",
            ),
        },
        "Extend and measure": {
            "behaviours": CommandEntry(
                "list, check and create plug-ins",
                "visup.commands.behaviours:app",
            ),
            "render": CommandEntry(
                "render a scene with masks and ground truth",
                "visup.commands.render:render",
            ),
            "eval": CommandEntry(
                "measure accuracy and speed against ground truth",
                "visup.commands.eval.catalogue:app",
            ),
            "train": CommandEntry(
                "learn from labelled sequences what moves independently",
                "visup.commands.eval.train:app",
            ),
            "debug": CommandEntry(
                "visualise intermediate results, for developers",
                "visup.commands.debug:app",
            ),
            "doctor": CommandEntry(
                "show what is installed, what is missing, how fast it runs",
                "visup.commands.doctor:doctor",
            ),
        },
    }
)
