"""A seam on a workpiece that turns: the UR5 follows it while its track and the turntable move."""

import numpy as np
import ur5_track_table as cell

q = np.array([0.2, 0.4, -1.9, 1.6, -1.1, 1.3, 0.2, 0.5])
target = cell.fk_tool_tip_in_workpiece(q)  # one pose of the seam, in the frame of the workpiece

for track, table in ((0.2, 0.5), (0.3, 0.6), (0.5, 0.9), (9.0, 0.5)):
    solutions, valid = cell.inverse_tool_tip_in_workpiece(target, [track, table])
    q, found = cell.inverse_tool_tip_in_workpiece(target, [track, table], nearest=q)
    print(f"track {track} m, table {table} rad: {valid.sum()} solutions, nearest {q[1:7].round(3)}")
