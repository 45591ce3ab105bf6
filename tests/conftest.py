"""Hypothesis profiles: the same examples in every ordinary run, new ones when asked for.

`HYPOTHESIS_PROFILE=explore make test` looks for new counterexamples.

Hypothesis also tries numbers that stand in the modules that happen to be imported, which differ
from run to run where several processes share the tests. Ordinary runs do without these.
"""

from __future__ import annotations

import gc
import os
import tempfile
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
import typer.testing
from hypothesis import settings
from hypothesis.internal.conjecture.providers import AVAILABLE_PROVIDERS, HypothesisProvider
from hypothesis.internal.constants_ast import Constants
from typer.main import get_command

# As `visup` itself does, before NumPy is imported: threads of the linear algebra cost a fifth more than one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# As `visup` does in processes that share the cores, here with the other worker: OpenCV takes one thread, too.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OPENCV_FOR_THREADS_NUM", "1")
# States of runs are sealed with a key of the user; tests make their own, and leave his alone.
os.environ.setdefault("VISUP_STATE_KEY", str(Path(tempfile.mkdtemp()) / "state.key"))

# To put a command with its groups together takes typer a fifth of a second, in each call that a test makes.
typer.testing._get_command = cache(get_command)  # type: ignore[attr-defined]


class SameProvider(HypothesisProvider):
    """Draws as usual, without what was imported."""

    @property
    def _local_constants(self) -> Constants:
        return Constants()


AVAILABLE_PROVIDERS["visup-same"] = SameProvider
settings.register_profile(
    "same", derandomize=True, deadline=None, backend="visup-same", max_examples=30
)
settings.register_profile("explore", deadline=None, print_blob=True, max_examples=500)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))


def pytest_collection(session: pytest.Session) -> None:
    """Of two workers one loads the test modules from the end: each rewrites half of the asserts for both.

    pytest keeps what it has rewritten beside the module; on a fresh clone both would rewrite all of them at
    the same time, for 5 s.
    """
    worker = getattr(session.config, "workerinput", {}).get("workerid")
    whole = session.config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if worker != "gw1" or not whole:
        return
    root = session.config.rootpath
    for path in sorted((root / "tests").rglob("test_*.py"), reverse=True):
        # What cannot be loaded, or skips itself, is told by the collection.
        with suppress(Exception, pytest.skip.Exception):
            import_module(".".join(path.relative_to(root).with_suffix("").parts))


def pytest_collection_finish() -> None:
    """Thousands of tests and all modules stay to the end: the garbage collector need not look at them.

    With its usual thresholds it takes a seventh of the time of tests that make many small records.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def pytest_unconfigure() -> None:
    """What was left alone is freed as usual at the end."""
    gc.unfreeze()
