"""What the effects cost, as `make bench-effects` measured it last and wrote it here; not edited by hand.

Name: nanoseconds per pose of all pose outputs together, nanoseconds per design of all design outputs together.
"""

COSTS: dict[str, tuple[float, float]] = {
    "motion": (15.0, 0.0),
    "pressure": (58.0, 0.0),
    "pressure_extrema": (0.0, 2500.0),
    "coupler": (66.0, 0.0),
    "kinetostatics": (250.0, 0.0),
    "slider_kinetostatics": (250.0, 0.0),
    "friction": (770.0, 0.0),
    "slider_friction": (1400.0, 0.0),
    "speed_fluctuation": (290.0, 170000.0),
    "slider_speed_fluctuation": (530.0, 280000.0),
    "speed_fluctuation_friction": (31000.0, 23000000.0),
    "slider_speed_fluctuation_friction": (30000.0, 20000000.0),
    "sliding_bearings": (80.0, 0.0),
    "rolling_bearings": (96.0, 0.0),
    "sliding_limits": (900.0, 0.0),
    "rolling_limits": (940.0, 0.0),
    "bearing_life": (170.0, 150000.0),
    "elasticity": (17.0, 0.0),
    "slider_elasticity": (16.0, 0.0),
    "dynamic_elasticity": (420.0, 210000.0),
    "slider_dynamic_elasticity": (380.0, 210000.0),
    "tool": (49.0, 0.0),
    "thread_contour": (35.0, 0.0),
    "thread_speed": (21.0, 0.0),
    "capstan": (39.0, 0.0),
}
