"""What `bench/work_precision.py` is made of: problems, solvers' runs, pictures."""
