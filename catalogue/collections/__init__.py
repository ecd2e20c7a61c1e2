"""Collections: kinds of mechanisms other than linkages of two dyads, each from a plugin.

`spec` is the author's guide and the types of a plugin, `bounds` checks requests, `results` holds
answers; `find.specimens` searches.
"""
