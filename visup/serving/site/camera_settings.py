"""A camera of the site file as settings of a run, with file names resolved and secrets filled in."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from visup.agent.plugins.factory import MODULE_PATH
from visup.agent.storage.jsonable import to_jsonable
from visup.percepts.video.looped import LOOP
from visup.percepts.video.open import URL
from visup.redaction import redacted
from visup.runs.inputs.signals import BROKER
from visup.runs.settings import EvidenceOptions, RunOptions, WatchSettings
from visup.runs.unattended.quiet_hours import QuietHours
from visup.serving.site.form import CameraTable, SiteTable
from visup.serving.site.placeholders import filled
from visup.serving.site.records import ProcessLimits, SiteCamera
from visup.sinks.webhook_access import WebhookAccess
from visup.tasks import shipped_tasks
from visup.version import __version__

READ_BYTES = 2**20
CLOSING_S = 2.0
"""How long a sink may take at the end of a run, seconds: a stopped service closes within five."""

RESERVE_BYTES = 4 * 2**20
"""Reserved in each journal for a full disk: minutes of 640 x 480 pixels at 5 frames a second."""


def camera_of(
    site: SiteTable, camera: CameraTable, folder: Path, environment: Mapping[str, str]
) -> SiteCamera:
    """A camera with the settings and options of its runs.

    Args:
        site: The whole file.
        camera: The camera's table.
        folder: Folder of the site file, absolute.
        environment: Values of placeholders.

    Raises:
        SettingsError: A placeholder cannot be replaced.
    """
    settings = WatchSettings(
        source=_source(filled(camera.source, environment, folder), folder),
        tasks=tuple(_task(t, folder) for t in camera.tasks),
        models=_optional(camera.models, folder),
        actors={a: (m,) if isinstance(m, str) else m for a, m in camera.actors.items()},
        bystanders=camera.bystanders,
        rules=tuple(_path(r, folder) for r in camera.rules),
        zones=_optional(camera.zones, folder),
        signals=tuple(s if s.startswith(BROKER) else _path(s, folder) for s in camera.signals),
        detections=_optional(camera.detections, folder),
        behaviours=tuple(
            b if MODULE_PATH.fullmatch(b) else _path(b, folder) for b in camera.behaviours
        ),
        plugins=camera.plugins,
        isolate=camera.isolate,
        preset=camera.preset,
        pace=camera.pace,
        fps=camera.fps,
        fov_vertical_deg=camera.fov,
        realtime=camera.realtime,
        patience_s=camera.patience_s,
        attention=camera.attention,
        rest_s=camera.rest_s or None,
    )
    QuietHours.read(camera.quiet, site.timezone)  # reports mistakes now
    options = _options(site, camera, folder, environment)
    limits = ProcessLimits(site.limits.memory_mb, site.limits.silent_s, site.limits.start_s)
    return SiteCamera(camera.name, settings, options, limits, _fingerprint(settings))


def _options(
    site: SiteTable, camera: CameraTable, folder: Path, environment: Mapping[str, str]
) -> RunOptions:
    """How the runs of a camera are recorded, and where its alerts go."""
    sinks = (filled(s, environment, folder) for s in (*site.sinks, *camera.sinks))
    access = _access(site, folder, environment)
    return RunOptions(
        video=site.recording.video,
        report=site.recording.report,
        sinks=tuple(_sink(s, folder) for s in dict.fromkeys(sinks)),
        keep_gb=site.recording.keep_gb,
        state_every_s=site.recording.state_every,
        camera=camera.name,
        webhook_headers=access.headers,
        webhook_key=access.key,
        closing_s=CLOSING_S,
        evidence=_evidence(site, camera),
        run_s=3600.0 * site.recording.run_hours,
        run_bytes=int(1e9 * site.recording.run_gb),
        quiet=camera.quiet,
        timezone=site.timezone,
        reserve_bytes=RESERVE_BYTES,
    )


def _evidence(site: SiteTable, camera: CameraTable) -> EvidenceOptions | None:
    evidence = site.evidence
    if not evidence.wanted:
        return None
    link = None if evidence.link is None else f"{evidence.link.rstrip('/')}/{camera.name}"
    free = 1e9 * site.retention.free_gb
    return EvidenceOptions(evidence.before_s, evidence.after_s, evidence.memory_mb, link, free)


def _access(site: SiteTable, folder: Path, environment: Mapping[str, str]) -> WebhookAccess:
    webhooks = site.webhooks
    return WebhookAccess(
        headers={k: filled(v, environment, folder) for k, v in webhooks.headers.items()},
        key=None if webhooks.key is None else filled(webhooks.key, environment, folder),
    )


def _path(name: str, folder: Path) -> Path:
    return folder / Path(name).expanduser()


def _optional(name: str | None, folder: Path) -> Path | None:
    return None if name is None else _path(name, folder)


def _source(name: str, folder: Path) -> str:
    if name.isdecimal() or URL.match(name):
        return name
    if name.startswith(LOOP):
        return LOOP + str(_path(name.removeprefix(LOOP), folder))
    return str(_path(name, folder))


def _task(name: str, folder: Path) -> str:
    return name if name.partition(":")[0] in shipped_tasks() else str(_path(name, folder))


def _sink(name: str, folder: Path) -> str:
    kind, colon, target = name.partition(":")
    return f"{kind}:{_path(target, folder)}" if colon and kind == "file" else name


def _fingerprint(settings: WatchSettings) -> str:
    """A digest of what beliefs depend on: the settings, the files they name, the version of visup.

    The source enters without its secrets, because the digest is saved in a file.
    """
    digest = hashlib.sha256(__version__.encode())
    without_secrets = replace(settings, source=redacted(settings.source))
    digest.update(repr(to_jsonable(without_secrets)).encode())
    for path in sorted(set(_files(settings))):
        digest.update(str(path).encode())
        digest.update(_digest(path))
    return digest.hexdigest()


def _files(settings: WatchSettings) -> Iterator[Path]:
    """Files that a run reads when it begins, without the source."""
    texts = map(str, (*settings.tasks, *settings.signals, *settings.behaviours))
    # The name of a task may follow its file: `cell.task:pick`.
    paths = (Path(part) for text in texts for part in (text, text.rpartition(":")[0]) if part)
    others = (*settings.rules, settings.models, settings.zones, settings.detections)
    yield from (path for path in (*paths, *filter(None, others)) if path.is_file())


def _digest(path: Path) -> bytes:
    digest = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while piece := file.read(READ_BYTES):
                digest.update(piece)
    except OSError:
        return b""  # an unreadable file is reported when the run begins
    return digest.digest()
