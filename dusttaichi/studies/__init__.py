"""Many runs for one question: sweeps, trade of speed and accuracy, sticking, extremes, speed.

A study says which points it wants (points.py); engine.py runs them: as jobs (jobs.py) of a pool
(pool.py) of processes (workers.py, child.py).
"""
