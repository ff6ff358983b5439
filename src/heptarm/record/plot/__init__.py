"""Plots of recordings and plans: signals over time beside their limits, histograms, spectra, the path in space.

`signals` makes a `Chart` of one recording or of several; `content` is what it shows, `chart` writes it; `figure` draws
it with Matplotlib and `page` as an interactive page with plotly. No part of it reads a file or asks an arm.
"""

from heptarm.record.plot.chart import Chart
from heptarm.record.plot.content import Band, ChartContent, ChartRow, Line, Mark
from heptarm.record.plot.signals import KINDS, chart_of, compare

__all__ = ["KINDS", "Band", "Chart", "ChartContent", "ChartRow", "Line", "Mark", "chart_of", "compare"]
