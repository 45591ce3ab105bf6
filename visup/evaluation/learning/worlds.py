"""Random worlds as runs to learn from: what is believed while the masks of a world are watched.

Masks stand in for eyes, so that learning is measured by itself: noise of a segmenter comes on top in
practice. No picture is drawn, which leaves a few seconds for a world.
"""

from __future__ import annotations

import numpy as np

from visup.agent import Frame, Mind
from visup.evaluation.machines.mask_regions import role_behaviours
from visup.render.worlds.frames import WorldRenderer
from visup.render.worlds.world import FPS, World
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent


def world_minds(world: World) -> tuple[Mind, ...]:
    """What is believed of a world frame by frame, watched without a task."""
    renderer = WorldRenderer(world)
    labels = {role: world.labels[name] for role, name in world.actors.items()}
    eyes = role_behaviours(renderer.mask, labels, FPS)
    width, height = world.size
    blank = np.zeros((height, width, 3), np.uint8)
    agent = reasoning_agent(WatchSettings(source=world.name), (), eyes)
    try:
        return tuple(
            agent.step(Frame(index, index / FPS, blank)).mind for index in range(world.frames)
        )
    finally:
        agent.close()
