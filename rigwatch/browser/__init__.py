"""The workbench in a browser: the same engine and the same ledger as the commands.

server ──▶ work      one process a study: fits, progress, an end at any time
  │ └────▶ views     pages and their parts, drawn from results on disk
  └──────▶ signals   what a chart asks for, from a pyramid of extremes
"""
