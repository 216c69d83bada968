"""What compiled loops need of linear algebra, and nothing else."""
