"""Calibration: measurements in; the numbers of the table that fit them, and how well they are known, out.

table         CSV or Parquet text           -> columns of cells, each with its place
measurements  columns                       -> Measurements: joint vectors, and what was measured at each
choice        words of --fit                -> names of entries and parameters
parallel      Robot                         -> the same robot with a second twist between nearly parallel axes
arm           Robot                         -> poses and their derivatives, by compiled kernels
residuals     arm, Measurements             -> weighted differences and their derivatives
identify      derivatives                   -> what the measurements cannot distinguish, which is then fixed
solve         residuals                     -> the fit, with standard deviations
judge, suggest  the fit                     -> cross-validation, outliers, regions, poses to measure next
rewrite       the fit, the text of the file -> the calibrated robot file
study         all of the above, in order
"""
