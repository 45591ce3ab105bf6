"""What random worlds are furnished with: places of work, their light, machines, robot arms, clutter.

`scenery.py` makes the place, `machines.py` and `robot.py` what works there, `clutter.py` what lies about
and who comes by.
"""
