"""The drawings of the console: frames, overlays, the timeline and flow charts of tasks."""
