"""What families share: closures of cranks and sliders, joints, bodies, a thread's path, the scheme of a status."""
