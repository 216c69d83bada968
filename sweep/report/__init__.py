"""The report about a dataset: one HTML file that needs no network, its figures, and the tables behind them."""

from __future__ import annotations

from sweep.report.page import write_report

__all__ = ["write_report"]
