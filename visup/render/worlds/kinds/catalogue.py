"""All kinds of random worlds."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from visup.agent.model.errors import SettingsError
from visup.render.worlds.kinds import (
    bench,
    boats,
    charge,
    conveyor,
    crane,
    fetch,
    handover,
    inspect,
    pick,
    walker,
)
from visup.render.worlds.kinds.kind import WorldKind
from visup.render.worlds.world import World

KINDS: Mapping[str, WorldKind] = {
    k.name: k
    for k in (
        WorldKind("pick", pick.OUTCOMES, pick.build),
        WorldKind("charge", charge.OUTCOMES, charge.build),
        WorldKind("inspect", inspect.OUTCOMES, inspect.build),
        WorldKind("crane", crane.OUTCOMES, crane.build),
        WorldKind("boats", boats.OUTCOMES, boats.build),
        WorldKind("handover", handover.OUTCOMES, handover.build),
        WorldKind("walker", walker.OUTCOMES, walker.build),
        WorldKind("conveyor", conveyor.OUTCOMES, conveyor.build),
        WorldKind("fetch", fetch.OUTCOMES, fetch.build),
        WorldKind("bench", bench.OUTCOMES, bench.build),
    )
}


def known_kinds(kinds: Sequence[str]) -> tuple[str, ...]:
    """The kinds of these names; all if empty.

    Raises:
        SettingsError: A kind does not exist.
    """
    for kind in kinds:
        if kind not in KINDS:
            raise SettingsError(f"there is no kind of world {kind!r}", expected=", ".join(KINDS))
    return tuple(kinds) or tuple(KINDS)


def random_world(kind: str, seed: int, outcome: str | None = None) -> World:
    """A world of a kind; deterministic for a kind, seed and outcome.

    Args:
        kind: One of `KINDS`.
        seed: Random seed.
        outcome: The outcome; if None, drawn from the seed, with success in half of the worlds.

    Raises:
        SettingsError: The kind does not exist, or does not have that outcome.
    """
    known_kinds((kind,))
    world_kind = KINDS[kind]
    # With the kind in the seed, kinds draw different numbers from the same seed.
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode())])
    drawn = world_kind.outcomes[0]
    if rng.random() > 0.35:
        drawn = world_kind.outcomes[int(rng.integers(1, len(world_kind.outcomes)))]
    if outcome is not None and outcome not in world_kind.outcomes:
        raise SettingsError(
            f"a world of kind {kind!r} cannot go {outcome!r}",
            expected=", ".join(world_kind.outcomes),
        )
    chosen_outcome = outcome or drawn
    return replace(
        world_kind.build(rng, chosen_outcome), name=f"{kind}_{seed:04d}_{chosen_outcome}"
    )
