"""``python -m sweep``: the command line."""

from __future__ import annotations


def main() -> None:
    """Run the command line."""
    from sweep.cli import main as command_line

    command_line()


if __name__ == "__main__":
    main()
