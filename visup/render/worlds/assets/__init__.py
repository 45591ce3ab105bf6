"""Assets of random worlds: surroundings, light, machines, robot arms, clutter.

`scenery.py` makes the surroundings, `machines.py` and `robot.py` the machines, `clutter.py` small objects and
passers-by.
"""
