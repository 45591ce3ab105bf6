"""Pictures of shapes, for people: `pictures.py` says what is drawn, `sheet.py` is what it is drawn on."""
