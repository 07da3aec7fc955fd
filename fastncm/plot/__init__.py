"""Pictures of curves, shapes and design studies (matplotlib, no global state)."""

from fastncm.plot.run import plot_curve, plot_run

__all__ = ["plot_curve", "plot_run"]
