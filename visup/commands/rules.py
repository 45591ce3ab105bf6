"""`visup rules`: check rule files, list rules and their cost, explain a verdict."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from visup.commands.options import REPLAY_SETTINGS, OptionValues, takes
from visup.runs.settings import WatchSettings
from visup.terminal.console import echo, echo_json

if TYPE_CHECKING:
    from collections.abc import Iterator

    from visup.agent import Mind
    from visup.rules.formula.nodes import Rule

app = typer.Typer(no_args_is_help=True, help="Check, list and explain safety rules.")

Files = Annotated[
    list[Path] | None, typer.Argument(help="Rule files; by default the shipped rules.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON instead of text.")]
EXPLAIN_SETTINGS = (
    "tasks",
    "models",
    "rules",
    "early",
    "actors",
    "every",
    "fps",
    "fov_vertical_deg",
)
"""Settings of a run that affect rules."""


@app.command()
def check(files: Annotated[list[Path], typer.Argument(help="Rule files.")]) -> None:
    """Report every mistake in rule files, and the cost of each rule; exit code 2 if there is a mistake."""
    from visup.agent.model.errors import ErrorGroup, VisupError
    from visup.rules.language.diagnostics import raise_errors
    from visup.rules.language.parser import load_rules

    errors: list[VisupError] = []
    for file in files:
        try:
            rules = load_rules(file)
        except ErrorGroup as group:
            errors += group.errors
        except VisupError as error:
            errors.append(error)
        else:
            echo(f"{file}: ok")
            for rule in rules:
                echo(f"  {rule.name}: {_cost(rule)}")
    raise_errors(errors)


@app.command("list")
def list_rules(files: Files = None, as_json: AsJson = False) -> None:
    """List rules: severity, memory bound and delay of each."""
    from visup.rules.language.parser import load_rules, shipped_rules
    from visup.rules.monitoring.cost import cost_of

    rules = [r for file in files for r in load_rules(file)] if files else list(shipped_rules())
    if as_json:
        rows: list[dict[str, Any]] = []
        for rule in rules:
            cost = cost_of(rule)
            rows.append(
                {
                    "name": rule.name,
                    "objects": len(rule.variables),
                    "severity": rule.severity.name.lower(),
                    "delay_s": cost.delay_s,
                    "early_delay_s": cost.early_delay_s,
                    "most_bytes_per_choice": cost.bytes,
                    "text": str(rule),
                }
            )
        echo_json(rows, indent=2)
        return
    width = max((len(r.name) for r in rules), default=0)
    for rule in rules:
        echo(f"{rule.name:{width}}  {rule.severity.name.lower():8}  {_cost(rule)}")


@app.command()
@takes(WatchSettings, only=EXPLAIN_SETTINGS)
def explain(
    options: OptionValues,
    source: Annotated[
        str, typer.Argument(help="Video file, folder of images, camera, URL, or a run folder.")
    ],
    time_s: Annotated[float, typer.Option("--at", min=0.0, help="Time in the video, seconds.")],
    rule: Annotated[str | None, typer.Option("--rule", help="Only this rule.")] = None,
) -> None:
    """Explain why rules were true, false or unknown for each choice of objects at a given time."""
    from visup.agent.model.errors import SettingsError

    mind = None
    for mind in _minds(source, options):
        if mind.time >= time_s:
            break
    if mind is None or mind.time < time_s:
        raise SettingsError(f"--at is {time_s:g} s, after the end of the video", where=source)
    texts = explanations(mind, rule)
    for text in texts or [f"at {mind.time:g} s too few objects are in view to evaluate any rule"]:
        echo(text)


@app.command()
def judge(
    file: Annotated[Path, typer.Argument(help="A rule file; its rules are about signals alone.")],
    signals: Annotated[
        Path,
        typer.Option("--signal", help="Table of signals (CSV) whose first column is the time."),
    ],
    interpolation: Annotated[
        Literal["held", "linear", "samples"],
        typer.Option("--between", help="Values between samples: held, linear, or samples alone."),
    ] = "held",
    ends: Annotated[
        Literal["unknown", "cut", "lasting", "weak", "strong"],
        typer.Option(
            help="Outside the recording: unknown; no part of any window; the last value; or, of what "
            "is undecided, the best or the worst. All but the first cut windows at the first sample."
        ),
    ] = "unknown",
    end: Annotated[float | None, typer.Option(help="End of the recording, seconds.")] = None,
    as_json: AsJson = False,
) -> None:
    """Report exactly when rules about signals were true, also between samples."""
    from visup.percepts.signals.files import read_signals
    from visup.rules.dense_time import Ends
    from visup.rules.language.parser import load_rules
    from visup.rules.safety.signal_rules import judge_rule

    table, outside = read_signals(signals), Ends("unknown" if ends == "unknown" else "cut", ends)
    samples = list(zip(table.times, table.rows, strict=True))
    spans = [
        s for r in load_rules(file) for s in judge_rule(r, samples, interpolation, outside, end)
    ]
    if as_json:
        rows = [
            {"rule": s.rule, "begin_s": s.begin_s, "end_s": s.end_s, "truth": s.truth.value}
            for s in spans
        ]
        echo_json(rows, indent=2)
        return
    for line in map(str, spans) if spans else ("no rule was true",):
        echo(line)


def _minds(source: str, options: OptionValues) -> Iterator[Mind]:
    """The mind after each step of a video or of a recorded run."""
    from visup.agent.storage.journal_reader import Recording, is_run
    from visup.runs.replay import settings_for
    from visup.runs.wiring import build_agent, open_video, reasoning_agent

    if is_run(source):
        recording = Recording.open(Path(source))
        replay_options = {k: v for k, v in options.items() if k in REPLAY_SETTINGS}
        agent, answers = (
            reasoning_agent(settings_for(recording, **replay_options)),
            recording.answers(),
        )
        for observation in recording.observations():
            yield agent.reason(observation, answers.get(observation.frame_index, {})).mind
        return
    settings = WatchSettings(source, **options)
    agent = build_agent(settings)
    with open_video(settings) as video:
        for frame in video:
            yield agent.step(frame).mind


def explanations(mind: Mind, name: str | None) -> list[str]:
    """Why each rule is true, false or unknown for each choice of objects in a mind.

    Args:
        mind: A mind in which rules have been evaluated.
        name: Name of a single rule, or None for all.

    Raises:
        RuleError: There is no rule of that name.
    """
    from visup.rules.safety.queries import evaluation_of, explain, object_choices, rule_named

    values = evaluation_of(mind)
    rules = [rule_named(values, name)] if name else list(values.compiled.rules)
    return [
        str(explain(mind, rule.name, *ids))
        for rule in rules
        for ids in object_choices(values, rule)
    ]


def _cost(rule: Rule) -> str:
    from visup.rules.monitoring.cost import cost_of

    cost = cost_of(rule)
    delay = f"reported {cost.delay_s:g} s late" if cost.delay_s else "reported immediately"
    text = f"{delay}, at most {cost.bytes / 1024:,.1f} kB per choice of objects"
    if cost.early_delay_s == cost.delay_s:
        return text
    earliest = (
        f"at least {cost.early_delay_s:g} s late" if cost.early_delay_s else "possibly immediately"
    )
    return f"{text}; with --early, {earliest}"
