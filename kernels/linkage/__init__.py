"""Common parts of the families: closures of cranks and sliders, joints, bodies, a thread's path, statuses."""
