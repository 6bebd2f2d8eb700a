"""The inverse in closed form: joint vectors from poses, all branches, for the families that are recognised.

axes        robot       -> the axes of its joints at q = 0
recognise   axes        -> a family with its constants (`arms`, `family`, `names`), or the conditions that fail
solve       family      -> angles of every branch as formulas (`solve_arm`, `wrists`, of `cranks` and `steps`)
solutions   angles      -> joint variables within their limits, and whether each branch holds
derive      robot       -> Expressions
"""
