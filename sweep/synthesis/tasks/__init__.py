"""The eight tasks of Polukhin's engineering method as problems with a common interface; docs/tasks.md."""

from sweep.synthesis.tasks.crank_rocker import EngineeringMethod as EngineeringMethod
from sweep.synthesis.tasks.crank_rocker import Task4 as Task4
from sweep.synthesis.tasks.driven import SlotPosition as SlotPosition
from sweep.synthesis.tasks.driven import Task5 as Task5
from sweep.synthesis.tasks.driven import Task8 as Task8
from sweep.synthesis.tasks.positions import Position as Position
from sweep.synthesis.tasks.positions import Task1 as Task1
from sweep.synthesis.tasks.positions import Task2 as Task2
from sweep.synthesis.tasks.problem import Solution as Solution
from sweep.synthesis.tasks.problem import SynthesisTask as SynthesisTask
from sweep.synthesis.tasks.second_stage import Task6 as Task6
from sweep.synthesis.tasks.second_stage import Task7 as Task7
from sweep.synthesis.tasks.solver import solve as solve
from sweep.synthesis.tasks.task3 import Setting as Setting
from sweep.synthesis.tasks.task3 import Task3 as Task3
from sweep.synthesis.tasks.task3 import adjustments as adjustments
