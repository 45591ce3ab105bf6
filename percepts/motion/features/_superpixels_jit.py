"""Compiled loops over the pixels of superpixels and over their neighbours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Labels = NDArray[np.int32]


@compiled
def cell_statistics(
    labels: Labels, tone: NDArray[np.uint8], busy: Floats, count: int
) -> tuple[Floats, Floats, Labels]:
    """Statistics of the pixels of each cell, in one pass.

    Args:
        labels: (h, w) cells, 0 to count - 1.
        tone: (h, w, 3).
        busy: (h, w) float32.
        count: How many cells.

    Returns:
        (count,) float32 pixels; (count, 6) float32 sums of x, y, the three tones and `busy`;
        (count, 4) int32 (left, top, right, bottom), the latter two exclusive.
    """
    height, width = labels.shape
    number, sums = np.zeros(count, np.float32), np.zeros((count, 6), np.float32)
    corners = np.zeros((count, 4), np.int32)
    corners[:, 0], corners[:, 1] = width, height
    for y in range(height):
        x = 0
        # Run by run: to add to one place again and again is slow. Sums of whole numbers are exact either way.
        while x < width:
            k, begin = labels[y, x], x
            busyness, first, second, third = sums[k, 5], 0, 0, 0
            while x < width and labels[y, x] == k:
                first, second = first + tone[y, x, 0], second + tone[y, x, 1]
                third += tone[y, x, 2]
                busyness += busy[y, x]
                x += 1
            run = x - begin
            number[k] += np.float32(run)
            sums[k, 0] += np.float32((begin + x - 1) * run // 2)
            sums[k, 1] += np.float32(y * run)
            sums[k, 2] += np.float32(first)
            sums[k, 3] += np.float32(second)
            sums[k, 4] += np.float32(third)
            sums[k, 5] = busyness
            box = corners[k]
            box[0], box[1] = min(box[0], begin), min(box[1], y)
            box[2], box[3] = max(box[2], x), max(box[3], y + 1)
    return number, sums, corners


@compiled
def cell_totals(labels: Labels, values: NDArray[Any], count: int) -> Floats:
    """Sum of a (h, w) map, most of it 0, in each cell, (count,) float32."""
    height, width = labels.shape
    out = np.zeros(count, np.float32)
    for y in range(height):
        some = 0
        for x in range(width):  # without branches: empty rows are passed over quickly
            some |= values[y, x] != 0
        if some:
            for x in range(width):
                if values[y, x] != 0:
                    out[labels[y, x]] += values[y, x]
    return out


@compiled
def dilate_cells(
    ends: Labels, neighbours: Labels, members: NDArray[np.bool_], steps: int
) -> NDArray[np.bool_]:
    """Cells within some steps of (count, K) members.

    `ends` and `neighbours` are as in CSR matrices and symmetric. Only the cells reached last are expanded,
    since most sets are small.
    """
    count, kinds = members.shape
    near = members.copy()
    reached = np.empty(count, np.int32)
    for k in range(kinds):
        begin, end = 0, 0
        for i in range(count):
            if members[i, k]:
                reached[end] = i
                end += 1
        for _ in range(steps):
            last = end
            for n in range(begin, last):
                i = reached[n]
                for at in range(ends[i], ends[i + 1]):
                    other = neighbours[at]
                    if not near[other, k]:
                        near[other, k] = True
                        reached[end] = other
                        end += 1
            begin = last
    return near


@compiled
def connected_groups(
    ends: Labels, neighbours: Labels, members: NDArray[np.bool_]
) -> tuple[Labels, Any]:
    """Groups of members that are connected by members, and how many.

    `ends` and `neighbours` are as in CSR matrices and symmetric.

    Returns:
        (count,) int32 number of each member's group, from 0 by the least of its cells; -1 for the rest.
    """
    group, reached = np.full(len(members), -1, np.int32), np.empty(len(members), np.int32)
    groups = 0
    for first in range(len(members)):
        if not members[first] or group[first] >= 0:
            continue
        reached[0], begin, end = first, 0, 1
        group[first] = groups
        while begin < end:
            i = reached[begin]
            begin += 1
            for at in range(ends[i], ends[i + 1]):
                other = neighbours[at]
                if members[other] and group[other] < 0:
                    group[other] = groups
                    reached[end] = other
                    end += 1
        groups += 1
    return group, groups


@compiled
def carry_shares(
    old: Labels, new: Labels, flow: Floats, shares: Floats, area: Floats, every: int
) -> Floats:
    """Shares of the cells of an older image, carried along the flow to a newer one.

    Args:
        old: (h, w) cells of the older image.
        new: (h, w) cells of the newer one.
        flow: (h, w, 2) float32, from the newer back to the older.
        shares: (old count, K) float32.
        area: (count,) float32, how many pixels each cell of the newer one has.
        every: Every how many pixels of a cell are sampled; the first always is.

    Returns:
        (count, K) float32 means over those pixels; those newly in view count as 0.
    """
    height, width = new.shape
    kinds = shares.shape[1]
    count = len(area)
    sampled, out = np.zeros(count, np.int32), np.zeros((count, kinds), np.float32)
    # The mean is summed share by share, so that a share of 1 stays 1 within rounding.
    part = np.empty(count, np.float32)
    for c in range(count):
        part[c] = np.float32(1) / np.float32(max((int(area[c]) + every - 1) // every, 1))
    for y in range(height):
        for x in range(width):
            c = new[y, x]
            sampled[c] += 1
            if sampled[c] > 1:
                if sampled[c] == every:
                    sampled[c] = 0
                continue
            if every == 1:
                sampled[c] = 0
            u = x + int(np.rint(flow[y, x, 0]))
            v = y + int(np.rint(flow[y, x, 1]))
            if 0 <= u < width and 0 <= v < height:
                source = old[v, u]
                for k in range(kinds):
                    out[c, k] += part[c] * shares[source, k]
    return out


@compiled
def flat_seeds(strength: Floats, cell: int, flat: float) -> tuple[Labels, Any]:
    """Seeds of a watershed, numbered from 1, and how many.

    Args:
        strength: (h, w) float32, of edges.
        cell: Spacing of the seeds.
        flat: Strength below which there is no edge worth following.

    Returns:
        (h, w) int32, 0 elsewhere: the flattest 3 x 3 pixels in each square of `cell` pixels, or the
        square's interior when it is flat throughout.
    """
    rows, cols = strength.shape[0] // cell, strength.shape[1] // cell
    seeds = np.zeros(strength.shape, np.int32)
    for row in range(rows):
        for col in range(cols):
            top, left = row * cell, col * cell
            number = row * cols + col + 1
            low, high, at_y, at_x = np.float32(np.inf), np.float32(-np.inf), top + 1, left + 1
            for y in range(top + 1, top + cell - 1):
                for x in range(left + 1, left + cell - 1):
                    s = strength[y, x]
                    high = max(high, s)
                    if s < low:
                        low, at_y, at_x = s, y, x
            if high < flat:
                seeds[top + 1 : top + cell - 1, left + 1 : left + cell - 1] = number
            seeds[at_y - 1 : at_y + 2, at_x - 1 : at_x + 2] = number
    return seeds, rows * cols


@compiled
def bounding_box(corners: Labels, members: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """(left, top, right, bottom) around some cells; (large, large, 0, 0) when there are none."""
    left, top, right, bottom = 2**30, 2**30, 0, 0
    for k in range(len(members)):
        if members[k]:
            left, top = min(left, int(corners[k, 0])), min(top, int(corners[k, 1]))
            right, bottom = max(right, int(corners[k, 2])), max(bottom, int(corners[k, 3]))
    return left, top, right, bottom


@compiled
def paint_cells(labels: Labels, corners: Labels, members: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True at the pixels of some cells and False elsewhere, (h, w)."""
    out = np.zeros(labels.shape, np.bool_)
    left, top, right, bottom = bounding_box(corners, members)
    for y in range(top, bottom):
        for x in range(left, right):
            out[y, x] = members[labels[y, x]]
    return out


@compiled
def covered_pixels(
    new: Labels,
    old: Labels,
    corners: Labels,
    members: NDArray[np.bool_],
    by: tuple[int, int],
    count: int,
) -> NDArray[np.int64]:
    """Pixels of each of `count` cells covered by some old cells moved by (x, y) pixels."""
    dx, dy = by
    out = np.zeros(count, np.int64)
    height, width = new.shape
    left, top, right, bottom = bounding_box(corners, members)
    for y in range(max(top, -dy), min(bottom, height - dy)):
        for x in range(max(left, -dx), min(right, width - dx)):
            out[new[y + dy, x + dx]] += members[old[y, x]]
    return out


@compiled
def half_size_means(
    labels: Labels, values: Floats, box: tuple[int, int, int, int], count: int
) -> Floats:
    """Mean, in each cell, of a map of a part of the image at half its size.

    Args:
        labels: (h, w) cells.
        values: (height, width) float32, of the box.
        box: (x, y, width, height), pixels at half the size.
        count: How many cells.

    Returns:
        (count,) float32; 0 where the box holds no pixel of a cell.
    """
    total, number = np.zeros(count), np.zeros(count, np.int64)
    for j in range(box[3]):
        for i in range(box[2]):
            k = labels[2 * (box[1] + j), 2 * (box[0] + i)]
            total[k] += values[j, i]
            number[k] += 1
    return (total / np.maximum(number, 1)).astype(np.float32)


@compiled
def sum_point_evidence(
    labels: Labels, xy: Floats, normal: Floats, likelihood: Floats, far: float, count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Evidence of points summed over the cells on both of their sides.

    Args:
        labels: (h, w) cells.
        xy: (N, 2) float32 positions.
        normal: (N, 2) float32 unit vectors across the edge at each.
        likelihood: (N, K) float32 log likelihood of labels.
        far: How far from a point its sides are, pixels.
        count: How many cells.

    Returns:
        (count, K) float64 sums, and (count,) float64 numbers of points.
    """
    height, width = labels.shape
    kinds = likelihood.shape[1]
    totals, number = np.zeros((count, kinds)), np.zeros(count)
    for side in (-np.float32(far), np.float32(far)):
        for n in range(len(xy)):
            x = int(np.rint(xy[n, 0] + side * normal[n, 0]))
            y = int(np.rint(xy[n, 1] + side * normal[n, 1]))
            k = labels[min(max(y, 0), height - 1), min(max(x, 0), width - 1)]
            number[k] += 1
            for i in range(kinds):
                totals[k, i] += likelihood[n, i]
    return totals, number


@compiled
def bayes_shares(
    totals: NDArray[np.float64],
    number: NDArray[np.float64],
    more: Floats,
    prior: Floats,
    least: float,
    clip: float,
) -> tuple[Floats, Floats]:
    """Posterior label shares of each cell, given its points and its pixels.

    Args:
        totals: (count, K) float64 sums of log likelihoods over points.
        number: (count,) float64, how many points.
        more: (count, K) float32 dense log likelihood; all 0 where nothing is known.
        prior: (count, K) float32 shares before.
        least: Floor added to the prior.
        clip: Log likelihood ratio at which evidence has full weight.

    Returns:
        (count, K) float32 shares; (count,) float32 weight of the evidence, 0 to 1.
    """
    count, kinds = prior.shape
    share, certainty = np.empty((count, kinds), np.float32), np.zeros(count, np.float32)
    each = np.empty(kinds)
    for c in range(count):
        scale, informed, highest = max(np.sqrt(number[c]), 1.0), number[c] > 0, -np.inf
        for k in range(kinds):
            each[k] = totals[c, k] / scale + more[c, k]
            informed |= more[c, k] != 0
            highest = max(highest, each[k])
        lowest, whole = 0.0, 0.0
        for k in range(kinds):
            off = each[k] - highest
            lowest = min(lowest, off)
            each[k] = (prior[c, k] + np.float32(least)) * np.exp(max(off, -2 * clip))
            whole += each[k]
        for k in range(kinds):
            share[c, k] = each[k] / whole
        if informed:
            certainty[c] = min(-lowest, clip) / clip
    return share, certainty
