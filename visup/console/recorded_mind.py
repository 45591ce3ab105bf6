"""Reconstructs the mind at one moment of a recorded run from the summary in its journal.

Nothing is replayed, so it is fast however long the run. It holds less than the original mind: of relations
only couplings, no poses, no likelihoods of names; of hidden objects only their last positions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from visup.agent import (
    Alert,
    Coupling,
    Mind,
    ObjectBelief,
    Observation,
    Presence,
    Prospect,
    Region,
    StageBelief,
    Status,
    TaskBelief,
    Verdict,
)
from visup.agent.model.errors import OutputError
from visup.agent.model.object_beliefs import Candidate
from visup.agent.model.records import Health, HealthStatus


def recorded_mind(
    summary: Mapping[str, Any],
    observation: Observation,
    alerts: Iterable[Alert] = (),
    actors: Mapping[str, tuple[str, ...]] | None = None,
) -> Mind:
    """The mind after one step.

    Args:
        summary: Summary of the step, from `Recording.step_at`.
        observation: Observation of the step.
        alerts: All alerts of the run; those open at the time are included.
        actors: Actor -> its models.

    Raises:
        OutputError: The summary is not valid.
    """
    try:
        regions = {r.id: r for r in observation.of("region")}
        objects = [_belief(o, regions, observation) for o in summary["objects"]]
        return Mind(
            time=observation.time,
            frame_index=observation.frame_index,
            frame_size=observation.frame_size,
            objects=MappingProxyType({b.id: b for b in objects}),
            couplings=tuple(_coupling(c) for c in summary["couplings"]),
            tasks=tuple(_task(t) for t in summary["tasks"]),
            alerts=tuple(a for a in alerts if is_open_at(a, observation.time)),
            health=Health(
                HealthStatus(summary["health"]["status"]), str(summary["health"]["detail"])
            ),
            unknown=frozenset(map(str, summary["unknown"])),
            actors=MappingProxyType(dict(actors or {})),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as fault:
        raise OutputError(
            f"what was believed in frame {observation.frame_index} cannot be read"
        ) from fault


def is_open_at(alert: Alert, time: float) -> bool:
    """Whether an alert was open at a time, seconds."""
    return alert.opened <= time and (alert.closed is None or time < alert.closed)


def _belief(
    record: Mapping[str, Any], regions: Mapping[int, Region], observation: Observation
) -> ObjectBelief:
    presence = Presence(record["presence"])
    region = regions.get(record["region"]) if presence is Presence.SEEN else None
    shares = [(str(name), float(share)) for name, share in record["candidates"]]
    return ObjectBelief(
        int(record["id"]),
        region or _box_region(record, observation.frame_size),
        presence,
        first_seen=observation.time,
        last_seen=observation.time,
        confirmed=bool(record["confirmed"]),
        candidates=tuple(Candidate(name, 0.0, share, share) for name, share in shares),
        depth=None if record["depth"] is None else float(record["depth"]),
    )


def _box_region(record: Mapping[str, Any], size: tuple[int, int]) -> Region:
    """The last seen region: its bounding box, since the outline is not recorded."""
    x, y, w, h = (int(n) for n in record["bbox"])
    corners = [(x, y), (x + w - 1, y), (x + w - 1, y + h - 1), (x, y + h - 1)]
    return Region(
        id=int(record["region"]),
        bbox=(x, y, w, h),
        mask=np.zeros((max(0, min(h, size[1])), max(0, min(w, size[0]))), dtype=bool),
        contour=np.array(corners, np.float32),
        centroid=(x + w / 2, y + h / 2),
        area=float(record["area"]),
        velocity=(float(record["velocity"][0]), float(record["velocity"][1])),
        cut=bool(record["cut"]),
    )


def _task(record: Mapping[str, Any]) -> TaskBelief:
    confidences = record.get("sure", {})
    stages = tuple(
        StageBelief(str(n), Status(s), 0.0, float(confidences.get(n, 1.0)))
        for n, s in record["stages"].items()
    )
    success = record.get("success")
    return TaskBelief(
        str(record["task"]),
        Verdict(record["verdict"]),
        stages,
        record["current"],
        prospects=tuple(Prospect(str(n), float(p)) for n, p in record.get("next", ())),
        success=None if success is None else float(success),
    )


def _coupling(record: Mapping[str, Any]) -> Coupling:
    a, b = record["objects"]
    return Coupling((int(a), int(b)), float(record["since"]))
