"""Hard points moved inside boxes so that curves read off the motion are met best.

``boxes`` names the hard points that may move, ``targets`` says what is to be met, ``trials`` sweeps
and reads mechanisms with moved points, many at once, with derivatives; ``fit`` is the least-squares
search, ``outcome`` what it reports, ``files`` the same from a section of a file.
"""
