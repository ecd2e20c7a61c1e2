"""What is asked: the path, the constraints and the ranking, as one frozen problem in strokes.

May import `errors` alone, and the measures that it names from `guide`.
"""
