"""Exchange with other programs: points of a drawing as input; hardpoints, CAD, animation, simulation, motion laws."""
