"""The page: a wish form with moving answers, one guide with its theory, comparison, own linkages, the gallery.

`wish` reads an address as the command reads a line, `desk` hands questions to processes in which `asked`, `guides`,
`own` and `gallery` answer them, `application` shows the answers by `templates` and `static`.  `guard` lets in who has
the token that the command prints, and refuses other sites; `connection` hangs up on who is slow.  Nothing but loopback
is served, the database is only read, no server keeps a state: all there is stands in the address.  Import `serve` from
`server`, which needs the extra `web`.
"""
