"""Readings that are checked before they become poses; run with the built package on the path."""

import arm
import numpy as np

readings = np.tile([0.0, 0.5, 0.0, 0.0, 0.0], (20, 1))
print(arm.fk_actuators(arm.check_actuators(readings)).shape)

readings[17, 1] = 0.9
try:
    arm.check_actuators(readings)
except ValueError as error:
    print(error)
