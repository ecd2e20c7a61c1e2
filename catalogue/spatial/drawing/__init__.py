"""Pictures of mechanisms in space, independent of the kind of mechanism.

``scene`` has the contents of a picture, ``figure`` draws it, ``lettering`` places texts, ``curves``
plots over the drive.  ``jointed/picture.py`` makes scenes of motions.
"""
