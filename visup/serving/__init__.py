"""Serving: many cameras at once, for months, each in its own process, which is restarted automatically.

Read `site/` (the site file), then `site_supervisor.py` (all cameras), `camera_supervisor.py` (one camera,
with `backoff.py` and `run_store.py`), `camera_child.py` and `camera_process.py` (the two ends of a process,
which communicate by `reports.py`; `spare_process.py` and `warm_up.py` speed up restarts). `service.py`
combines them with the auxiliary parts: `monitoring/` (health and metrics), `retention/` (how long runs are
kept, and disk space), `service_manager.py` (systemd).
"""
