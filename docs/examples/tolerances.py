"""How far tolerances of a table move the tip; run with the package on the path."""

import calibrated_2r
import numpy as np

random = np.random.default_rng(1)
count = 100_000
q = np.array([0.3, -0.5])

# Each parameter is a number or an array: 100,000 arms, whose links are right to 0.1 mm and 0.2 mrad (one sigma).
usual = calibrated_2r.Params()
arms = calibrated_2r.Params(
    L1=random.normal(usual.L1, 0.0001, count),
    L2=random.normal(usual.L2, 0.0001, count),
    tilt=random.normal(usual.tilt, 0.0002, count),
    skew=random.normal(usual.skew, 0.0002, count),
)
tips = calibrated_2r.position(q, params=arms)
print(tips.shape, "spread of the tip", (1000 * tips.std(axis=0)).round(2), "mm")

# Axes broadcast: each of 3 lengths at each of 50 joint vectors.
path = np.linspace([0.0, -1.0], [0.5, 1.0], 50)
lengths = calibrated_2r.Params(L1=np.array([[0.399], [0.400], [0.401]]))
print(calibrated_2r.position(path, params=lengths).shape)
