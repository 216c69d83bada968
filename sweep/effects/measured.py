"""What the effects cost, as `make bench-effects` measured it last and wrote it here; not edited by hand.

Name: nanoseconds per pose of all pose outputs together, nanoseconds per design of all design outputs together.
"""

COSTS: dict[str, tuple[float, float]] = {
    "motion": (13.0, 0.0),
    "pressure": (59.0, 0.0),
    "pressure_extrema": (0.0, 2800.0),
    "coupler": (83.0, 0.0),
    "kinetostatics": (330.0, 0.0),
    "slider_kinetostatics": (290.0, 0.0),
    "friction": (910.0, 0.0),
    "slider_friction": (1200.0, 0.0),
    "speed_fluctuation": (330.0, 190000.0),
    "slider_speed_fluctuation": (560.0, 300000.0),
    "sliding_bearings": (75.0, 0.0),
    "rolling_bearings": (110.0, 0.0),
    "sliding_limits": (960.0, 0.0),
    "rolling_limits": (990.0, 0.0),
    "bearing_life": (210.0, 180000.0),
    "elasticity": (18.0, 0.0),
    "slider_elasticity": (17.0, 0.0),
    "dynamic_elasticity": (430.0, 220000.0),
    "slider_dynamic_elasticity": (380.0, 240000.0),
}
