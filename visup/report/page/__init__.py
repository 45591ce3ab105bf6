"""The page of a run's report: one HTML file that opens offline.

Read in this order: `summary` (the run in sentences), `figures` and `distance_figures` (Plotly
figures), `task_trees`, `sections` (the parts of the page), `html` (the page, with `report.html`,
`report.css`, `figures.js` and `report.js`). Public name: `html.write_report`.
"""
