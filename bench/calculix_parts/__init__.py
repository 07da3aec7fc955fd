"""Finite-element models of the scenes, CalculiX decks of them, and their runs.

`mesh` makes blocks of elements, `snapfit` and `rubber` the models of the scenes (`model`), `deck`
CalculiX's input of a model, and `runs` runs it. Lengths are in mm, forces in N, stresses in MPa.
"""
