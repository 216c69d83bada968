"""[study]: name, title and question."""

from __future__ import annotations

from sweep.study.model import StudySection
from sweep.study.reading import Reading


def read(reading: Reading) -> None:
    """Read the table."""
    about = reading.section(StudySection, "study")
    reading.fields |= {"name": about.name or "", "title": about.title, "question": about.question}
