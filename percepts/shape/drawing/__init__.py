"""Pictures of shapes, for people.

`contact_sheet.py` shows all that a database knows, `pictures.py` why a silhouette matches a view, and
`sheet.py` is what they are drawn on.
"""
