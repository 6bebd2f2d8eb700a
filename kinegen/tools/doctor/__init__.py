"""Finds the small changes of a robot file that make it agree with poses that were measured or printed.

In: a `Robot`, its text, and observed poses. Out: `Diagnosis`, the changes that explain the poses, each as a difference
of the file. `observed_poses` and `pose_file` read the poses, `numeric_table` turns the robot into numbers and lists
settings, `edits` lists mistakes of entries, `hypotheses` holds what can be tried, `search` tries singles, pairs and
triples with one vectorised product (`residual`), `base_tool_fit` solves for an unknown base or tool, `findings`
compares what fits, `rewrite` changes the text, and `diagnosis` puts the answer together.
"""
