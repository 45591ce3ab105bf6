"""Serving: many cameras at once, for months, each in a process of its own that comes back by itself.

Read `site/` (what is watched), then `site_supervisor.py` (all cameras), `camera_supervisor.py` (one, with
`backoff.py` and `run_store.py`), `camera_child.py` and `camera_process.py` (the two ends of a process, which
talk by `reports.py`; `spare_process.py` and `warm_up.py` make the next one quick). `service.py` puts all
together with what stands beside the cameras: `monitoring/` tells how they do, `room/` deletes what is not
kept, `service_manager.py` speaks to systemd.
"""
