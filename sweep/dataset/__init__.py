"""Dataset folder of a sweep: immutable Parquet chunks, lock, reading, comparison and verification."""
