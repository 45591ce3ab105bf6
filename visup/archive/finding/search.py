"""Searches all runs of a lake for a condition, evaluated as an agent would have."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Protocol

from visup.agent import Alert, Truth
from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.archive.finding.beliefs import depends_only_on_relations, read_minds
from visup.archive.finding.pattern import read_pattern
from visup.archive.finding.pattern_evaluator import Hit, PatternEvaluator
from visup.archive.finding.possible import _HOLDING_SQL, PossibleTimes, possible_times
from visup.archive.finding.task_search import TaskSearch
from visup.archive.lake import Lake
from visup.archive.parallel import each_run
from visup.archive.querying.database import LakeDatabase, QueryError
from visup.archive.querying.views import quoted
from visup.rules.formula.nodes import Rule
from visup.rules.language.parser import load_rules
from visup.rules.safety.expression import Expression
from visup.runs.replay import replay
from visup.runs.settings import WatchSettings
from visup.tasks import load_tasks

MIN_PARALLEL = 200
"""Fewer quick runs than this are done before worker processes would have started."""
_BY_ID = re.compile(r"object_(\d+)")


@dataclass(frozen=True, slots=True)
class FoundRun:
    """A run that was searched.

    Attributes:
        run: Its key.
        clip: Its source.
        folder: Its folder.
        hits: Hits by time.
    """

    run: str
    clip: str
    folder: Path
    hits: tuple[Hit, ...]


class Search(Protocol):
    """What to search for."""

    @property
    def quick(self) -> bool:
        """Whether a run can be searched without replaying its reasoning."""

    def possible_runs(self, database: LakeDatabase) -> list[str]:
        """The runs that may have hits; all others have none.

        Raises:
            QueryError: It names an object that no run of the lake has.
        """

    def hits(self, recording: Recording, settings: WatchSettings) -> tuple[Hit, ...]:
        """The hits in a run, by time."""


@dataclass(frozen=True, slots=True)
class ConditionSearch:
    """Searches for the intervals in which a condition was true or unknown.

    Attributes:
        pattern: The condition.
        unknown: Whether to include intervals in which it was unknown; any run may have some.
    """

    pattern: Expression
    unknown: bool = False

    @property
    def quick(self) -> bool:
        """See `Search`."""
        return depends_only_on_relations(self.pattern)

    def possible_runs(self, database: LakeDatabase) -> list[str]:
        """See `Search`."""
        variables = self.pattern.rule.variables
        who = {v: select for v in variables if (select := objects_named(v)) is not None}
        for variable, select in who.items():
            if not database.ask(f"SELECT 1 FROM ({select}) LIMIT 1").num_rows:
                raise _unknown_name(database, variable)
        if self.unknown:
            return runs_of(database, None, who)
        return runs_of(database, possible_times(self.pattern.rule.when), who)

    def hits(self, recording: Recording, settings: WatchSettings) -> tuple[Hit, ...]:
        """See `Search`."""
        evaluator = PatternEvaluator(self.pattern)
        minds = read_minds(recording.path.parent) if self.quick else None
        if minds is None:
            replay(recording, settings, on_step=evaluator)
        for mind in minds or ():
            evaluator.evaluate(mind)
        return tuple(h for h in evaluator.hits() if self.unknown or h.truth == Truth.TRUE)


@dataclass(frozen=True, slots=True)
class RulesSearch:
    """Searches for the alerts that other rules would have raised.

    Attributes:
        file: A rules file.
        rules: Its rules.
    """

    file: Path
    rules: tuple[Rule, ...]
    quick: bool = False

    def possible_runs(self, database: LakeDatabase) -> list[str]:
        """See `Search`."""
        found = (runs_of(database, possible_times(rule.when), {}) for rule in self.rules)
        return sorted({run for runs in found for run in runs})

    def hits(self, recording: Recording, settings: WatchSettings) -> tuple[Hit, ...]:
        """See `Search`."""
        alerts: dict[int, tuple[Alert, tuple[str, ...]]] = {}
        last = 0.0

        def collect(step: Step) -> None:
            nonlocal last
            last = step.time
            for alert in step.alerts:
                named = tuple(step.mind.objects[i].name for i in alert.objects)
                alerts[alert.id] = alert, alerts.get(alert.id, (alert, named))[1]

        replay(recording, replace(settings, rules=(self.file,)), on_step=collect)
        kinds = {rule.name for rule in self.rules}
        return tuple(
            Hit(
                alert.objects,
                names,
                Truth.TRUE.value,
                alert.opened,
                last if alert.closed is None else alert.closed,
                alert.closed is None,
                rule=alert.kind,
            )
            for alert, names in alerts.values()
            if alert.kind in kinds
        )


def read_search(text: str, *, unknown: bool = False) -> Search:
    """Parse a search: a condition, or the name of a rules file or a task file.

    Raises:
        RuleError: It is none of them.
        ErrorGroup: It has several mistakes.
    """
    if text.endswith((".rules", ".task")):
        if unknown:
            raise SettingsError(
                "alerts are raised or not, and tasks carried out or not",
                hint="leave out --unknown, or look for a condition",
            )
        if text.endswith(".rules"):
            return RulesSearch(Path(text), load_rules(text))
        load_tasks(text)  # reports mistakes before the first run
        return TaskSearch(Path(text))
    return ConditionSearch(read_pattern(text), unknown)


def find(
    lake: Lake, search: Search, runs: Iterable[str], workers: int | None = 0
) -> Iterator[FoundRun]:
    """Search runs.

    Args:
        lake: The lake.
        search: What to search for.
        runs: The runs; those that are possible suffice.
        workers: Worker processes; None for one per core.

    Yields:
        Each run, including those without hits.

    Raises:
        OutputError: A run is damaged.
    """
    keys = list(runs)
    if workers is None and search.quick and len(keys) < MIN_PARALLEL:
        workers = 0
    yield from each_run(partial(_search_run, lake, search), keys, workers)


def _search_run(lake: Lake, search: Search, run: str) -> FoundRun:
    recording, settings = lake.recorded(run)
    hits = search.hits(recording, settings)
    return FoundRun(run, settings.source, lake.folder_of(run), hits)


def runs_of(
    database: LakeDatabase, times: PossibleTimes | None, who: Mapping[str, str]
) -> list[str]:
    """The runs with possible times and an object for every name.

    Args:
        database: The lake.
        times: Possible times; None for always.
        who: Variable -> SELECT of `run`, as a number, and `object`.
    """
    named = {v: f'"who_{v}"' for v in who}
    parts = [f"{named[v]} AS MATERIALIZED ({select})" for v, select in who.items()]
    if times:
        known = "".join(f" AND number IN (SELECT run FROM {table})" for table in named.values())
        parts.append(
            _HOLDING_SQL.format(names=", ".join(map(quoted, times.relations)), known=known)
        )
    for variable, table in named.items():
        times = times and times.for_name(variable, f"FROM {table}")
    sql = f"SELECT run FROM ({times.sql if times else 'SELECT number AS run FROM lake_index.runs'})"
    for table in named.values():
        sql = f"SELECT run FROM ({sql}) SEMI JOIN {table} USING (run)"
    first = f"WITH {', '.join(parts)} " if parts else ""
    answer = database.ask(
        f"{first}SELECT k.run FROM lake_index.runs k SEMI JOIN ({sql}) f ON f.run = k.number ORDER BY run"
    )
    found: list[str] = answer["run"].to_pylist()
    return found


def objects_named(variable: str) -> str | None:
    """The objects that a name may have meant, as a SELECT; None for a variable."""
    if by_id := _BY_ID.fullmatch(variable):
        return (
            "SELECT n.number AS run, o.object FROM lake.objects o JOIN lake_index.runs n USING (run)"
            f" WHERE o.object = {by_id[1]}"
        )
    if len(variable) == 1:
        return None
    return f"SELECT number AS run, object FROM lake_index.meant WHERE name = {quoted(variable)}"


def _unknown_name(database: LakeDatabase, name: str) -> QueryError:
    known = database.ask("SELECT DISTINCT name FROM lake_index.meant ORDER BY name")
    names = [n for n in known.column("name").to_pylist() if " " not in n]
    return QueryError(
        f"nobody in this lake was ever taken for '{name}'",
        expected=f"one of: {', '.join(names[:20])}; or one letter for anybody" if names else None,
        hint=did_you_mean(name, names),
    )
