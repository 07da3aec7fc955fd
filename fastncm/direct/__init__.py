"""Fingers whose own side touches the target: what the modules beside this package are for jaws."""
