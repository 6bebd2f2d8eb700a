"""A picture of a SCARA with its frames, and a note that is added to it."""

from pathlib import Path

from kinegen.io.load import load
from kinegen.tools.pictures import plot, save

robot = load("robots/scara.yaml")
figure = plot(robot, [0.4, 0.6, -0.1], frames=True, dimensions=True, side=(-60, 25))
figure.text(0.02, 0.02, "SCARA", fontsize=12)

Path("build").mkdir(exist_ok=True)
save(figure, "build/scara.pdf")
print(Path("build/scara.pdf").stat().st_size > 10_000)
