"""Web pages that hold everything and ask the network for nothing: the page and plots in SVG.

Shared by the reports of workbench and structures; it knows neither of them.
"""
