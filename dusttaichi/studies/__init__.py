"""Many runs for one question: sweeps, trade of speed and accuracy, sticking, extremes, speed.

A study (study_types.py) lists its points (points.py, requests.py); study_engine.py runs them as
jobs (jobs.py) of a pool (pool.py) of worker processes (workers.py, worker_main.py).
"""
