"""How a service does, for other programs: `/healthz`, `/readyz`, `/metrics`.

Read `camera_figures.py` (what is counted of a camera), `status.py` (all of a site at one moment),
`prometheus.py` (its form) and `endpoint.py` (who may ask).
"""
