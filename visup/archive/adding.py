"""Recorded runs into a lake."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from itertools import chain
from pathlib import Path

from visup.agent.storage.journal_reader import Recording, event_text
from visup.archive.finding.beliefs import BeliefRecorder
from visup.archive.identity import run_key, settings_hash
from visup.archive.inputs import run_inputs
from visup.archive.lake import Lake
from visup.archive.run_tables import Provenance, run_tables
from visup.runs.resume import recorded_settings


def add_run(lake: Lake, run: Path, labels: Mapping[str, str] | None = None) -> tuple[str, bool]:
    """Add a finished run to a lake.

    The run is identified by its recording, since the video and the models may be gone or changed by now.

    Args:
        lake: The lake.
        run: A run folder, or the journal in it.
        labels: Labels of the run.

    Returns:
        Its key, and whether it was added; False if the lake has it already.

    Raises:
        VisupError: It has not ended, is damaged, or a file that its settings name is gone.
    """
    recording = Recording.open(run)
    facts = recording.facts()
    settings = recorded_settings(facts, str(recording.path))
    source = Path(settings.source)
    recorded, by = recording_hash(recording), settings_hash(settings)
    key = run_key(recorded, by, str(facts.get("visup")))
    if lake.has(key):
        return key, False
    taken = source.stat().st_mtime if source.exists() else None
    provenance = Provenance(key, recorded, by, taken, labels or {})
    notes = BeliefRecorder()
    tables = run_tables(recording, settings, provenance, notes)
    return key, lake.commit(tables, recording, run_inputs(settings), notes.content())


def recording_hash(recording: Recording) -> str:
    """SHA-256 of the beliefs and events of a run, step by step."""
    digest = hashlib.sha256()
    for line in chain(recording.events(), recording.summaries()):
        digest.update(event_text(line).encode(errors="surrogateescape"))
    return digest.hexdigest()
