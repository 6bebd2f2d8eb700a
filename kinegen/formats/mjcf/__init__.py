"""MJCF, the model files of MuJoCo: bodies inside bodies with their joints; geometry and dynamics are left aside."""
