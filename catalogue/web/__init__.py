"""The page in the browser: request form, animated answers, comparison, own linkages, gallery.

`wish` parses an address like a command line.  `desk` dispatches questions to worker processes, in
which `asked`, `guides`, `own` and `gallery` answer them.  `application` renders `templates` and
`static`. `guard` admits holders of the printed token and refuses other sites; `connection` drops
slow clients. Only loopback is served, the database is only read, and the server is stateless: all
state is in the address.  Import `serve` from `server`, which needs the extra `web`.
"""
