"""All that belongs to one publication (`hpcclear.scene.describing`), for scenes that are its own.

Its Table 4 beside our designs, its claims tested on our data, and its designs under the readings of
its text. For any other scene nothing here does anything, and no file of it is written.
"""
