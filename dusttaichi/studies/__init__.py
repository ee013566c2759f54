"""Many runs for one question: ensembles, trade of speed and accuracy, sticking, extremes, speed."""
