"""The report of a run: data collected during the run, annotated pictures and video, a page to read.

Read in this order: `records` (the data of a report), `bounded_buffers`, `moments` and `collector`
(collection during a run), `annotate`, `crops` and `video` (pictures). The folder `page` creates the HTML
page, `motion_debug` draws the internals of the segmenter.

Public names: `collector.Collector`, `records.RunData`, `page.html.write_report`, `annotate.annotate`,
`video.AnnotatedVideo`. Import from those modules; this one stays empty, so that the command starts
quickly.
"""
