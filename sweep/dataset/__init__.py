"""The folder a sweep leaves behind: immutable Parquet chunks, their lock and their comparison."""
