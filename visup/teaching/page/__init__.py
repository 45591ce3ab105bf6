"""The window in which outlines are drawn: one small page, served to this machine's browser alone.

Read `server.py` (who is answered, and what), `requests.py` (what the page asks for), then `page.html`,
`page.js` (drawing with mouse or keys) and `page.css`.
"""
