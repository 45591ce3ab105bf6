"""Health and metrics of a service for other programs: `/healthz`, `/readyz`, `/metrics`.

Read `camera_figures.py` (counters of a camera), `status.py` (the state of a site), `prometheus.py` (the
exposition format) and `endpoint.py` (the HTTP server).
"""
