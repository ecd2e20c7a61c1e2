"""Numerical continuation by numpy: follow curves of poses by predictor and corrector.

`curve` has the interface of equations and the nodes of curves; `newton` corrects states onto a
curve, `tracing` steps along it, `dead_points` finds extrema of its drive.  `native` is the compiled
counterpart.
"""
