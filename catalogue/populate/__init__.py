"""Fill the database: sample linkages, trace their guided points, keep a cover of them.

`fill` drives, `plan` divides the work, `workers` runs blocks in processes. Within a block,
`elements` selects the points to trace, `cover` those to keep, `rows` measures them. `named_guides`
adds guides of the literature, `collect` the specimens of collections. Import from the modules; they
import `plugin`, `series`, `store` and what lies below.
"""
