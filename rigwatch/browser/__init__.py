"""The workbench in a browser: the same engine and the same ledger as the commands.

server ──▶ work      one process per study: fits, progress, cancelling
  │ └────▶ views     pages and their parts, rendered from results on disk
  └──────▶ signals   chart data, from a pyramid of extremes
"""
