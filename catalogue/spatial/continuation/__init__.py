"""Numerical continuation by numpy: follow curves of poses by predictor and corrector.

`curve` is the interface of equations, and nodes of curves; `newton` corrects onto a curve,
`tracing` steps along it, `dead_points` finds extrema of its drive.  `native` does this compiled.
"""
