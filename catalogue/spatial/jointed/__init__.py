"""Mechanisms of bodies, joints and links, one or a batch of one kind, from their hard points.

`elements` is what an engineer states, `compiling` makes equations of it, `system` evaluates them: poses, screws,
wrenches.  `mechanism.Mechanism` is the front; `tracing` follows the curve of all poses, `motion` is what a sweep gives,
`circuit` the whole of a motion.  It imports `geometry`.
"""
