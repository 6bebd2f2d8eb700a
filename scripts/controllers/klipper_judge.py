"""A module of Klipper's host for trials: writes down where the toolhead and its motors are, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


class Judge:
    """JUDGE notes where everything is, REFUSED tries a move and notes the answer, FINISH waits for the last message."""

    def __init__(self, config: Any) -> None:
        self.printer = config.get_printer()
        self.path = Path(config.get("path"))
        gcode = self.printer.lookup_object("gcode")
        gcode.register_command("JUDGE", self.judge)
        gcode.register_command("REFUSED", self.refused)
        gcode.register_command("FINISH", self.finish)

    def judge(self, _command: Any) -> None:
        """Note the time, the position, and each motor: where it is to be, and the steps that it has made."""
        toolhead = self.printer.lookup_object("toolhead")
        toolhead.dwell(0.05)
        time = toolhead.get_last_move_time()
        toolhead.flush_step_generation()
        at, kinematics = toolhead.get_position(), toolhead.get_kinematics()
        steppers = kinematics.get_steppers()
        status = toolhead.get_status(0.0)
        self._note(
            {
                "time": time,
                "position": at[:3],
                "motors": [each.calc_position_from_coord(at) for each in steppers],
                "steps": [each.get_mcu_position() for each in steppers],
                "distances": [each.get_step_dist() for each in steppers],
                "homed": status["homed_axes"],
                "box": [list(status["axis_minimum"])[:3], list(status["axis_maximum"])[:3]],
            }
        )

    def refused(self, command: Any) -> None:
        """Try a move by X, Y, Z; the answer is noted."""
        toolhead = self.printer.lookup_object("toolhead")
        at = toolhead.get_position()
        way = [command.get_float(axis, 0.0) for axis in "XYZ"]
        try:
            toolhead.move([a + b for a, b in zip(at, way, strict=False)] + at[3:], 10.0)
            answer = "moves"
        except self.printer.command_error as error:
            answer = str(error)
        self._note({"answer": answer})

    def finish(self, _command: Any) -> None:
        """Wait until the thread that writes messages has written the last one."""
        self.printer.lookup_object("toolhead").flush_step_generation()
        reactor = self.printer.get_reactor()
        reactor.pause(reactor.monotonic() + 1.0)

    def _note(self, what: object) -> None:
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(what) + "\n")


def load_config(config: Any) -> Judge:
    """What Klipper calls."""
    return Judge(config)
