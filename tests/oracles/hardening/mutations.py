"""Damage to a file, drawn by a seed: bytes, pieces, numbers, and words of its own kind."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence

MAX_BYTES = 400_000
NUMBERS = (b"0", b"-1", b"1e999", b"nan", b"99999999999999999999", b"-2147483649", b"1" * 400, b"")
BYTES = (0, 1, 0x7F, 0x80, 0xFE, 0xFF)

ODD = (
    *(b"(" * 500, b"not " * 300, b"\x00", b"\xff\xfe", "\u202e".encode()),
    *(b'"', b"[[", b"{", b"\n" * 50),
)

Damage = Callable[[bytearray, random.Random], None]


def _flip(data: bytearray, rng: random.Random) -> None:
    for _ in range(rng.choice((1, 1, 4, 32))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _extreme(data: bytearray, rng: random.Random) -> None:
    at, count = rng.randrange(len(data)), rng.choice((1, 2, 4, 8))
    data[at : at + count] = bytes([rng.choice(BYTES)]) * count


def _cut(data: bytearray, rng: random.Random) -> None:
    del data[rng.randrange(len(data)) :]


def _drop(data: bytearray, rng: random.Random) -> None:
    at = rng.randrange(len(data))
    del data[at : at + rng.choice((1, 3, 16, 200))]


def _repeat(data: bytearray, rng: random.Random) -> None:
    at, count = rng.randrange(len(data)), rng.choice((2, 20, 200))
    piece = bytes(data[at : at + count])
    data[at:at] = piece * rng.choice((1, 2, 50, 400))


def _move(data: bytearray, rng: random.Random) -> None:
    at, to, count = rng.randrange(len(data)), rng.randrange(len(data)), rng.choice((2, 20, 200))
    piece = bytes(data[at : at + count])
    del data[at : at + count]
    data[to:to] = piece


def _number(data: bytearray, rng: random.Random) -> None:
    found = list(re.finditer(rb"\d+(?:\.\d+)?", bytes(data[:MAX_BYTES])))
    if found:
        where = rng.choice(found)
        data[where.start() : where.end()] = rng.choice(NUMBERS)


def _word(data: bytearray, rng: random.Random) -> None:
    """Put one word of the file in the place of another."""
    found = list(re.finditer(rb"[A-Za-z_]+|[^\w\s]", bytes(data[:MAX_BYTES])))
    if len(found) > 1:
        where, other = rng.choice(found), rng.choice(found).group()
        data[where.start() : where.end()] = other


def _insert(data: bytearray, rng: random.Random) -> None:
    at = rng.randrange(len(data))
    data[at:at] = rng.choice(ODD)


DAMAGES: tuple[Damage, ...] = (
    _flip, _flip, _extreme, _cut, _drop, _repeat, _move, _number, _number, _word, _insert,
)  # fmt: skip


def mutated(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """One of some sound files, damaged once or a few times."""
    data = bytearray(rng.choice(seeds))
    for _ in range(rng.choice((1, 1, 2, 5))):
        if data:
            rng.choice(DAMAGES)(data, rng)
    return bytes(data[: 4 * MAX_BYTES])
