"""The task files that ship with visup; `visup task list` names them."""
