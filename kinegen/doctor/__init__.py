"""Which small change of a robot file makes it agree with poses that were measured or printed?

In: a `Robot`, its text, and observed poses. Out: `Diagnosis`, the changes that explain the poses, each as a difference
of the file. `poses` and `pose_file` read the poses, `table` turns the robot into numbers, `settings` and `edits` list
what may be wrong, `space` holds what can be tried, `search` tries singles, pairs and triples with one vectorised
product (`product`), `mounts` solves for an unknown base or tool, `separate` compares what fits, `rewrite` changes the
text, and `diagnosis` puts the answer together.
"""
