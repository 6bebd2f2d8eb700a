"""Calibration: measurements in; the numbers of the table that fit them, and how well they are known, out.

measurement_file   CSV or Parquet        -> columns of cells, each with its place
measurements       columns               -> Measurements: joint vectors, and what was measured at each
fitted_parameters  words of --fit        -> names of entries and parameters; second twists of nearly parallel axes
arm_model          Robot                 -> poses and their derivatives, by compiled kernels
residuals          arm, Measurements     -> weighted differences and their derivatives
solve              residuals             -> the fit, with standard deviations; what cannot be distinguished is fixed
evaluation         the fit               -> cross-validation, outliers, regions, poses to measure next
plausibility       the fit               -> wrong units and robots, errors that no table corrects
rewrite            the fit, the file     -> the calibrated robot file
run                all of the above, in order
"""
