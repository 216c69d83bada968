"""The eight tasks of Polukhin's engineering method as problems with a common interface; docs/tasks.md."""

from sweep.synthesis.tasks.crank_rocker import EngineeringMethod, Task4
from sweep.synthesis.tasks.driven import SlotPosition, Task5, Task8
from sweep.synthesis.tasks.positions import Position, Task1, Task2
from sweep.synthesis.tasks.problem import Solution, SynthesisTask
from sweep.synthesis.tasks.second_stage import Task6, Task7
from sweep.synthesis.tasks.solver import solve
from sweep.synthesis.tasks.task3 import Setting, Task3, adjustments

__all__ = [
    "EngineeringMethod", "Position", "Setting", "SlotPosition", "Solution", "SynthesisTask", "Task1", "Task2", "Task3",
    "Task4", "Task5", "Task6", "Task7", "Task8", "adjustments", "solve",
]  # fmt: skip
