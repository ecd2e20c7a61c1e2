"""Collections: mechanisms of another kind than linkages, which a plugin brings, and what is asked of them.

`spec` is the author's guide and the types of a plugin, `bounds` what a request demands, `results` what an answer is;
`find.specimens` searches.  Import from the modules; they import `problem`, `store` and what lies below.
"""
