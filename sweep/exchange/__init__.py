"""Points of a drawing in; hardpoints, CAD, animation, simulation models and motion laws out."""
