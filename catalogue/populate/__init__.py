"""Fill the database: draw linkages, trace their guided points, keep a cover of them.

`fill` drives, `plan` shares the work out, `workers` runs blocks in processes.  Of a block,
`elements` chooses the points that are traced, `cover` those that are kept, `rows` measures them.
`named_guides` adds those of the literature, `collect` the specimens of collections.  Import from
the modules; they import `plugin`, `series`, `store` and what lies below.
"""
