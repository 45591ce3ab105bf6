"""The report of a run: data collected during the run, annotated pictures and video, a page to read.

Read in this order: `records` (what a report is made of), `bounded_buffers`, `moments` and `collector`
(collected during a run), `annotate`, `crops` and `video` (pictures). The folder `page` makes the HTML
page of it, `motion_debug` draws the internals of the segmenter.

Public names: `collector.Collector`, `records.RunData`, `page.html.write_report`, `annotate.annotate`,
`video.AnnotatedVideo`. Import from those modules; this one stays empty, so that the command starts
quickly.
"""
