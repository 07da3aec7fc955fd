"""What `bench/profiles.py` is made of: the solvers' ladders, the picture and the tables."""
