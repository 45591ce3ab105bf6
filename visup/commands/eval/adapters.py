"""Evaluations that need more than a call with their options, and the lines printed below their tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import RenderableType

Figures = Mapping[str, Any]
Progress = Callable[[str], None]


def shapes_closing(figures: Figures) -> Iterator[str]:
    """How many of the first ten neighbours are right, if that was counted."""
    if ranks := figures["total"].get("ranks"):
        yield "ranks 1 to 10: " + " ".join(str(r) for r in ranks)


def clips(names: list[str] | None, cache: Path, progress: Progress) -> Figures:
    """Evaluate rendered clips against their thresholds."""
    from visup.commands.render import require_renderer
    from visup.evaluation.motion.rendered_clips import evaluate_clips

    require_renderer()
    return evaluate_clips(cache, names or (), progress=progress)


def clips_closing(figures: Figures) -> Iterator[RenderableType]:
    """The thresholds that each clip misses, and how many clips pass."""
    from visup.commands.eval.tables import clips_table

    total = figures["total"]
    yield clips_table(figures["items"])
    yield f"{total['passed']} of {total['clips']} clips pass"


def scale(folder: Path, views: int, seed: int, progress: Progress) -> Figures:
    """Measure model databases of growing size."""
    from visup.evaluation.oracles import oracle

    figures: Figures = oracle("shape.scale").evaluate_scale(
        folder, most=views, seed=seed, progress=progress
    )
    return figures


def scale_closing(figures: Figures) -> Iterator[str]:
    """The speed of building views, and how cost grows with their number."""
    total = figures["total"]
    yield (
        f"built at {total['build_views_per_s']:.0f} views a second; "
        f"ten times the views take {total['slower']:.2f} times as long"
    )


def views_closing(figures: Figures) -> Iterator[RenderableType]:
    """Each condition, the time of a query, and the hardest objects."""
    from visup.commands.eval.tables import hardest_views, views_table

    total = figures["total"]
    yield views_table(total)
    yield (
        f"{total['ms_query']:.1f} ms a query, {total['compared']:.1%} of views compared, "
        f"{total['build_views_per_s']:.0f} views built per second"
    )
    yield hardest_views(figures["items"])


def machines_closing(figures: Figures) -> Iterator[RenderableType]:
    """The baseline's figures, if there are any, and how many verdicts are right."""
    from visup.commands.eval.figures_table import figures_tables

    if "baseline" in figures:
        rows = {n: i["baseline"] for n, i in figures["items"].items()}
        keys = ("verdict", "verdicts_right", "stage_f1", "actors", "contact_f1", "move_f1", "ms")
        baseline = {"items": rows, "total": figures["baseline"]}
        yield from figures_tables("baseline: CSRT on the taught boxes", baseline, keys)
    total = figures["total"]
    yield f"{total['verdicts_right']} of {total['verdicts']} verdicts are right"


def random_worlds(kind: list[str] | None, progress: Progress, **settings: Any) -> Figures:
    """Evaluate random worlds."""
    from visup.commands.render import require_renderer
    from visup.evaluation.machines.random_worlds import evaluate_random

    require_renderer()
    return evaluate_random(kinds=kind or (), progress=progress, **settings)


def learning(kind: list[str] | None, progress: Progress, **settings: Any) -> Figures:
    """Evaluate tasks learned from runs."""
    from visup.commands.render import require_renderer
    from visup.evaluation.learning.runner import evaluate_learning

    require_renderer()
    return evaluate_learning(kinds=kind or (), progress=progress, **settings)


def learning_closing(figures: Figures) -> Iterator[str]:
    """The runs that are judged wrong, and how many missions meet the threshold."""
    for kind, item in figures["items"].items():
        if item["wrong"]:
            yield f"{kind}: judged wrong: {', '.join(item['wrong'])}"
        if "failed" in item:
            yield f"{kind}: {item['failed']}"
    yield "{held} of {missions} missions hold the bar".format(**figures["total"])


def learning_failed(figures: Figures) -> bool:
    """Whether a mission misses its threshold."""
    return bool(figures["total"]["held"] < figures["total"]["missions"])


def random_closing(figures: Figures) -> Iterator[str]:
    """The worlds whose verdict is wrong, and how many verdicts are right."""
    for name, world in figures["worlds"].items():
        if not world["verdicts_right"]:
            yield f"{name}: {world['verdict']}, not {' or '.join(world['accept'])}"
    for name, total in (("visup", figures["total"]), ("CSRT", figures.get("baseline"))):
        if total:
            yield f"{name}: {total['verdicts_right']} of {total['verdicts']} verdicts are right"


def random_orbits(progress: Progress, **settings: Any) -> Figures:
    """Evaluate random missions in orbit."""
    from visup.commands.render import require_renderer
    from visup.evaluation.missions.random_orbits import evaluate_orbits

    require_renderer()
    return evaluate_orbits(progress=progress, **settings)


def orbits_closing(figures: Figures) -> Iterator[str]:
    """The missions whose verdict is wrong, and how many verdicts are right."""
    for name, mission in figures["items"].items():
        if not mission["verdicts_right"]:
            yield f"{name}: {mission['verdict']}, not {mission['verdict_true']}"
    total = figures["total"]
    yield f"{total['verdicts_right']} of {total['verdicts']} verdicts are right"


def reasoning(
    folder: Path, *, merge: bool, long: int, progress: Progress, **settings: int
) -> Figures:
    """Evaluate reasoning alone; a nonzero `long` instead measures memory and speed over that many frames."""
    if long:
        from visup.evaluation.runtime.endurance import evaluate_endurance

        return evaluate_endurance(long, progress=progress)
    from visup.evaluation.reasoning.simulated_missions import evaluate_reasoning
    from visup.evaluation.simulation.percepts import PerceptNoise

    noise = PerceptNoise(merge_coupled=merge)
    return evaluate_reasoning(folder, **settings, noise=noise, progress=progress)


def reasoning_closing(figures: Figures) -> Iterator[RenderableType]:
    """The calibration of identities."""
    from visup.commands.eval.tables import reliability_table

    if "reliability" in figures["total"]:
        yield reliability_table(figures)


def relations_settings(options: dict[str, Any]) -> dict[str, Any]:
    """The options of `visup eval relations`, and the fixed settings."""
    from visup.evaluation.oracles import oracle

    return {**options, **oracle("reasoning.relations").settings_of_record()}


def relations_closing(figures: Figures) -> Iterator[str]:
    """The errors that the oracles found."""
    yield "of {draws} random pairs, RCC-8 is wrong in {rcc8_wrong}, QTC in {qtc_wrong}".format(
        **figures["total"]
    )


def rules_closing(figures: Figures) -> Iterator[str]:
    """A note if there was nothing to compare with."""
    if not figures["total"]["rtamt"]:
        yield "rtamt is not installed: nothing was compared with it (pip install rtamt)"


def rules_differ(figures: Figures) -> bool:
    """Whether any formula differs from the oracle."""
    return any(item.get("different") for item in figures["items"].values())


def peers_closing(figures: Figures) -> Iterator[str]:
    """The first cases that differ from the peer."""
    for case in figures["differing"][:20]:
        yield f"{case['outcome'].replace('_', ' ')}: {case['id']} ({case['of']})"


def peers_differ(figures: Figures) -> bool:
    """Whether a case differs beyond the documented differences of semantics."""
    return bool(figures["total"]["differ"])


def recognition(grammars: int, tasks: int, seed: int, progress: Progress) -> Figures:
    """Evaluate the recognition of random tasks against its thresholds."""
    from visup.evaluation.oracles import oracle

    figures, thresholds = oracle("reasoning.recognition").evaluate_recognition(
        grammars, tasks, seed, progress
    )
    return {"total": figures, "items": {}, "bars": thresholds}


def recognition_closing(figures: Figures) -> Iterator[RenderableType]:
    """All figures, and the thresholds that are met."""
    from visup.commands.eval.tables import totals_table

    yield totals_table(figures)
    for threshold, met in figures["bars"].items():
        yield f"{'held' if met else 'MISSED'}: {threshold}"


def tasks_closing(figures: Figures) -> Iterator[RenderableType]:
    """All figures, and the first failures."""
    from visup.commands.eval.tables import totals_table

    yield totals_table(figures)
    yield from figures["failures"]


def resume(kills: int, seed: int, demo: bool, progress: Progress) -> Figures:
    """Evaluate runs that are killed and resumed."""
    from visup.evaluation.runtime.resume import evaluate_resume
    from visup.runs.demo import demo_settings

    return evaluate_resume(
        demo_settings(5) if demo else None,
        kills=kills,
        seed=seed,
        state_every_s=4.0 if demo else 0.4,
        progress=progress,
    )


def resume_failed(figures: Figures) -> bool:
    """Whether a resumed run differed from the uninterrupted one, or lost anything."""
    total = figures["total"]
    return bool(total["equal"] < total["kills"] or total["lost"] > 0)


def soak(frames: int, traffic: float, progress: Progress) -> Figures:
    """Measure a long run; with `traffic`, that many hours of three lanes of cars instead."""
    if traffic:
        from visup.evaluation.runtime.traffic import evaluate_traffic

        return evaluate_traffic(traffic, progress=progress)
    from visup.evaluation.runtime.soak import evaluate_soak

    return evaluate_soak(frames, progress=progress)


def totals_closing(figures: Figures) -> Iterator[str]:
    """Each total on its own line."""
    for name, value in figures["total"].items():
        yield f"{name}: {value:.6g}"


def stepping_closing(figures: Figures) -> Iterator[str]:
    """The totals, and the thresholds that were missed."""
    from visup.evaluation.runtime.stepping import missed_bars

    yield from totals_closing(figures)
    yield from missed_bars(dict(figures))


def stepping_failed(figures: Figures) -> bool:
    """Whether a threshold was missed."""
    from visup.evaluation.runtime.stepping import missed_bars

    return bool(missed_bars(dict(figures)))


def failures_closing(template: str) -> Callable[[Figures], Iterator[str]]:
    """A function that lists the first failures, each in a format."""

    def closing(figures: Figures) -> Iterator[str]:
        for failure in figures["failures"][:20]:
            yield template.format(**failure)

    return closing


def hardening_closing(figures: Figures) -> Iterator[str]:
    """Race conditions and power cuts, then the first failures."""
    total = figures["total"]
    yield f"{total['races']} races and {total['cuts']} cuts of power: {total['lost']} lost something."
    yield from failures_closing("{text}")(figures)


def any_failures(figures: Figures) -> bool:
    """Whether there were failures."""
    return bool(figures.get("failed", figures.get("failures")))


def archive_closing(figures: Figures) -> Iterator[str]:
    """One line for each part."""
    for name, part in figures["items"].items():
        values = (f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in part.items())
        yield f"{name}: {', '.join(values)}"


def anything_different(figures: Figures) -> bool:
    """Whether results differ that should be equal."""
    return bool(figures["total"]["different"])


def serving_closing(figures: Figures) -> Iterator[str]:
    """The faults, and how the service handled them."""
    total = figures["total"]
    yield (
        f"{total['kills']} kills, {total['troubles']} troubles of streams, {total['reloads']} reloads, "
        f"{total['sink_down']} times the sink was down ({total['refused']} records refused), "
        f"{total['disk_full']} times the disk was full"
    )
    yield (
        f"a camera is back in {total['median_s']:.1f} s (median), at most {total['slowest_s']:.1f} s; "
        f"{total['not_back']} not back; memory {100 * total['memory_growth']:+.1f} %; "
        f"closed in {total['closing_s']:.1f} s with exit code {total['exit_code']}"
    )
    yield (
        f"one camera of 640x480 at 5 frames a second takes {100 * total['idle_cpu']:.1f} % of a processor "
        f"while nothing moves ({100 * total['idle_cpu_without_rest']:.0f} % without rest), "
        f"{100 * total['busy_cpu']:.0f} % while something does"
    )


def serving_failed(figures: Figures) -> bool:
    """Whether an alert was lost or sent twice, or a camera was down too long."""
    from visup.evaluation.serving.rehearsal import failed

    return failed(figures)
