"""A model database multiplied by deformation, to see how it does with many more views."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from visup.evaluation.figures import Progress, silent
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.index.view_records import ModelView, NewView
from visup.percepts.shape.matching.shape_similarity import Shape
from visup.percepts.shape.shocks.shock_graph import ShockGraph, frozen_graph
from visup.percepts.shape.silhouette.area_overlap import area_map, paint_outline
from visup.percepts.shape.silhouette.silhouette import polygon_moments

STRENGTH = 0.18
"""Standard deviation of the stretch, and of the radii's change."""

_PIXELS, _HALF = 32, 3.6
_WAVES = 3

Warp = Callable[[NDArray[np.floating]], NDArray[np.float64]]


def augmented(
    database: ModelDatabase,
    path: Path,
    views: int,
    seed: int = 0,
    progress: Progress = silent,
) -> ModelDatabase:
    """A database of so many views: those of another, then deformed ones of them in turn.

    Args:
        database: The views to start from, at least one.
        path: Where the new database is written.
        views: How many views it gets.
        seed: Of the deformations.
        progress: Shows what is being done.

    Returns:
        The database; the same bytes for the same arguments.
    """

    def every() -> Iterator[NewView]:
        for number in range(views):
            if number % 1000 == 0:
                progress(f"{number} of {views} views")
            source = number % len(database.views)
            view, shape = database.views[source], database.shapes[source]
            yield _new(view, shape if number == source else deformed(shape, seed, number))

    return ModelDatabase.create(path, every())


def _new(view: ModelView, shape: Shape) -> NewView:
    return NewView(view.name, view.direction, view.area, shape, view.also, view.smoothing)


def deformed(shape: Shape, seed: int, number: int) -> Shape:
    """A shape stretched, bent and swollen at random, its shock graph with it.

    The graph keeps its nodes and edges; where they lie and how thick they are changes as the outline
    does. So it is not quite the graph of the new outline, but as far from those of other views.

    Args:
        shape: To be deformed.
        seed: Of all deformations.
        number: Of this one.
    """
    rng = np.random.default_rng([seed, number])
    warp = _warp(rng)
    contour = warp(shape.contour)
    area, centre = polygon_moments(contour)
    unit = max(abs(area), 1e-6) ** 0.5
    outline = ((contour - centre) / unit).astype(np.float32)
    graph = _swollen(shape.graph, warp, centre, unit, rng)
    return Shape(
        outline,
        graph,
        area_map(paint_outline(outline, _PIXELS, _HALF) > 0.6),
        shape.cut,
        shape.border,
    )


def _warp(rng: np.random.Generator) -> Warp:
    """A map of the plane: a stretch in some direction, and a few smooth waves."""
    angle, stretch = rng.uniform(0, np.pi), np.exp(rng.normal(0.0, STRENGTH))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    matrix = turn @ np.diag([stretch, 1 / stretch]) @ turn.T
    towards = rng.normal(0.0, 1.0, (_WAVES, 2))
    waves = rng.normal(0.0, 2.0, (_WAVES, 2))
    phases = rng.uniform(0, 2 * np.pi, _WAVES)

    def warp(points: NDArray[np.floating]) -> NDArray[np.float64]:
        swing = np.sin(points @ waves.T + phases) * (0.3 * STRENGTH)
        return np.asarray(points @ matrix + swing @ towards, dtype=np.float64)

    return warp


def _swollen(
    graph: ShockGraph,
    warp: Warp,
    centre: NDArray[np.float64],
    unit: float,
    rng: np.random.Generator,
) -> ShockGraph:
    """The graph with its nodes moved by the warp, and thicknesses, lengths and masses changed."""
    size = len(graph)
    swell = np.exp(rng.normal(0.0, STRENGTH, size)).astype(np.float32)
    weights = graph.weights * swell
    contexts = graph.contexts * np.exp(rng.normal(0.0, STRENGTH, graph.contexts.shape))
    moved = replace(
        graph,
        weights=weights / max(float(weights.sum()), 1e-6),
        lengths=graph.lengths * np.exp(rng.normal(0.0, STRENGTH, size)).astype(np.float32),
        profiles=graph.profiles * swell[:, None],
        contexts=(contexts / contexts.sum(axis=1, keepdims=True)).astype(np.float32),
        positions=((warp(graph.positions) - centre) / unit).astype(np.float32),
    )
    stored = ("kinds", "edges", "weights", "lengths", "profiles", "contexts", "positions")
    fields = {f: getattr(moved, f) for f in (*stored, "directions", "signatures")}
    return frozen_graph(**fields)
