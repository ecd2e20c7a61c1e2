"""Filling of the database: draw linkages, trace what they guide, keep those in proportion.

`fill` drives, `plan` shares out, `workers` runs blocks in processes; of a block, `elements` chooses
what is worth tracing, `cover` what is kept, `rows` measures; `named_guides` adds those of the
literature, `collect` the specimens of collections.  Import from the modules; they import `plugin`,
`series`, `store` and what lies below.  The room itself imports none of them: a process that makes
blocks needs no database.
"""
