"""What is made: tolerances, margins that limits give up to them, and designs that keep their limits."""
