"""Pictures of mechanisms in space: ``scene`` is what is seen, ``figure`` draws it, ``lettering``
places what is written, ``curves`` plots over the drive.  It knows no mechanism:
``jointed/picture.py`` makes scenes of motions."""
