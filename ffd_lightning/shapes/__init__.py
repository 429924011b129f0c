"""The embedded dataset: parametric models of the paper's 13 categories.

A module per category, named as in `data/categories.py`, has `PARTS`, the names of its parts, and
`FAMILIES`, its structural families by name: functions from a random generator to a `Builder`.
`shapes` holds the primitives and materials they are built of, `parts` what several families share,
`source` hands the models out.
"""
